"""How right a calibrated mount is, how honest its bounds are, and what is refused.

Usage: python -m benchmarks.calibration [--takes 10000] [--workers 2] [--rows ROWS.jsonl] [--data DATA]

DATA is a folder with moveit_handeye/ and ethz_hand_eye/ (both are public); without it only simulated takes
are measured. ROWS keeps what has been measured, so that an interrupted run goes on. With OpenCV 4.x its
solvers are measured beside ours on the same samples.
"""

import argparse
import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from benchmarks.calibration_chain import chain
from benchmarks.calibration_sets import eth, moveit
from benchmarks.calibration_takes import board_take
from ingest.calibration.hand_eye.solve import solve
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

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
