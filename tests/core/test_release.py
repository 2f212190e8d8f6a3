"""The OMOMO release's files: read without running them; hands stay where they were on the object."""

import gzip
import pickle
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.load import load_body
from omomo_core.data.clips import Clip
from omomo_core.data.joblib_file import read_joblib
from omomo_core.data.release import release_clips
from omomo_core.data.release_objects import thinned
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh
from omomo_core.skeleton import MODEL_PARENTS, PALM_JOINTS
from tests.core.rig_files import stepping

SIZE, TRANS2JOINT = 1.05, np.array([-0.0014, 0.3947, -0.0132])


class NumpyArrayWrapper:
    """What joblib pickles in place of an array; the bytes follow in the stream."""

    def __init__(self, array: np.ndarray, *, padded: bool) -> None:
        self.subclass, self.shape, self.dtype = np.ndarray, array.shape, array.dtype
        self.order, self.allow_mmap = "C", True
        if padded:
            self.numpy_array_alignment_bytes = 16


NumpyArrayWrapper.__module__ = "joblib.numpy_pickle"


class JoblibPickler(pickle._Pickler):  # pyright: ignore[reportPrivateUsage]
    """Writes as joblib.dump does (its class names are not importable here, hence save_global)."""

    padded = True

    def save(self, obj: Any, save_persistent_id: bool = True) -> None:
        if not isinstance(obj, np.ndarray):
            super().save(obj, save_persistent_id)
            return
        super().save(NumpyArrayWrapper(obj, padded=self.padded))
        self.framer.commit_frame(force=True)
        if self.padded:
            gap = 16 - (self._file.tell() + 1) % 16
            self._file.write(bytes([gap]) + b"\xff" * gap)
        self._file.write(obj.tobytes())

    def save_global(self, obj: Any, name: str | None = None) -> None:
        if obj is NumpyArrayWrapper:
            self.save("joblib.numpy_pickle")
            self.save("NumpyArrayWrapper")
            self.write(pickle.STACK_GLOBAL)
            self.memoize(obj)
        else:
            super().save_global(obj, name)

    dispatch = {**pickle._Pickler.dispatch, type: save_global}  # noqa: RUF012


def dump(path: Path, content: object, *, padded: bool = True) -> Path:
    with path.open("wb") as file:
        pickler = JoblibPickler(file, protocol=4)
        pickler.padded, pickler._file = padded, file  # pyright: ignore
        pickler.dump(content)
    return path


def sequence(name: str = "sub3_largebox_001", frames: int = 120) -> dict[str, Any]:
    """Somebody 5 % larger than we walks with a box between the hands."""
    body = load_body()
    root, pose = stepping(frames)
    rest = body.rest_joints.double().numpy()
    at = np.concatenate([rest[:22], rest[list(PALM_JOINTS)]]) * SIZE
    offsets = at - at[[max(p, 0) for p in MODEL_PARENTS]]
    R = Rotation.from_rotvec(pose[:, 0]).as_matrix()
    middle = root * SIZE + R @ np.array([0.0, 0.1, 0.4])
    return {
        "seq_name": name,
        "betas": np.zeros((1, 16)),
        "gender": np.str_("male"),
        "trans": root * SIZE + TRANS2JOINT,
        "root_orient": pose[:, 0],
        "pose_body": pose[:, 1:].reshape(frames, 63),
        "rest_offsets": offsets,
        "trans2joint": TRANS2JOINT,
        "obj_trans": middle[:, :, None],
        "obj_rot": R,
        "obj_scale": np.full(frames, 0.01),
        "obj_com_pos": middle,
    }


@pytest.fixture
def release(tmp_path: Path) -> Path:
    (tmp_path / "captured_objects").mkdir()
    box = trimesh.creation.box((30, 30, 30)).subdivide().subdivide()
    box.export(tmp_path / "captured_objects" / "largebox_cleaned_simplified.obj")
    return tmp_path


