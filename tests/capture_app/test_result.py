"""motion.npz and manifest.json: what is written is what is read."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_app.manifest import (
    BodyRecord,
    FloorRecord,
    Input,
    Manifest,
    Segment,
    read_manifest,
    sha256,
    write_manifest,
)
from capture_app.result import JOINT_NAMES, load_motion, load_result, save_corrected, save_motion
from omomo_core.errors import InputError
from omomo_core.generation.person import Person
from omomo_core.geometry.rotations import matrix_from_xyzw, xyzw_from_matrix
from omomo_core.motion import HumanMotion, ObjectMotion

SHAPES = {
    "fps": (),
    "chosen": (),
    "body": (),
    "joint_names": (24,),
    "rotation_names": (22,),
    "finger_names": (30,),
    "grip_names": (7,),
    "root": (3, 40, 3),
    "rotations_xyzw": (3, 40, 22, 4),
    "fingers_xyzw": (3, 40, 30, 4),
    "joints": (3, 40, 24, 3),
    "hand_contact": (3, 40, 2),
    "foot_contact": (3, 40, 4),
    "palm_miss": (3, 40, 2),
    "inside": (3, 40),
    "contact_spans": (3, 4),
    "contact_anchors": (3, 3),
    "object_position": (40, 3),
    "object_rotation_xyzw": (40, 4),
    "object_vertices": (8, 3),
    "object_faces": (12, 3),
    "object_name": (),
    "valid": (40,),
    "start_time": (),
}


def a_manifest(chosen: int = 1) -> Manifest:
    return Manifest(
        inputs=(Input(role="session", path="take", sha256="0" * 64),),
        options={"seed": 3, "samples": 3, "contact": "segments", "height": None},
        segment=Segment(index=1, count=2, start=30, stop=70),
        floor=FloorRecord(height=-1.2, source="rest"),
        mount_method="identity",
        body=BodyRecord(name="tetra", credit="Nobody, CC0", height=1.7),
        weights={"hands.safetensors": "1" * 64},
        scores=({"total": 2.0}, {"total": 1.0}, {"total": 3.0}),
        chosen=chosen,
        created=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
        notes=("The floor is a guess.",),
        faults=(),
        timings={"read": 0.1},
        files=("motion.npz",),
    )


@pytest.fixture
def saved(tmp_path: Path, people: tuple[Person, ...], object_motion: ObjectMotion) -> Path:
    save_motion(tmp_path / "motion.npz", people, 1, object_motion, "tetra")
    write_manifest(tmp_path / "manifest.json", a_manifest())
    return tmp_path


def test_the_file_is_as_documented(saved: Path) -> None:
    with np.load(saved / "motion.npz", allow_pickle=False) as file:
        assert {key: file[key].shape for key in file.files} == SHAPES
        for key in ("root", "rotations_xyzw", "fingers_xyzw", "joints", "object_position"):
            assert file[key].dtype == np.float32
        assert tuple(file["joint_names"]) == JOINT_NAMES
        assert file["fps"] == 30
        assert str(file["body"]) == "tetra"


def test_every_key_is_in_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs" / "format.md").read_text()
    assert [key for key in SHAPES if f"`{key}`" not in page] == []


def test_a_result_comes_back_as_it_was(
    saved: Path, people: tuple[Person, ...], object_motion: ObjectMotion
) -> None:
    result = load_result(saved)
    assert result.manifest == a_manifest()
    for loaded, person in zip(result.people, people, strict=True):
        for name in HumanMotion.__dataclass_fields__:
            was = getattr(person.human, name)
            np.testing.assert_allclose(getattr(loaded.human, name), was, atol=1e-6)
        np.testing.assert_allclose(loaded.miss, person.miss, atol=1e-6)
        np.testing.assert_allclose(loaded.depth, person.depth, atol=1e-6)
        for read, written in zip(loaded.segments, person.segments, strict=True):
            assert (read.hand, read.start, read.stop) == (written.hand, written.start, written.stop)
            np.testing.assert_allclose(read.anchor, written.anchor, atol=1e-6)
    moved = result.object_motion
    np.testing.assert_allclose(moved.T_world_object, object_motion.T_world_object, atol=1e-6)
    np.testing.assert_allclose(moved.mesh.vertices, object_motion.mesh.vertices, atol=1e-6)
    np.testing.assert_array_equal(moved.mesh.faces, object_motion.mesh.faces)
    np.testing.assert_array_equal(moved.valid, object_motion.valid)
    assert (moved.start_time, moved.mesh.name) == (object_motion.start_time, "box")


def test_the_same_motion_gives_the_same_bytes(
    saved: Path, people: tuple[Person, ...], object_motion: ObjectMotion
) -> None:
    save_motion(saved / "again.npz", people, 1, object_motion, "tetra")
    assert (saved / "again.npz").read_bytes() == (saved / "motion.npz").read_bytes()


def test_what_a_correction_leaves_keeps_its_numbers(saved: Path) -> None:
    before = load_result(saved)
    person = before.people[1]
    rotations = person.human.rotations.copy()
    rotations[10:20] = rotations[10:20].swapaxes(-1, -2)
    human = replace(person.human, rotations=rotations)
    save_corrected(saved / "new.npz", before, 1, replace(person, human=human, segments=()))
    with np.load(saved / "motion.npz") as old, np.load(saved / "new.npz") as new:
        same = np.abs(new["rotations_xyzw"][0]) == np.abs(old["rotations_xyzw"][1])
        kept = np.delete(np.arange(40), range(10, 20))
        assert same[kept].all()
        assert not same[10:20].all()
        for key in ("root", "joints", "fingers_xyzw", "palm_miss", "inside"):
            np.testing.assert_array_equal(new[key][0], old[key][1])
        for key in ("object_position", "object_rotation_xyzw", "object_vertices", "body"):
            np.testing.assert_array_equal(new[key], old[key])
        q = new["rotations_xyzw"][0]
        assert (np.sum(q[1:] * q[:-1], axis=-1)[20:] > 0).all()
        assert new["chosen"] == 0
        assert new["contact_spans"].shape == (0, 4)
    people, _ = load_motion(saved / "new.npz")
    np.testing.assert_array_equal(people[0].human.rotations[kept], person.human.rotations[kept])


@pytest.mark.parametrize(
    ("damage", "code"),
    [
        (lambda f: (f / "motion.npz").unlink(), "result-missing"),
        (lambda f: (f / "manifest.json").unlink(), "result-missing"),
        (lambda f: (f / "manifest.json").write_text("{"), "manifest-invalid"),
        (lambda f: (f / "manifest.json").write_text('{"format_version": 1}'), "manifest-invalid"),
        (lambda f: (f / "motion.npz").write_bytes(b"PK\3\4 and nothing"), "result-damaged"),
        (lambda f: np.savez(f / "motion.npz", root=np.zeros((1, 2, 3))), "result-damaged"),
        (lambda f: write_manifest(f / "manifest.json", a_manifest(7)), "result-damaged"),
    ],
)
def test_a_damaged_result_is_named(saved: Path, damage: object, code: str) -> None:
    damage(saved)  # type: ignore[operator]
    with pytest.raises(InputError) as caught:
        load_result(saved)
    assert caught.value.code == code
    assert caught.value.fix


@given(cut=st.integers(0, 4000), flip=st.integers(0, 4000))
def test_no_damage_to_the_numbers_passes_as_another_error(
    tmp_path_factory: pytest.TempPathFactory, cut: int, flip: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "small.npz"
    np.savez_compressed(path, root=np.zeros((1, 4, 3), np.float32), valid=np.ones(4, bool))
    data = bytearray(path.read_bytes())
    data[flip % len(data)] ^= 0xFF
    path.write_bytes(data[: len(data) - cut % len(data)])
    with pytest.raises(InputError):
        load_motion(path)


def test_manifest_is_plain_json_and_round_trips(tmp_path: Path) -> None:
    manifest = a_manifest()
    write_manifest(tmp_path / "m.json", manifest)
    assert read_manifest(tmp_path / "m.json") == manifest
    assert manifest.versions.omocap
    assert manifest.created.tzinfo is not None


def test_hash_of_a_folder_depends_on_names_and_bytes(tmp_path: Path) -> None:
    folder = tmp_path / "session"
    (folder / "sub").mkdir(parents=True)
    (folder / "sub" / "a.txt").write_text("a")
    first = sha256(folder)
    assert first == sha256(folder)
    (folder / "sub" / "a.txt").rename(folder / "sub" / "b.txt")
    renamed = sha256(folder)
    (folder / "sub" / "b.txt").write_text("b")
    assert len({first, renamed, sha256(folder)}) == 3


@given(seed=st.integers(0, 2**32 - 1))
def test_quaternions_keep_the_rotation_and_never_flip(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=(5, 3))
    turns = Rotation.from_rotvec((axis * np.linspace(0, 6, 60)[:, None, None]).reshape(-1, 3))
    R = turns.as_matrix().reshape(60, 5, 3, 3)
    q = xyzw_from_matrix(R)
    np.testing.assert_allclose(matrix_from_xyzw(q), R, atol=1e-9)
    assert (np.sum(q[1:] * q[:-1], axis=-1) > 0).all()
    assert (q[0, :, 3] >= 0).all()
