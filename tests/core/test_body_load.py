from pathlib import Path

import numpy as np
import pytest
import torch

from omomo_core.body.kinematics import full_kinematics, skin
from omomo_core.body.model import load_body
from omomo_core.errors import AssetError
from omomo_core.skeleton import ALL_JOINTS, joint

SMPLX_FACE = ["jaw", "left_eye", "right_eye"]
SMPLX_JOINTS = [*ALL_JOINTS[:22], *SMPLX_FACE, *ALL_JOINTS[22:]]


def smplx_arrays() -> dict[str, np.ndarray]:
    """A body of the right layout: two vertices around each joint, carried by it alone."""
    shipped = load_body().rest_joints.numpy()
    places = [
        shipped[joint(name)] if name in ALL_JOINTS else shipped[joint("head")] + 0.05
        for name in SMPLX_JOINTS
    ]
    centre = np.repeat(np.asarray(places, np.float64), 2, axis=0)
    offset = np.tile([[0.01, 0.0, 0.0], [-0.01, 0.0, 0.0]], (55, 1))
    weights = np.repeat(np.eye(55), 2, axis=0)
    return {
        "v_template": centre + offset,
        "f": np.asarray([[0, 1, 2], [2, 3, 4]], np.uint32),
        "J_regressor": weights.T / 2,
        "weights": weights,
        "kintree_table": np.zeros((2, 55), np.int64),
        "shapedirs": np.zeros((110, 3, 10)),
    }


def save(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    np.savez(path, **arrays)
    return path


def test_smplx_joints_come_in_our_order(tmp_path: Path):
    body = load_body(save(tmp_path / "SMPLX_NEUTRAL.npz", smplx_arrays()))
    assert body.name == "SMPLX_NEUTRAL"
    torch.testing.assert_close(body.rest_joints, load_body().rest_joints)
    assert "SMPL-X" in body.credit


def test_smplx_jaw_and_eyes_move_with_the_head(tmp_path: Path):
    body = load_body(save(tmp_path / "body.npz", smplx_arrays()))
    jaw = 2 * SMPLX_JOINTS.index("jaw")
    assert body.skin_joints[jaw : jaw + 6, 0].tolist() == [joint("head")] * 6
    torch.testing.assert_close(body.skin_weights.sum(dim=1), torch.ones(110))
    joints, R = full_kinematics(
        body, body.rest_joints[0], torch.eye(3).expand(22, 3, 3), torch.eye(3).expand(30, 3, 3)
    )
    torch.testing.assert_close(skin(body, joints, R), body.vertices, atol=1e-6, rtol=0)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(AssetError, match="not there") as caught:
        load_body(tmp_path / "nowhere.npz")
    assert caught.value.code == "body-missing"
    assert "nowhere.npz" in caught.value.where
    assert caught.value.fix


@pytest.mark.parametrize("content", [b"", b"not an archive", b"PK\x03\x04 cut off"])
def test_a_damaged_file_is_named(tmp_path: Path, content: bytes):
    path = tmp_path / "body.npz"
    path.write_bytes(content)
    with pytest.raises(AssetError) as caught:
        load_body(path)
    assert caught.value.code == "body-damaged"


def test_a_truncated_archive_is_named(tmp_path: Path):
    path = save(tmp_path / "body.npz", smplx_arrays())
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(AssetError):
        load_body(path)


def test_a_bare_array_and_pickled_objects_are_refused(tmp_path: Path):
    bare = tmp_path / "bare.npz"
    with bare.open("wb") as file:
        np.save(file, np.zeros(3))
    pickled = smplx_arrays() | {"weights": np.array([{"a": 1}], dtype=object)}
    for path in (bare, save(tmp_path / "pickled.npz", pickled)):
        with pytest.raises(AssetError) as caught:
            load_body(path)
        assert caught.value.code == "body-damaged"


def test_a_lacking_array_is_named(tmp_path: Path):
    arrays = smplx_arrays()
    del arrays["J_regressor"]
    with pytest.raises(AssetError, match="J_regressor") as caught:
        load_body(save(tmp_path / "body.npz", arrays))
    assert caught.value.code == "body-incomplete"


def test_another_body_model_is_refused(tmp_path: Path):
    arrays = smplx_arrays()
    arrays["weights"] = arrays["weights"][:, :24]
    with pytest.raises(AssetError, match="weights") as caught:
        load_body(save(tmp_path / "smpl.npz", arrays))
    assert caught.value.code == "body-not-smplx"


def test_faces_beyond_the_vertices_are_refused(tmp_path: Path):
    arrays = smplx_arrays()
    arrays["f"][0, 0] = 4000
    with pytest.raises(AssetError) as caught:
        load_body(save(tmp_path / "body.npz", arrays))
    assert caught.value.code == "body-damaged"