def test_a_sequence_becomes_a_clip_of_our_size(release: Path) -> None:
    dump(release / "train.p", {0: sequence()})
    (clip,) = release_clips(release / "train.p", load_body())
    assert isinstance(clip, Clip)
    assert clip.object_motion is not None
    root, pose = stepping()
    np.testing.assert_allclose(np.linalg.det(clip.rotations), 1, atol=1e-4)
    assert np.linalg.norm(clip.root[:, :2] - root[:, :2], axis=-1).max() < 0.03
    extent = np.ptp(clip.object_motion.mesh.vertices, axis=0)
    np.testing.assert_allclose(extent, 0.3 / SIZE, rtol=0.01)
    want = Rotation.from_rotvec(pose[:, 0]).as_matrix() @ [0, 0.1, 0.4]
    box = clip.object_motion.T_world_object[:, :3, 3]
    # The palms are where the release's are, seen from the object, as in the unscaled scene.
    np.testing.assert_allclose(box - root, want / SIZE, atol=0.01)
    original = joints_of(load_body(), root, _global(pose))[:, 22:]
    palms = joints_of(load_body(), clip.root, clip.rotations)[:, 22:]
    assert np.linalg.norm(palms - original, axis=-1).max() < 0.02


def _global(pose: np.ndarray) -> np.ndarray:
    from omomo_core.data.smpl import world_rotations

    return world_rotations(pose)


def test_bad_sequences_are_named_and_the_rest_is_kept(release: Path) -> None:
    nan, short, inches, lost = (sequence() for _ in range(4))
    nan["obj_trans"] = np.where(np.arange(120)[:, None, None] == 7, np.nan, nan["obj_trans"])
    short |= {k: v[:5] for k, v in short.items() if np.ndim(v) and len(v) == 120}
    inches["rest_offsets"] = inches["rest_offsets"] / 0.0254
    lost["seq_name"] = "sub3_teapot_002"
    missing = sequence()
    del missing["obj_rot"]
    dump(release / "t.p", dict(enumerate([sequence(), nan, short, inches, lost, missing])))
    found = list(release_clips(release / "t.p", load_body()))
    assert [f.code if isinstance(f, InputError) else "ok" for f in found] == [
        "ok", "mocap-not-finite", "mocap-empty", "mocap-units", "release-mesh", "release-format",
    ]  # fmt: skip


def test_all_ways_of_writing_give_the_same(tmp_path: Path) -> None:
    content = {0: {"seq_name": "a_b", "trans": np.arange(6.0).reshape(2, 3), "n": np.float64(2)}}
    new = dump(tmp_path / "new.p", content)
    files = [new, dump(tmp_path / "old.p", content, padded=False)]
    for name, pack in (("z", zlib.compress), ("gz", gzip.compress)):
        files.append(tmp_path / f"{name}.p")
        files[-1].write_bytes(pack(new.read_bytes()))
    for protocol in (2, 4):
        files.append(tmp_path / f"plain{protocol}.p")
        files[-1].write_bytes(pickle.dumps(content, protocol))
    for file in files:
        found = read_joblib(file)
        np.testing.assert_array_equal(found[0]["trans"], content[0]["trans"])
        assert found[0]["n"] == 2, file


class Evil:
    def __reduce__(self) -> tuple[Any, ...]:
        return (print, ("owned",))


def test_code_is_never_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "evil.p").write_bytes(pickle.dumps({0: Evil()}))
    with pytest.raises(InputError) as caught:
        read_joblib(tmp_path / "evil.p")
    assert caught.value.code == "pickle-refused"
    assert "owned" not in capsys.readouterr().out


def test_damaged_files_are_named(tmp_path: Path) -> None:
    whole = dump(tmp_path / "a.p", {0: {"seq_name": "a_b", "trans": np.zeros((9, 3))}}).read_bytes()
    for bad in (
        b"",
        b"text",
        whole[:-40],
        zlib.compress(whole)[:-20],
        b"\x80\x04N.",
        b"\x1f\x8bxx",
    ):
        (tmp_path / "bad.p").write_bytes(bad)
        (tmp_path / "captured_objects").mkdir(exist_ok=True)
        with pytest.raises(InputError):
            list(release_clips(tmp_path / "bad.p", load_body()))


def test_thinning_keeps_the_shape() -> None:
    ball = trimesh.creation.icosphere(5, 2.0)
    thin = thinned(ObjectMesh(np.array(ball.vertices), np.array(ball.faces), "ball"))
    assert len(thin.vertices) <= 2000
    assert trimesh.Trimesh(thin.vertices, thin.faces).area == pytest.approx(ball.area, rel=0.05)
