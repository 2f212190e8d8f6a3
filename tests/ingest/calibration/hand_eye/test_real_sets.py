"""Recordings of real trackers, whose answers others have found too."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.hand_eye import HandEye, solve
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import read_pose_log
from ingest.uncertainty import between, bounds_95, of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

ROBOT = "robot_arm_w_color_camera_real/robot_arm"
VICON = "prime_sense_color_w_vicon_1/prime_sense_1"
VICON_AGAIN = "prime_sense_color_w_vicon_2/prime_sense_2"
PHONES = "tango_triplet_easy/TANGO_exCALIBur_2"
Recording = tuple[PoseStream, PoseStream]


@pytest.fixture(scope="module")
def eth(shared: Path) -> Path:
    return shared / "data/capture/ethz_hand_eye"


def _log(folder: Path, pattern: str) -> PoseStream:
    return read_pose_log(next(folder.glob(pattern)))


def _odometry(folder: Path, tmp_path: Path) -> PoseStream:
    """The flying rig's odometry in its world; its file, which begins out of order, put in order."""
    lines = next(folder.glob("*imu_odom.csv")).read_text().splitlines()
    path = tmp_path / f"{folder.name}.csv"
    path.write_text("\n".join(sorted(lines, key=lambda line: float(line.split(",")[0]))) + "\n")
    return _inverted(read_pose_log(path))


def _inverted(stream: PoseStream) -> PoseStream:
    return PoseStream(stream.times, inverse(stream.T))


def _camera_in_target(stream: PoseStream) -> PoseStream:
    """A camera's poses in a tag's frame, made from the tag's in the camera's: turns err most."""
    noise = np.diag([np.radians(0.3)] * 3 + [0.003] * 3) ** 2
    told = np.stack([of_inverse(T, noise) for T in inverse(stream.T)])
    return PoseStream(stream.times, stream.T, told)


def _left(found: HandEye, phone: PoseStream, target: PoseStream) -> tuple[float, float]:
    """mm and deg over all samples, as the target's tracker measures; the world's drift taken out."""
    P, seen = phone.at(found.times + found.offset), inverse(target.at(found.times))
    P[:, :3, 3] += found.scale * (P[:, :3, 3] - np.median(P[:, :3, 3], axis=0))
    off = inverse(P @ found.T_phone_target) @ found.T_world_camera
    mm = 1e3 * np.sqrt(((off[:, :3, 3] - seen[:, :3, 3]) ** 2).sum(axis=1).mean())
    turn = Rotation.from_matrix(off[:, :3, :3] @ seen[:, :3, :3].swapaxes(1, 2)).magnitude()
    return float(mm), float(np.degrees(np.sqrt((turn**2).mean())))


def test_moveit(shared: Path):
    file = shared / "data/capture/moveit_handeye/pose_samples.json"
    pairs = np.array(json.loads(file.read_text()))
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
def test_eth(eth: Path, folder: str, first: str, second: str, tag: bool, mm: float, deg: float):
    phone, target = _log(eth / folder, first), _log(eth / folder, second)
    if tag:
        target = _camera_in_target(target)
    found = solve(phone, target)
    left_mm, left_deg = _left(found, phone, target)
    assert left_mm < mm
    assert left_deg < deg
    assert found.correlation > 0.9
    assert found.open == ()
    assert bounds_95(found.covariance).mm < 25
    assert found.rest_mm >= found.rms_mm
    assert found.drift.per_metre < 0.02


def test_an_inverted_log_is_named(eth: Path):
    phone, target = _log(eth / ROBOT, "*hinge.csv"), _log(eth / ROBOT, "*target_ir.csv")
    with pytest.raises(InputError) as caught:
        solve(phone, PoseStream(target.times, inverse(target.T)))
    assert caught.value.code == "calibration-stream"
    assert "inverted" in caught.value.what


def _apart(first: HandEye, second: HandEye) -> tuple[bool, float]:
    """Whether place and turn are within their combined 95 % bounds, and the normalised square."""
    step = between(first.T_phone_target, second.T_phone_target)
    covariance = first.covariance + second.covariance
    bounds = bounds_95(covariance)
    inside = (
        1e3 * np.linalg.norm(step[3:]) < bounds.mm
        and np.degrees(np.linalg.norm(step[:3])) < bounds.deg
    )
    return bool(inside), float(step @ np.linalg.solve(covariance, step)) / 6


