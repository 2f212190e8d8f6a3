"""How honest the bounds of a mount are when two trackers err as real ones do.

Usage: python -m benchmarks.calibration_trackers [--takes 10000] [--workers 1] [--rows ROWS.jsonl]

Each take draws the size of everything: white noise, outliers, drift of place and direction, errors of
the poses and of the stamps that go on for 0.3 to 3 s, a wrong scale, a frame that is off. ROWS keeps what
has been measured, so that an interrupted run goes on.
"""

import argparse
import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track
from scipy.stats import chi2

from ingest.calibration.hand_eye.hand_eye import solve
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError
from tests.ingest.calibration.hand_eye.two_trackers import Coloured, TwoTrackers, two_trackers

_INSIDE = float(chi2.ppf(0.95, 6))


def tracker_take(seed: int) -> TwoTrackers:
    """One take with every error drawn at random."""
    rng = np.random.default_rng([seed, 1])
    return two_trackers(
        seed,
        noise=rng.uniform(0, 2),
        drift=rng.uniform(0, 0.01),
        wild=rng.uniform(0, 0.2),
        seconds=rng.uniform(20, 60),
        coloured=Coloured(
            pose_deg=rng.uniform(0, 1),
            pose_mm=rng.uniform(0, 10),
            stamp_s=rng.uniform(0, 0.03),
            seconds=float(np.exp(rng.uniform(np.log(0.3), np.log(3)))),
            scale=0.01,
            turn_deg=rng.uniform(0, 0.15),
            alike_deg=0.1,
            alike_mm=1.0,
        ),
    )


def measure(seed: int) -> dict[str, Any]:
    """Errors and bounds of one take, and whether the truth lies inside."""
    take = tracker_take(seed)
    try:
        found = solve(take.phone, take.target)
    except InputError as refusal:
        return {"seed": seed, "refused": refusal.code}
    step = between(found.T_phone_target, take.T_phone_target)
    bounds = bounds_95(found.covariance)
    distance = float(step @ np.linalg.solve(found.covariance, step))
    return {
        "seed": seed,
        "mm": 1e3 * float(np.linalg.norm(step[3:])),
        "deg": float(np.degrees(np.linalg.norm(step[:3]))),
        "bound_mm": bounds.mm,
        "bound_deg": bounds.deg,
        "distance": distance,
    }


def report(rows: list[dict[str, Any]]) -> None:
    """Print the coverage, and how wide the bounds are beside the errors."""
    refused = Counter(row["refused"] for row in rows if "refused" in row)
    solved = [row for row in rows if "mm" in row]
    print(f"\n{len(rows)} takes; refused: {dict(refused) or 'none'}")

    def of(name: str) -> np.ndarray:
        return np.array([row[name] for row in solved])

    inside = (of("distance") < _INSIDE).mean()
    print(
        f"truth inside the 95 % bounds: place {(of('mm') < of('bound_mm')).mean():.1%}, turn "
        f"{(of('deg') < of('bound_deg')).mean():.1%}, all six at once {inside:.1%}; mean of the "
        f"normalised square {of('distance').mean() / 6:.2f}"
    )
    for name, unit in (("mm", "mm"), ("deg", "deg")):
        error, bound = of(name), of(f"bound_{name}")
        print(
            f"error {np.median(error):.2f} {unit} median, {np.quantile(error, 0.95):.2f} {unit} at 95 %; "
            f"bound {np.median(bound):.2f} {unit} median"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--takes", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--rows", type=Path)
    given = parser.parse_args()
    kept: Path | None = given.rows
    rows: list[dict[str, Any]] = []
    if kept and kept.is_file():
        rows = [json.loads(line) for line in kept.read_text().splitlines()]
    todo = sorted(set(range(given.takes)) - {row["seed"] for row in rows})
    with ProcessPoolExecutor(given.workers) as pool:
        for row in track(pool.map(measure, todo, chunksize=4), "takes", total=len(todo)):
            rows.append(row)
            if kept:
                with kept.open("a") as file:
                    file.write(json.dumps(row) + "\n")
    report(rows)


if __name__ == "__main__":
    main()
