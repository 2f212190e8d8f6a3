"""CORE4D: people keep their hands on the object, and only what their own hands do is kept."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.recordings.core4d import core4d_clips, is_core4d
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.recordings.smpl import world_rotations
from omomo_core.skeleton import joint
from tests.core.core4d_files import SIZE, carrying, write_take
from tests.core.rig_files import stepping


def test_a_take_becomes_a_clip_of_the_person_who_carries(tmp_path: Path) -> None:
    write_take(tmp_path)
    dropped = Counter[str]()
    (clip,) = build_mocap(tmp_path, load_body(), dropped=dropped)
    assert dropped == {"no-contact": 1}, "the other person's hands are off the box"
    assert clip.name == "20231002_004_person1_box"
    assert (clip.source, clip.licence[:9]) == ("core4d", "CC BY 4.0")
    assert clip.object_motion is not None
    assert len(clip.root) == 239, "15 frames a second became 30"
    assert clip.hand_contact[:, 0].mean() > 0.95
    assert clip.hand_contact[:, 1].mean() < 0.05
    extent = np.ptp(clip.object_motion.mesh.vertices, axis=0)
    np.testing.assert_allclose(extent, np.array([0.3, 0.1, 0.3]) / SIZE, rtol=0.01)
    joints = joints_of(load_body(), clip.root, clip.rotations)
    local = to_local(clip.object_motion.T_world_object, joints[:, 22:23])[::2, 0]
    np.testing.assert_allclose(local, np.tile([0.0, 0.07, 0.0], (120, 1)), atol=0.01)


def test_the_person_walks_as_they_did_on_the_floor(tmp_path: Path) -> None:
    (clip,) = core4d_clips(write_take(tmp_path), load_body())
    root, pose = stepping()
    R = world_rotations(pose)
    assert np.linalg.norm(clip.root[::2] - root, axis=-1).max() < 0.04
    for name in ("pelvis", "spine3", "left_hip"):
        j = joint(name)
        cosine = (np.einsum("tij,tij->t", clip.rotations[::2, j], R[:, j]) - 1) / 2
        assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 12, name


def nan_at(frame: int) -> np.ndarray:
    T = carrying()[1]
    T[frame] = np.nan
    return T


@pytest.mark.parametrize(
    ("changes", "code", "words"),
    [
        ({"joints": None}, "core4d-format", "'joints' is missing"),
        ({"body_pose": np.zeros((7, 21, 3))}, "core4d-format", "'body_pose' has another length"),
        ({"poses": np.eye(4)[None]}, "core4d-format", "1 of the object"),
        ({"poses": np.zeros((120, 4, 4))}, "core4d-format", "no rotations"),
        ({"poses": nan_at(9)}, "mocap-not-finite", "frame 9"),
        ({"global_orient": np.full((120, 3), np.inf)}, "mocap-not-finite", "frame 0"),
        ({"joints": carrying()[0]["joints"] * 100}, "mocap-units", "m tall"),
        ({"betas": Path("/etc/passwd")}, "pickle-refused", "pathlib"),
    ],
)
def test_odd_takes_are_named(
    tmp_path: Path, changes: dict[str, Any], code: str, words: str
) -> None:
    path = write_take(tmp_path, **changes)
    assert is_core4d(path)
    with pytest.raises(InputError, match=words) as caught:
        list(core4d_clips(path, load_body()))
    assert caught.value.code == code


def test_a_missing_mesh_is_named(tmp_path: Path) -> None:
    path = write_take(tmp_path)
    (tmp_path / "object_models/box/box007_m.obj").unlink()
    with pytest.raises(InputError, match=r"box007_m\.obj") as caught:
        list(core4d_clips(path, load_body()))
    assert caught.value.code == "core4d-mesh"


def test_a_file_that_is_cut_short_is_named(tmp_path: Path) -> None:
    path = write_take(tmp_path)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(InputError) as caught:
        list(core4d_clips(path, load_body()))
    assert caught.value.code == "pickle-damaged"
