"""Recordings of real trackers, whose answers others have found too."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.mount.hand_eye.pose_log import read_pose_log
from ingest.mount.hand_eye.solve import HandEye, solve
from ingest.mount.hand_eye.streams import PoseStream
from ingest.mount.uncertainty import bounds_95, of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

DATA = Path(__file__).parents[5] / "shared/data/capture"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data/capture")

ETH = DATA / "ethz_hand_eye"
ROBOT = ETH / "robot_arm_w_color_camera_real/robot_arm"
VICON = ETH / "prime_sense_color_w_vicon_1/prime_sense_1"
PHONES = ETH / "tango_triplet_easy/TANGO_exCALIBur_2"


def _log(folder: Path, pattern: str) -> PoseStream:
    return read_pose_log(next(folder.glob(pattern)))


def _camera_in_target(stream: PoseStream) -> PoseStream:
    """A camera's poses in a tag's frame, made from the tag's in the camera's: turns err most."""
    noise = np.diag([np.radians(0.3)] * 3 + [0.003] * 3) ** 2
    told = np.stack([of_inverse(T, noise) for T in inverse(stream.T)])
    return PoseStream(stream.times, stream.T, told)


def _left(found: HandEye, phone: PoseStream, target: PoseStream) -> tuple[float, float]:
    """mm and deg over all samples, as the target's tracker measures; the world's drift taken out."""
    P, seen = phone.at(found.times + found.offset), inverse(target.at(found.times))
    off = inverse(P @ found.T_phone_target) @ found.T_world_camera
    mm = 1e3 * np.sqrt(((off[:, :3, 3] - seen[:, :3, 3]) ** 2).sum(axis=1).mean())
    turn = Rotation.from_matrix(off[:, :3, :3] @ seen[:, :3, :3].swapaxes(1, 2)).magnitude()
    return float(mm), float(np.degrees(np.sqrt((turn**2).mean())))


def test_moveit():
    pairs = np.array(json.loads((DATA / "moveit_handeye/pose_samples.json").read_text()))
    times = np.arange(len(pairs), dtype=float)
    found = solve(PoseStream(times, pairs[:, 0]), PoseStream(times, pairs[:, 1]), one_by_one=True)
    camera = found.T_world_camera[25]
    np.testing.assert_allclose(camera[:3, 3], [0.659, -0.249, 0.830], atol=0.01)
    expected = Rotation.from_euler("XYZ", [0.230, -2.540, 1.950])
    turn = expected.inv() * Rotation.from_matrix(camera[:3, :3])
    assert turn.magnitude() < 0.02
    assert found.rms_mm < 4.7
    assert found.rms_deg < 0.1


@pytest.mark.parametrize(
    ("folder", "first", "second", "tag", "mm", "deg"),
    [
        (ROBOT, "*hinge.csv", "*target_ir.csv", True, 4.5, 0.64),
        (VICON, "*vicon*", "*image_raw*", True, 12.0, 1.8),
        (PHONES, "CALIGULA*", "MARS*", False, 30.0, 0.5),
        (PHONES, "CALIGULA*", "NERO*", False, 30.0, 0.5),
        (PHONES, "MARS*", "NERO*", False, 30.0, 0.5),
    ],
    ids=["robot", "vicon", "phones12", "phones13", "phones23"],
)
def test_eth(folder: Path, first: str, second: str, tag: bool, mm: float, deg: float):
    phone, target = _log(folder, first), _log(folder, second)
    if tag:
        target = _camera_in_target(target)
    found = solve(phone, target)
    left_mm, left_deg = _left(found, phone, target)
    assert left_mm < mm
    assert left_deg < deg
    assert found.correlation > 0.9
    assert found.open == ()
    assert bounds_95(found.covariance).mm < 20


def test_an_inverted_log_is_named():
    phone, target = _log(ROBOT, "*hinge.csv"), _log(ROBOT, "*target_ir.csv")
    with pytest.raises(InputError) as caught:
        solve(phone, PoseStream(target.times, inverse(target.T)))
    assert caught.value.code == "calibration-stream"
    assert "inverted" in caught.value.what
