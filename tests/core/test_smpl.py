"""AMASS files: rotations as they are, the way in our size, bad files by name."""

from pathlib import Path

import numpy as np
import pytest

from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.recordings.smpl import is_smpl, read_smpl, world_rotations
from tests.core.rig_files import stepping

PELVIS = np.array([0.002, -0.24, 0.028])


def write(path: Path, *, size: float = 1.0, width: int = 156, **changes: object) -> Path:
    root, pose = stepping(360)
    poses = np.zeros((360, width))
    poses[:, :66] = pose.reshape(360, 66)
    content: dict[str, object] = {
        "poses": poses,
        "trans": root * size - PELVIS,
        "betas": np.zeros(16),
        "gender": np.array("female"),
        "mocap_framerate": np.array(90.0),
    }
    np.savez(path, **(content | changes))  # pyright: ignore[reportArgumentType]
    return path


@pytest.mark.parametrize("width", [156, 165])
@pytest.mark.parametrize("size", [0.9, 1.0, 1.15])
def test_the_way_is_scaled_to_our_legs(tmp_path: Path, width: int, size: float) -> None:
    path = write(tmp_path / "walk_poses.npz", size=size, width=width)
    assert is_smpl(path)
    found = read_smpl(path, load_body())
    root, pose = stepping(360)
    assert len(found.root) == 120
    np.testing.assert_allclose(found.rotations, world_rotations(pose[::3]), atol=1e-6)
    way = np.linalg.norm(np.ptp(root[:, :2], axis=0))
    assert np.linalg.norm(np.ptp(found.root[:, :2], axis=0)) == pytest.approx(way, rel=0.03)


def test_a_folder_of_amass_becomes_clips(tmp_path: Path) -> None:
    write(tmp_path / "walk_poses.npz")
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16))
    (clip,) = build_mocap(tmp_path, load_body())
    assert clip.source == "amass"
    assert clip.foot_contact.any(axis=1).mean() > 0.5


@pytest.mark.parametrize(
    ("code", "changes"),
    [
        ("mocap-not-finite", {"trans": np.full((360, 3), np.nan)}),
        ("mocap-file", {"trans": np.zeros((3, 3))}),
        ("mocap-file", {"poses": np.zeros((360, 20))}),
        ("mocap-rate", {"mocap_framerate": np.array(0.0)}),
        ("mocap-units", {"trans": 100 * stepping(360)[0]}),
        ("mocap-units", {"trans": stepping(360)[0] / 0.3048}),
        ("mocap-empty", {"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))}),
    ],
)
def test_bad_files_are_named(tmp_path: Path, code: str, changes: dict[str, object]) -> None:
    path = write(tmp_path / "a.npz", **changes)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError) as caught:
        read_smpl(path, load_body())
    assert caught.value.code == code
