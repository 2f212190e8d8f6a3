"""The OMOMO release's files: read without running them; hands stay where they were on the object."""

import gzip
import pickle
import zlib
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.joblib_file import read_joblib
from omomo_core.learning.recordings.omomo_release import release_clips, thinned
from omomo_core.motion import ObjectMesh
from tests.core.release_files import SIZE, dump, make_up, sequence
from tests.core.rig_files import stepping


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
    from omomo_core.learning.recordings.smpl import world_rotations

    return world_rotations(pose)


def spoilt(**changes: Any) -> dict[str, Any]:
    """A sequence with other values; None takes one out."""
    entry = {**sequence(), **changes}
    return {key: value for key, value in entry.items() if value is not None}


def bad_at(key: str, frame: int, value: float) -> np.ndarray:
    channel = np.array(sequence()[key], float)
    channel[frame] = value
    return channel


BAD = {
    "not-finite": (spoilt(obj_trans=bad_at("obj_trans", 7, np.nan)), "mocap-not-finite", "frame 7"),
    "short": (sequence(frames=20), "mocap-empty", "0.8 s"),
    "inches": (spoilt(rest_offsets=sequence()["rest_offsets"] / 0.0254), "mocap-units", ""),
    "unknown": (spoilt(seq_name="sub3_teapot_002"), "release-mesh", "teapot"),
    "sheared": (spoilt(obj_rot=bad_at("obj_rot", 9, 0.5)), "release-format", "'obj_rot', frame 9"),
    "flat": (spoilt(obj_scale=bad_at("obj_scale", 3, 0.0)), "release-format", "'obj_scale', frame 3"),
    "ragged": (spoilt(pose_body=sequence()["pose_body"][:-1]), "release-format", "'pose_body'"),
} | {
    key: (spoilt(**{key: None}), "release-format", f"'{key}'")
    for key in ("trans", "root_orient", "pose_body", "rest_offsets", "trans2joint", "obj_trans",
                "obj_rot", "obj_scale")
}  # fmt: skip


def test_bad_sequences_are_named_and_the_rest_is_kept(release: Path) -> None:
    dump(release / "t.p", dict(enumerate([sequence(), *(entry for entry, _, _ in BAD.values())])))
    first, *rest = release_clips(release / "t.p", load_body())
    assert isinstance(first, Clip)
    for problem, (entry, code, said) in zip(rest, BAD.values(), strict=True):
        assert isinstance(problem, InputError)
        assert problem.code == code
        assert said in str(problem)
        assert str(release) in problem.where
        assert entry["seq_name"] in problem.where or code == "release-mesh"


@pytest.mark.parametrize("key", ["obj_bottom_rot", "obj_bottom_trans", "obj_bottom_scale"])
def test_a_mop_without_its_lower_part_is_refused(tmp_path: Path, key: str) -> None:
    entry = make_up(np.random.default_rng(0), "sub2_mop_001", tmp_path).entry
    del entry[key]
    dump(tmp_path / "t.p", {0: entry})
    (problem,) = release_clips(tmp_path / "t.p", load_body())
    assert isinstance(problem, InputError)
    assert f"'{key}' is missing" in problem.what


def names(path: Path, *, object_split: bool) -> tuple[list[str], dict[str, list[str]]]:
    """Names that are read, and names that are not, by the reason."""
    kept: list[str] = []
    refused: dict[str, list[str]] = {}
    for found in release_clips(path, load_body(), object_split=object_split):
        if isinstance(found, InputError):
            refused.setdefault(found.code, []).append(found.where.split(", ")[-1])
        else:
            kept.append(found.name)
    return kept, refused


@pytest.mark.parametrize("object_split", [False, True])
def test_held_out_people_and_objects_are_refused_by_name(
    tmp_path: Path, object_split: bool
) -> None:
    rng = np.random.default_rng(1)
    people = (
        "sub1_largebox_1",
        "sub15_tripod_2",
        "sub16_largebox_3",
        "sub17_tripod_4",
        "sub18_monitor_5",
    )
    entries = dict(enumerate(make_up(rng, name, tmp_path).entry for name in people))
    files = {name: dump(tmp_path / f"{name}.p", entries) for name in ("train_x", "test_x", "mine")}
    kept, refused = names(files["train_x"], object_split=object_split)
    assert kept == (["sub1_largebox_1"] if object_split else ["sub1_largebox_1", "sub15_tripod_2"])
    assert refused["release-split"] == ["sub16_largebox_3", "sub17_tripod_4", "sub18_monitor_5"]
    assert refused.get("object-split", []) == ["sub15_tripod_2"] * object_split
    kept, refused = names(files["test_x"], object_split=object_split)
    assert kept == (["sub17_tripod_4"] if object_split else ["sub16_largebox_3", "sub17_tripod_4"])
    assert refused["release-split"] == ["sub1_largebox_1", "sub15_tripod_2", "sub18_monitor_5"]
    kept, refused = names(files["mine"], object_split=object_split)
    assert kept == (["sub1_largebox_1"] if object_split else list(people))


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
    assert "builtins.print" in caught.value.what
    assert f"{tmp_path / 'evil.p'}, byte " in caught.value.where
    assert "owned" not in capsys.readouterr().out


def test_damaged_files_are_named(tmp_path: Path) -> None:
    whole = dump(tmp_path / "a.p", {0: {"seq_name": "a_b", "trans": np.zeros((9, 3))}}).read_bytes()
    (tmp_path / "captured_objects").mkdir()
    cut, packed = whole[:-40], zlib.compress(whole)[:-20]
    for bad in (
        b"",
        b"text",
        cut,
        packed,
        b"\x80\x04N.",
        b"\x1f\x8bxx",
        pickle.dumps({0: {"a": 1}}),
    ):
        (tmp_path / "bad.p").write_bytes(bad)
        with pytest.raises(InputError) as caught:
            list(release_clips(tmp_path / "bad.p", load_body()))
        assert str(tmp_path / "bad.p") in caught.value.where
        if bad == cut:
            assert caught.value.what.endswith("it ends in the middle.")
            assert caught.value.where.endswith(f"byte {len(cut)}")


@settings(max_examples=30)
@given(st.integers(0, 10**6))
def test_a_file_cut_or_changed_anywhere_is_an_error_or_data(seed: int) -> None:
    rng = np.random.default_rng(seed)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "t.p"
        content = {0: {"seq_name": "a_b", "trans": np.zeros((9, 3))}}
        data = bytearray(dump(path, content).read_bytes())
        if rng.random() < 0.5:
            data = data[: rng.integers(len(data))]
        else:
            data[rng.integers(len(data))] = rng.integers(256)
        path.write_bytes(data)
        # Nothing but our own error may come of it.
        with suppress(InputError):
            read_joblib(path)


def test_thinning_keeps_the_shape() -> None:
    ball = trimesh.creation.icosphere(5, 2.0)
    thin = thinned(ObjectMesh(np.array(ball.vertices), np.array(ball.faces), "ball"))
    assert len(thin.vertices) <= 2000
    assert trimesh.Trimesh(thin.vertices, thin.faces).area == pytest.approx(ball.area, rel=0.05)
