"""How right a calibrated mount is, how honest its bounds are, and what is refused.

Usage: python -m benchmarks.calibration [--takes 10000] [--workers 2] [--rows ROWS.jsonl] [--data DATA]

DATA is a folder with moveit_handeye/ and ethz_hand_eye/ (both are public); without it only simulated takes
are measured. ROWS keeps what has been measured, so that an interrupted run goes on. With OpenCV 4.x its
solvers are measured beside ours on the same samples.
"""

import argparse
import json
import tempfile
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich.progress import track
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from capture_app.cli.app import invoke
from capture_app.simulator.demo_take import box_mesh, carried_box, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import (
    BOOT_SECONDS,
    PhoneNoise,
    arkit_from_world,
    simulate,
)
from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_sheet import preset_for
from ingest.calibration.hand_eye.hand_eye import solve
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import read_pose_log
from ingest.formats.registry import read_session
from ingest.mount import Mount
from ingest.mount_file import load_mount
from ingest.trajectory.object_motion import to_object_motion
from ingest.uncertainty import between, bounds_95, of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.simulator.wiggle import Wiggle, wiggle_motion
from tests.simulator.witness import board_on_box, corner_observations, record_witness, tripod


def chain(seed: int = 0) -> tuple[float, float]:
    """mm and deg (95th percentiles over the take) between the object's poses and the truth.

    A phone without drift but with jitter; the board's film is drawn, written as H.264 and read.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _record(folder, seed)
        code = invoke(
            [
                *("calibrate", "board", str(folder / "wiggle"), str(folder / "board.mp4")),
                *("--board", "A4", "--board-place", str(folder / "place.json")),
                *("--camera", str(folder / "camera.json"), "-o", str(folder / "mount.json")),
            ]
        )
        if code:
            raise SystemExit(code)
        mm, deg = _compare(folder)
    print(
        f"\nchain: object's pose off by {mm:.2f} mm and {deg:.3f} deg (95 % of the take's frames)"
    )
    return mm, deg


def _record(folder: Path, seed: int) -> None:
    """Both sessions of the phone, the witness's film and where the board is."""
    mount, quiet = clamped_phone(), replace(PhoneNoise(), drift=0.0)
    board, wiggle = preset_for("A4"), wiggle_motion(seed=seed)
    write_recording(
        simulate(wiggle, mount, seed=seed, noise=quiet),
        folder / "wiggle",
        None,
    )
    write_recording(
        simulate(carried_box(), mount, seed=seed + 1, noise=quiet),
        folder / "take",
        None,
    )
    on_box = board_on_box(board)
    witness = tripod(rate=15.0, start=0.7)
    record_witness(folder / "board.mp4", wiggle, board, on_box, witness, seed=seed)
    corners = [0, 3, 12, 20]
    at = board.corners[corners] @ on_box[:3, :3].T + on_box[:3, 3]
    points = [{"corner": c, "object": p.tolist()} for c, p in zip(corners, at, strict=True)]
    (folder / "place.json").write_text(json.dumps({"points": points, "sigma_mm": 0.5}))


def _compare(folder: Path) -> tuple[float, float]:
    """The take with the calibrated mount against the motion that was simulated, in ARKit's world."""
    take = to_object_motion(
        read_session(folder / "take"), box_mesh(), load_mount(folder / "mount.json")
    )
    made = inverse(take.T_world_arkit) @ take.motion.T_world_object
    truth = carried_box().T_world_object
    start = truth[0] @ inverse(clamped_phone().T_phone_object)
    truth = arkit_from_world(start) @ truth
    count = min(len(made), len(truth))
    off = inverse(truth[:count]) @ made[:count]
    mm = 1e3 * np.linalg.norm(made[:count, :3, 3] - truth[:count, :3, 3], axis=1)
    deg = np.degrees(Rotation.from_matrix(off[:, :3, :3]).magnitude())
    return float(np.quantile(mm, 0.95)), float(np.quantile(deg, 0.95))


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


BOARD = preset_for("A4")


@dataclass(frozen=True)
class BoardTake:
    """What the phone and the board's tracker give, and the truth."""

    phone: PoseStream
    target: PoseStream
    T_phone_board: np.ndarray
    offset: float
    """Seconds to add to the target's times."""
    noise_px: float
    wild: float


def board_take(seed: int, kind: Wiggle = "all axes", seconds: float = 20.0) -> BoardTake:
    """One take with everything drawn at random: mount, motion, 0-3 px, drift, outliers, offset."""
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-0.4, 0.4, 3)
    noise_px, wild = rng.uniform(0, 3), rng.uniform(0, 0.3)
    motion = wiggle_motion(kind, seconds=seconds, seed=seed)
    session = simulate(
        motion, Mount(T, "truth"), seed=seed, noise=PhoneNoise(drift=rng.uniform(0, 0.01))
    )
    start, error = rng.uniform(0, 1.0), rng.uniform(-0.2, 0.2)
    at = motion.T_world_object[:, :3, 3].mean(axis=0)
    witness = tripod(at, rate=15.0, start=start, distance=rng.uniform(0.9, 1.6))
    T_object_board = board_on_box(BOARD)
    seen = witness.board_poses(motion, T_object_board)
    # In an outlier the detector sees the board of another moment.
    shuffled = np.where(rng.random(len(seen)) < wild, rng.permutation(len(seen)), range(len(seen)))
    pixels, numbers = corner_observations(
        seen[shuffled], BOARD, witness.camera, rng, sigma=noise_px, lost=0.1, wild=0.02
    )
    poses = board_poses(pixels, numbers, BOARD, witness.camera.K, witness.camera.lens)
    sure = ~poses.ambiguous
    times = witness.times(motion)[poses.frames[sure]]
    return BoardTake(
        phone=PoseStream(session.times + error, session.T_world_phone),
        target=PoseStream(times, poses.T_camera_board[sure], poses.covariance[sure]),
        T_phone_board=T @ T_object_board,
        offset=BOOT_SECONDS + start + error,
        noise_px=noise_px,
        wild=wild,
    )


