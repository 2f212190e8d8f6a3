"""Recordings: bad ones are refused by name, the others of a folder are read all the same."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.mocap import (
    METRES_PER_BVH_UNIT,
    SourceMotion,
    is_share_alike,
    leg_length,
    read_bvh_motion,
    read_mocap_npz,
)
from omomo_core.learning.recordings.recordings import motion_files, read_recordings
from omomo_core.learning.recordings.source_skeletons import CMU_JUMP
from omomo_core.motion import FPS

REST = {
    "root": (0, 0.9, 0),
    "chest": (0, 1.15, 0),
    "neck": (0, 1.4, 0),
    **{
        f"{side}_{part}": (0, height, sign * out)
        for side, sign in (("left", -1), ("right", 1))
        for part, height, out in (
            ("hip", 0.9, 0.09),
            ("knee", 0.5, 0.09),
            ("ankle", 0.08, 0.09),
            ("shoulder", 1.38, 0.18),
            ("elbow", 1.1, 0.18),
            ("wrist", 0.85, 0.18),
        )
    },
}
"""A CMU skeleton with 15 joints, standing, facing +x, y up."""


def write_standing(path: Path, *, fps: int = 30, frames: int = 60, **changes: object) -> Path:
    joints = np.tile(np.array(list(REST.values()), float), (frames, 1, 1))
    joints[:, :, 0] += np.linspace(0, 1, frames)[:, None]
    content: dict[str, object] = {
        "joints": joints,
        "joint_rot_global_xyzw": np.tile([0.0, 0, 0, 1], (frames, len(REST), 1)),
        "joint_names": np.array(list(REST)),
        "parents": np.zeros(len(REST), int),
        "fps": fps,
        "up": "y",
        "licence": "free",
    }
    np.savez(path, **(content | changes))  # pyright: ignore[reportArgumentType]
    return path


def test_npz_is_turned_z_up(tmp_path: Path) -> None:
    motion = read_mocap_npz(write_standing(tmp_path / "walk.npz"))
    assert motion.skeleton is CMU_JUMP
    assert motion.name == "walk"
    np.testing.assert_allclose(motion.position("root")[0], [0, 0, 0.9])
    np.testing.assert_allclose(motion.rotation("root")[0] @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    assert leg_length(motion) == pytest.approx(0.82)


@pytest.mark.parametrize("fps", [24, 50, 60, 120])
def test_every_rate_becomes_30_fps_by_time(tmp_path: Path, fps: int) -> None:
    turn = Rotation.from_euler("y", np.linspace(0, 1, 2 * fps + 1)[:, None]).as_quat()
    quats = np.repeat(turn[:, None], len(REST), axis=1)
    path = write_standing(
        tmp_path / "a.npz", fps=fps, frames=2 * fps + 1, joint_rot_global_xyzw=quats
    )
    motion = read_mocap_npz(path)
    assert len(motion.positions) == round(2 * FPS) + 1
    np.testing.assert_allclose(motion.position("root")[:, 0], np.linspace(0, 1, 61), atol=1e-9)
    yaw = np.arctan2(*motion.rotation("root")[:, [1, 0], 0].T)
    np.testing.assert_allclose(yaw, np.linspace(0, 1, 61), atol=1e-9)


@pytest.mark.parametrize(
    ("code", "changes"),
    [
        ("mocap-skeleton", {"joint_names": np.array([f"bone{i}" for i in range(15)])}),
        ("mocap-units", {"joints": np.tile(100 * np.array(list(REST.values())), (60, 1, 1))}),
        ("mocap-empty", {"frames": 3}),
        ("mocap-not-finite", {"joints": np.full((60, 15, 3), np.nan)}),
        ("mocap-not-finite", {"joint_rot_global_xyzw": np.zeros((60, 15, 4))}),
    ],
)
def test_bad_recordings_are_named(tmp_path: Path, code: str, changes: dict[str, object]) -> None:
    path = write_standing(tmp_path / "a.npz", **changes)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError) as caught:
        read_mocap_npz(path)
    assert caught.value.code == code
    assert str(path) in caught.value.where


def test_a_file_without_the_keys_is_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", joints=np.zeros((3, 2, 3)))
    (tmp_path / "b.npz").write_bytes(b"not a zip")
    for name in ("a.npz", "b.npz"):
        with pytest.raises(InputError) as caught:
            read_mocap_npz(tmp_path / name)
        assert caught.value.code == "mocap-file"


def test_bad_files_of_a_folder_are_told_and_the_others_are_read(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    write_standing(tmp_path / "deep" / "good.npz")
    write_standing(tmp_path / "sa.npz", licence="CC BY-SA 3.0")
    write_standing(tmp_path / "short.npz", frames=2)
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n")
    found = [
        each
        for path in motion_files(tmp_path)
        for each in read_recordings(path, load_body(), METRES_PER_BVH_UNIT)
    ]
    motions = [each for each in found if isinstance(each, SourceMotion)]
    assert [m.name for m in motions] == ["good", "sa"]
    assert [is_share_alike(m) for m in motions] == [False, True]
    problems = Counter(each.code for each in found if isinstance(each, InputError))
    assert problems == {"mocap-empty": 1, "bvh-syntax": 1}


def test_an_empty_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        motion_files(tmp_path)
    assert caught.value.code == "mocap-folder"


def test_real_cmu_walk(shared: Path) -> None:
    motion = read_bvh_motion(shared / "data/mocap/cmu_bvh/02/02_01.bvh")
    assert motion.skeleton.name == "cmu_bvh"
    assert len(motion.positions) == 84  # 344 frames at 120 fps, the first 8 dropped
    hips = motion.position("hip")
    assert 0.7 < hips[:, 2].min() < hips[:, 2].max() < 1.1
    assert np.linalg.norm(hips[-1, :2] - hips[0, :2]) > 2.0