def _solved(recording: Recording) -> HandEye | None:
    try:
        return solve(*recording)
    except InputError:
        return None


def _rigs(eth: Path, tmp_path: Path) -> dict[str, list[Recording]]:
    """Every two recordings of one rig, whichever of the trackers is taken for the phone."""
    rigs: dict[str, list[Recording]] = {}
    for folder in (VICON, VICON_AGAIN):
        vicon, camera = _log(eth / folder, "*vicon*"), _log(eth / folder, "*image_raw*")
        rigs.setdefault("vicon and camera", []).append((vicon, camera))
        rigs.setdefault("camera and vicon", []).append((camera, vicon))
        rigs.setdefault("vicon, camera that tells", []).append((vicon, _camera_in_target(camera)))
    for folder in ("3_falcon", "4_falcon"):
        vicon = _inverted(_log(eth / folder, "*merged-*falcon_vicon.csv"))
        odometry = _odometry(eth / folder, tmp_path)
        rigs.setdefault("odometry and vicon", []).append((odometry, vicon))
        rigs.setdefault("vicon and odometry", []).append((vicon, odometry))
        for name in "der":
            camera = _log(eth / folder, f"*_W_{name}.csv")
            rigs.setdefault(f"vicon and {name}", []).append((vicon, camera))
            rigs.setdefault(f"{name} and vicon", []).append((camera, vicon))
            rigs.setdefault(f"odometry and {name}", []).append((odometry, camera))
    return rigs


def test_recordings_of_one_rig_agree_unless_refused(eth: Path, tmp_path: Path):
    compared: dict[str, float] = {}
    for name, recordings in _rigs(eth, tmp_path).items():
        first, second = (_solved(recording) for recording in recordings)
        if first is not None and second is not None:
            inside, compared[name] = _apart(first, second)
            assert inside, name
            # Honest, and not because they are wide.
            assert bounds_95(first.covariance + second.covariance).deg < 2
    assert len(compared) >= 5
    assert 0.1 < np.mean(list(compared.values())) < 1.5


def test_both_halves_of_a_recording_agree(eth: Path):
    recordings = [(_log(eth / ROBOT, "*hinge.csv"), _log(eth / ROBOT, "*target_ir.csv"))]
    for folder in (VICON, VICON_AGAIN):
        recordings.append((_log(eth / folder, "*vicon*"), _log(eth / folder, "*image_raw*")))
    phones = [_log(eth / PHONES, f"{name}*") for name in ("CALIGULA", "MARS", "NERO")]
    recordings += [(phones[i], phones[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    found: list[tuple[bool, float]] = []
    for phone, target in recordings:
        later = target.times > np.median(target.times)
        halves = [
            _solved((phone, PoseStream(target.times[part], target.T[part])))
            for part in (~later, later)
        ]
        if halves[0] is not None and halves[1] is not None:
            found.append(_apart(halves[0], halves[1]))
    inside, squares = np.array(found).T
    assert len(found) >= 5
    # Of six, 95 % bounds may miss one.
    assert inside.sum() >= len(found) - 1
    assert 0.3 < squares.mean() < 1.6


@pytest.mark.parametrize("phone_is", ["odometry", "vicon"])
def test_the_lost_odometry_is_refused(eth: Path, tmp_path: Path, phone_is: str):
    vicon = _inverted(_log(eth / "3_falcon", "*merged-*falcon_vicon.csv"))
    odometry = _odometry(eth / "3_falcon", tmp_path)
    streams = (odometry, vicon) if phone_is == "odometry" else (vicon, odometry)
    with pytest.raises(InputError) as caught:
        solve(*streams)
    refusal = caught.value
    assert refusal.code == "calibration-lost"
    assert refusal.what.startswith("The phone's" if phone_is == "odometry" else "The other")
    lost_from = float(refusal.where.split()[0])
    assert 28 < lost_from < 32
    assert refusal.fix