_INSIDE = float(chi2.ppf(0.95, 6))
_FLIP = np.diag([1.0, 1.0, -1.0, 1.0])
_EACH = 100
"""Takes of each motion and fault that should be refused."""


def measure(seed: int) -> dict[str, Any]:
    """One take that can be solved: errors, bounds, and whether the truth lies inside."""
    take = board_take(seed)
    row: dict[str, Any] = {"seed": seed, "px": take.noise_px, "wild": take.wild}
    try:
        found = solve(take.phone, take.target)
    except InputError as refusal:
        return row | {"refused": refusal.code}
    step = between(found.T_phone_target, take.T_phone_board)
    mm, deg = 1e3 * np.linalg.norm(step[3:]), np.degrees(np.linalg.norm(step[:3]))
    bounds = bounds_95(found.covariance)
    return row | {
        "mm": float(mm),
        "deg": float(deg),
        "bound_mm": bounds.mm,
        "bound_deg": bounds.deg,
        "all": bool(step @ np.linalg.solve(found.covariance, step) < _INSIDE),
        "ms": 1e3 * abs(found.offset - take.offset),
        "open": len(found.open),
    }


def simulated(takes: int, workers: int, kept: Path | None) -> None:
    rows = (
        [json.loads(line) for line in kept.read_text().splitlines()]
        if kept and kept.is_file()
        else []
    )
    todo = sorted(set(range(takes)) - {row["seed"] for row in rows})
    with ProcessPoolExecutor(workers) as pool:
        done = pool.map(measure, todo, chunksize=4)
        for row in track(done, "takes", total=len(todo)):
            rows.append(row)
            if kept:
                with kept.open("a") as file:
                    file.write(json.dumps(row) + "\n")
    refused = Counter(row["refused"] for row in rows if "refused" in row)
    solved = [row for row in rows if "mm" in row]
    print(f"\n{len(rows)} takes, all axes turned; refused: {dict(refused) or 'none'}")
    print(
        "corners' noise   takes   truth inside: position  rotation  all six   error: median, 95 %   "
        "   bound, median     clock"
    )
    for low, high in ((0, 1), (1, 2), (2, 3), (0, 3)):
        some = [row for row in solved if low <= row["px"] < high]
        if some:
            print(f"{low} to {high} px {_line(some)}")


def _line(rows: list[dict[str, Any]]) -> str:
    def of(name: str) -> np.ndarray:
        return np.array([row[name] for row in rows])

    mm, deg = of("mm"), of("deg")
    return (
        f"{len(rows):12d} {(mm < of('bound_mm')).mean():18.1%} {(deg < of('bound_deg')).mean():9.1%} "
        f"{of('all').mean():8.1%}   {np.median(mm):4.1f} mm {np.median(deg):.2f} deg, "
        f"{np.quantile(mm, 0.95):4.1f} mm {np.quantile(deg, 0.95):.2f} deg   "
        f"{np.median(of('bound_mm')):4.1f} mm {np.median(of('bound_deg')):.2f} deg   "
        f"{np.median(of('ms')):.2f} ms"
    )


def degenerate() -> None:
    """Motions that do not show the mount, and files read the wrong way."""
    print(f"\nwhat must not give a mount in silence ({_EACH} takes each)")
    for kind in ("yaw", "translation", "tiny"):
        print(f"  {kind:34}", _outcomes([board_take(seed, kind) for seed in range(_EACH)]))
    wrong = {
        "inverted": inverse,
        "quaternions w first": lambda T: _order(T, [3, 0, 1, 2]),
        "quaternions x first": lambda T: _order(T, [1, 2, 3, 0]),
        "mirrored": lambda T: _FLIP @ T @ _FLIP,
    }
    for name, change in wrong.items():
        for whose in ("phone", "target"):
            takes = [board_take(seed) for seed in range(_EACH)]
            streams = [_changed(t.phone, t.target, whose, change) for t in takes]
            print(f"  {f'{name}, {whose}':34}", _outcomes(takes, streams))


def _changed(phone: PoseStream, target: PoseStream, whose: str, change: Any):
    if whose == "phone":
        return PoseStream(phone.times, change(phone.T)), target
    return phone, PoseStream(target.times, change(target.T), target.covariance)


def _order(T: np.ndarray, order: list[int]) -> np.ndarray:
    out = T.copy()
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, order]
    out[:, :3, :3] = Rotation.from_quat(quaternion).as_matrix()
    return out


def _outcomes(takes: list[Any], streams: list[Any] | None = None) -> str:
    counts: Counter[str] = Counter()
    for k, take in enumerate(takes):
        try:
            found = solve(*(streams[k] if streams else (take.phone, take.target)))
        except InputError as refusal:
            counts[f"refused ({refusal.code})"] += 1
            continue
        step = between(found.T_phone_target, take.T_phone_board)
        inside = step @ np.linalg.solve(found.covariance, step) < _INSIDE
        told = "; ".join(each.words for each in found.open) or "nothing open"
        counts[f"{told}, truth {'inside' if inside else 'OUTSIDE'}"] += 1
    return ", ".join(f"{name}: {count}" for name, count in counts.most_common())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--takes", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rows", type=Path)
    parser.add_argument("--data", type=Path)
    given = parser.parse_args()
    if given.data:
        moveit(given.data)
        eth(given.data)
    chain()
    degenerate()
    simulated(given.takes, given.workers, given.rows)


if __name__ == "__main__":
    main()
