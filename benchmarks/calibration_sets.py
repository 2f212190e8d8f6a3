"""Real recordings with two trackers, solved by us and by OpenCV 4's closed forms where they exist."""

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.pose_log import read_pose_log
from ingest.calibration.hand_eye.solve import solve
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.uncertainty import bounds_95, of_inverse
from omomo_core.geometry.transforms import inverse

_SETS = {
    "robot arm": ("robot_arm_w_color_camera_real", "*hinge.csv", "*target_ir.csv", True),
    "PrimeSense + Vicon": ("prime_sense_color_w_vicon_1", "*vicon*.csv", "*image_raw.csv", True),
    "two phones, easy (1, 2)": ("tango_triplet_easy", "CALIGULA*.csv", "MARS*.csv", False),
    "two phones, easy (1, 3)": ("tango_triplet_easy", "CALIGULA*.csv", "NERO*.csv", False),
    "two phones, easy (2, 3)": ("tango_triplet_easy", "MARS*.csv", "NERO*.csv", False),
}
_TAG_SD = np.diag([np.radians(0.3)] * 3 + [0.003] * 3) ** 2
_CV2 = ("TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS")


def moveit(folder: Path) -> None:
    """The 50 pairs of a robot's hand and a board seen by a resting camera; where is the camera?"""
    pairs = np.array(json.loads((folder / "moveit_handeye/pose_samples.json").read_text()))
    hand, board = pairs[:, 0], pairs[:, 1]
    times = np.arange(len(hand), dtype=float)
    found = solve(PoseStream(times, hand), PoseStream(times, board), one_by_one=True)
    t = found.T_world_camera[len(times) // 2, :3, 3]
    print("\nmoveit, 50 pairs: where the camera stands; expected 0.659 -0.249 0.830")
    print(f"  {'ours':11} t {_numbers(t)}  rms {found.rms_mm:.1f} mm {found.rms_deg:.2f} deg")
    _with_cv2(inverse(hand), board, lambda T: print(f"t {_numbers(T[:3, 3])}"))


def eth(folder: Path) -> None:
    """Residuals as the tracker measures: the target's place, with the world at rest and as it drifts."""
    print("\nETH sets: rms over all samples, no outlier left out")
    print(
        "                                         world at rest      drift taken out    95 % bounds    drift"
        "                      scale"
    )
    for name, (part, first, second, tag) in _SETS.items():
        place = next((folder / "ethz_hand_eye" / part).iterdir())
        a = read_pose_log(next(place.glob(first)))
        b = read_pose_log(next(place.glob(second)))
        if tag:  # the file holds the camera in the target's frame: the noise is of the inverse
            b = PoseStream(b.times, b.T, np.stack([of_inverse(T, _TAG_SD) for T in inverse(b.T)]))
        found = solve(a, b)
        mm, deg = bounds_95(found.covariance)
        at = a.at(found.times + found.offset)
        seen = b.at(found.times)
        scaled = at.copy()
        scaled[:, :3, 3] += found.scale * (at[:, :3, 3] - np.median(at[:, :3, 3], axis=0))
        X = found.T_phone_target
        print(
            f"{name:24} {'ours':11} {_rms(_at_rest(scaled, X, seen), scaled, X, seen)}   "
            f"{_rms(found.T_world_camera, scaled, X, seen)}   {mm:5.1f} mm {deg:.2f} deg   "
            f"{found.drift.metres:.3f} m, {1e3 * found.drift.per_metre:.1f} mm per metre   "
            f"{100 * found.scale:+.1f} %"
        )
        _with_cv2(at, inverse(seen), lambda T: print(_rms(_at_rest(at, T, seen), at, T, seen)), 36)  # noqa: B023


def _with_cv2(
    phone: np.ndarray, target: np.ndarray, show: Callable[[np.ndarray], None], indent: int = 2
) -> None:
    """OpenCV's solvers on the same samples; OpenCV 5.0 has none."""
    if not hasattr(cv2, "calibrateHandEye"):
        print(f"{'':{indent}} OpenCV {cv2.__version__} has no hand-eye solvers (4.x has)")
        return
    for name in _CV2:
        method = getattr(cv2, f"CALIB_HAND_EYE_{name}")
        R, t = cv2.calibrateHandEye(
            phone[:, :3, :3], phone[:, :3, 3], target[:, :3, :3], target[:, :3, 3], method=method
        )
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, t.ravel()
        print(f"{'':{indent}} cv2 {name:11}", end=" ")
        show(T)


def _at_rest(P: np.ndarray, X: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The one T_world_camera in the middle of all."""
    Z = P @ X @ inverse(seen)
    mean = np.eye(4)
    mean[:3, :3] = Rotation.from_matrix(Z[:, :3, :3]).mean().as_matrix()
    mean[:3, 3] = np.median(Z[:, :3, 3], axis=0)
    return np.tile(mean, (len(P), 1, 1))


def _rms(Z: np.ndarray, P: np.ndarray, X: np.ndarray, seen: np.ndarray) -> str:
    off = inverse(P @ X) @ Z
    place = inverse(seen)
    mm = 1e3 * np.sqrt(((off[:, :3, 3] - place[:, :3, 3]) ** 2).sum(axis=1).mean())
    turn = Rotation.from_matrix(off[:, :3, :3] @ place[:, :3, :3].swapaxes(1, 2)).magnitude()
    return f"{mm:6.1f} mm {np.degrees(np.sqrt((turn**2).mean())):5.2f} deg"


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{x:.4f}" for x in values)
