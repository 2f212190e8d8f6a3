"""Reading recorded clips: what is read is true, what cannot be used is named."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import MODEL_REST, forward_kinematics, rest_offsets
from omomo_core.body.model import BodyModel, load_body, with_height
from omomo_core.errors import InputError
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.person import Retargeting
from omomo_core.learning.evaluation.real_clips import (
    AXES,
    NAMES,
    THICKEST_SOLE,
    THINNEST_SOLE,
    body_of,
    clip_paths,
    read_clip,
)

BODY = load_body()
NAME = "sub1_box_001"
HIPS, KNEES, ANKLES, TOES = [1, 2], [4, 5], [7, 8], [10, 11]


def arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        return dict(file)


def test_a_clip_of_our_own_body_gives_it_back(tmp_path: Path, write_clip):
    root, R = write_clip(NAME)
    clip = read_clip(tmp_path / f"{NAME}.npz", BODY)
    np.testing.assert_allclose(clip.rotations, R, atol=1e-5)
    np.testing.assert_allclose(clip.root, root, atol=1e-6)
    bones = (clip.body.rest_joints[:22] - BODY.rest_joints[:22]).diff(dim=0)
    assert bones.abs().max() < 1e-4
    assert clip.body.height == pytest.approx(BODY.height, abs=1e-3)
    assert clip.motion.mesh.name == "box"
    assert clip.text == "Carry the box."


def test_the_order_of_the_joints_in_the_file_is_of_no_account(tmp_path: Path, write_clip):
    write_clip(NAME)
    path = tmp_path / f"{NAME}.npz"
    before = read_clip(path, BODY)
    data = arrays(path)
    order = np.random.default_rng(0).permutation(22)
    for key in ("joint_names", "joints", "joint_rot_global_xyzw"):
        data[key] = data[key][order] if key == "joint_names" else data[key][:, order]
    np.savez(path, **data)
    np.testing.assert_allclose(read_clip(path, BODY).joints, before.joints)


def spoil(change: Callable[[dict[str, np.ndarray]], object]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        data = arrays(path)
        change(data)
        np.savez(path, **data)

    return apply


def nan(data: dict[str, np.ndarray]) -> None:
    data["palms"] = data["palms"].copy()
    data["palms"][3, 0, 0] = np.nan


def stretch(data: dict[str, np.ndarray]) -> None:
    data["joints"] = data["joints"].copy()
    data["joints"][5:9, NAMES.index("L_Knee")] += 0.3


BAD = {
    "clip-keys": spoil(lambda d: d.pop("palms")),
    "clip-empty": spoil(lambda d: d.update({k: v[:0] for k, v in d.items() if v.ndim > 1})),
    "clip-shape": spoil(lambda d: d.update(obj_pos=d["obj_pos"][:-1])),
    "clip-not-finite": spoil(nan),
    "clip-convention": spoil(lambda d: d.update(fps=np.array(60))),
    "clip-skeleton": spoil(lambda d: d.update(joint_names=np.array([f"b{i}" for i in range(22)]))),
    "clip-rotations": spoil(lambda d: d.update(obj_rot_xyzw=2 * d["obj_rot_xyzw"])),
    "clip-bones": spoil(stretch),
    "clip-units": spoil(
        lambda d: d.update({k: 100 * d[k] for k in ("joints", "palms", "obj_pos")})
    ),
    "clip-unreadable": lambda path: path.write_bytes(b"PK\x03\x04 not a zip"),
    "clip-mesh": lambda path: (path.parent / "meshes" / "box.npz").unlink(),
}


@pytest.mark.parametrize("code", BAD)
def test_bad_clips_are_named(tmp_path: Path, write_clip, code: str):
    write_clip(NAME)
    path = tmp_path / f"{NAME}.npz"
    BAD[code](path)
    with pytest.raises(InputError) as caught:
        read_clip(path, BODY)
    assert caught.value.code == code
    assert caught.value.where
    assert caught.value.fix


def test_a_stretched_bone_and_a_rotation_that_is_off_are_told_apart(tmp_path: Path, write_clip):
    write_clip(NAME)
    path = tmp_path / f"{NAME}.npz"
    whole = arrays(path)

    def told(change: Callable[[dict[str, np.ndarray]], object]) -> str:
        np.savez(path, **whole)
        spoil(change)(path)
        with pytest.raises(InputError) as caught:
            read_clip(path, BODY)
        return caught.value.what

    longer = told(stretch)
    assert "The bone to L_" in longer
    assert "longer or shorter in frame" in longer

    def turn(data: dict[str, np.ndarray]) -> None:
        quaternions = data["joint_rot_global_xyzw"].copy()
        knee = NAMES.index("L_Knee")
        turned = Rotation.from_quat(quaternions[7, knee]) * Rotation.from_rotvec([0, 0.3, 0])
        quaternions[7, knee] = turned.as_quat()
        data["joint_rot_global_xyzw"] = quaternions

    off = told(turn)
    assert "in frame 7 L_Ankle is" in off
    assert "the rotation of L_Knee" in off
    assert "keeps its length" in off


def test_a_mesh_in_other_units_or_with_missing_vertices_is_named(tmp_path: Path, write_clip):
    write_clip(NAME)
    mesh, path = tmp_path / "meshes" / "box.npz", tmp_path / f"{NAME}.npz"
    data = arrays(mesh)
    for change, code in (
        ({"vertices": data["vertices"] * 1000}, "clip-units"),
        ({"faces": data["faces"] + 5}, "clip-mesh"),
        ({"faces": data["faces"][:0]}, "clip-mesh"),
    ):
        np.savez(mesh, **{**data, **change})
        with pytest.raises(InputError) as caught:
            read_clip(path, BODY)
        assert caught.value.code == code


def test_a_folder_without_clips_is_refused(tmp_path: Path):
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(InputError, match="no-clips"):
            clip_paths(folder)


def test_another_stature_is_the_same_pose_scaled():
    fit = Retargeting(BODY, with_height(BODY, 1.9))
    root, R = torch.tensor([[0.3, -2.0, 0.8]]), torch.eye(3).expand(1, 22, 3, 3)
    moved, same = fit.to_body(root, R)
    torch.testing.assert_close(moved, root / fit.scale)
    assert same is R
    torch.testing.assert_close(fit.to_trained(moved, R)[0], root)


def in_shoes(sole: float) -> BodyModel:
    """Our body as it is read from a clip of its own in which toes stand too high by this much, metres."""
    joints = BODY.rest_joints[list(MODEL_REST)].double().numpy()[:, [2, 0, 1]]
    standing = np.tile(joints + np.array([0.0, 0.0, sole]), (30, 1, 1))
    return body_of(rest_offsets(BODY) @ AXES.T, BODY, standing)


def test_people_who_were_recorded_in_shoes_stand_on_their_soles():
    body = in_shoes(0.03)
    assert body.shoe_sole == pytest.approx(0.03, abs=1e-4)
    assert body.height == pytest.approx(BODY.height, abs=1e-3)
    assert float(body.vertices[:, 1].min()) == pytest.approx(
        float(BODY.vertices[:, 1].min()), abs=1e-4
    )
    raised = body.rest_joints[:22, 1] - BODY.rest_joints[:22, 1]
    np.testing.assert_allclose(raised, 0.03, atol=1e-3)
    # The skin above the feet moves with the joints.
    knee = BODY.vertices[:, 1] > 0.4
    np.testing.assert_allclose((body.vertices - BODY.vertices)[knee, 1], 0.03, atol=2e-3)


def test_their_whole_soles_are_on_the_floor_though_their_toe_joints_lie_lower():
    theirs = rest_offsets(BODY)
    theirs[TOES, 1] -= 0.02
    standing = np.full((30, 24, 3), 0.05)
    body = body_of(theirs @ AXES.T, BODY, standing)
    np.testing.assert_allclose(body.rest_joints[TOES, 1], 0.05, atol=0.002)
    soles = BODY.vertices[:, 1] < 0.003
    assert float(body.vertices[soles, 1].abs().max()) < 0.01


@pytest.mark.parametrize(("found", "sole"), [(0.4, THICKEST_SOLE), (-0.06, THINNEST_SOLE)])
def test_a_floor_that_was_found_wrongly_does_not_put_people_on_stilts(found: float, sole: float):
    assert in_shoes(found).shoe_sole == pytest.approx(sole, abs=1e-6)


def test_a_pose_in_shoes_is_the_same_pose_higher_by_the_soles():
    fit = Retargeting(BODY, in_shoes(0.03))
    R = torch.eye(3).expand(1, 22, 3, 3)[..., [2, 0, 1], :]
    root = torch.tensor([[0.3, -2.0, 0.8]])
    moved, turned = fit.to_body(root, R)
    torch.testing.assert_close(moved, root + torch.tensor([0.0, 0.0, 0.03]), atol=1e-3, rtol=0)
    torch.testing.assert_close(turned, R, atol=1e-3, rtol=0)
    torch.testing.assert_close(fit.to_trained(moved, turned)[0], root, atol=1e-5, rtol=0)


def test_somebody_in_shoes_sees_the_object_lower_by_the_soles(tmp_path: Path, write_clip):
    write_clip(NAME)
    motion = read_clip(tmp_path / f"{NAME}.npz", BODY).motion
    clip = ObjectModel(motion.mesh, 0.9, 0.03).clip(motion.T_world_object)
    np.testing.assert_allclose(
        clip.trained.centre, 0.9 * clip.above_soles(clip.take.centre), atol=1e-6
    )
    np.testing.assert_allclose(clip.trained.lowest, 0.9 * (clip.take.lowest - 0.03), atol=1e-6)
    np.testing.assert_allclose(clip.in_world(clip.trained.centre), clip.take.centre, atol=1e-6)


def test_a_real_persons_bones_give_their_joints_back(shared: Path):
    clip = read_clip(clip_paths(shared / "data" / "omomo_clips")[0], BODY)
    root, R = torch.from_numpy(clip.root), torch.from_numpy(clip.rotations)
    joints = forward_kinematics(clip.body, root, R).numpy()
    np.testing.assert_allclose(joints, clip.joints, atol=1e-5)
    assert 1.4 < clip.body.height < 2.1
    assert abs(float(clip.body.vertices[:, 1].min())) < 0.02
    # The pelvis' y axis is up while they stand.
    assert clip.rotations[:, 0, 2, 1].mean() > 0.7


def test_a_real_person_on_our_bones_and_back_stands_where_they_stood(shared: Path):
    clip = read_clip(clip_paths(shared / "data" / "omomo_clips")[0], BODY)
    fit, root, R = (
        Retargeting(BODY, clip.body),
        torch.from_numpy(clip.root),
        torch.from_numpy(clip.rotations),
    )
    ours = fit.to_trained(root, R)
    feet = forward_kinematics(BODY, *ours)[:, ANKLES, :2] / fit.scale
    np.testing.assert_allclose(feet, clip.joints[:, ANKLES, :2], atol=0.003)
    there = fit.to_body(*ours)
    np.testing.assert_allclose(there[0], clip.root, atol=1e-6)
    joints = forward_kinematics(clip.body, *there).numpy()
    others = np.delete(np.arange(24), KNEES)
    np.testing.assert_allclose(joints[:, others], clip.joints[:, others], atol=0.005)
    np.testing.assert_allclose(joints[:, KNEES], clip.joints[:, KNEES], atol=0.015)
    # Their hip joints lie closer together than ours, their feet need not.
    narrow = np.linalg.norm(np.diff(joints[:, HIPS], axis=1), axis=-1).mean()
    wide = np.linalg.norm(
        np.diff(forward_kinematics(BODY, *ours)[:, HIPS].numpy(), axis=1), axis=-1
    )
    assert narrow < 0.7 * wide.mean()
