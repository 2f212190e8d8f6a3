"""How often the truth is within the bounds of a mount that the floor has refined."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from ingest.calibration.floor_fit import refine
from ingest.mount import Mount
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError
from tests.ingest.calibration.floor_takes import (
    SIDES,
    Stand,
    believed,
    clamped,
    crate,
    phone_height,
    recorded,
    standing_motion,
)


def _random_case(seed: int) -> tuple[Mount, Mount]:
    """A refined mount and the truth: any box, any phone, lifts, pushes, other sides, with errors."""
    rng = np.random.default_rng(seed)
    mesh, truth = crate(*rng.uniform(0.25, 0.6, 3)), clamped(rng)
    several = rng.random() < 0.4
    stands = [
        Stand(
            tuple(rng.uniform(-1.2, 1.2, 2)),
            rng.uniform(-3, 3),
            SIDES[int(rng.integers(3)) if several else 0],
        )
        for _ in range(int(rng.integers(1, 5)))
    ]
    for k in range(len(stands) - 1):
        alike = stands[k].side is stands[k + 1].side
        stands[k] = replace(stands[k], push=bool(alike and rng.random() < 0.5))
    motion = standing_motion(mesh, stands)
    turn, shift = np.radians(rng.uniform(0.3, 4)), rng.uniform(0.003, 0.04)
    covariance = np.diag([turn**2] * 3 + [shift**2] * 3)
    tape = max(0.03, phone_height(motion, truth) + rng.normal(scale=0.005))
    height = tape if phone_height(motion, truth) > 0.05 and rng.random() < 0.5 else None
    scanned = replace(mesh, vertices=mesh.vertices + rng.normal(scale=1e-3, size=(8, 3)))
    found = refine(
        believed(truth, covariance, rng),
        recorded(motion, truth, seed),
        scanned,
        phone_height=height,
    )
    return found, truth


def _covered(count: int) -> tuple[float, float, float]:
    """Share of random cases in which the truth is within the bounds of turn, shift and all six."""
    told: list[tuple[bool, bool, bool]] = []
    refused: list[str] = []
    for seed in range(count):
        try:
            found, truth = _random_case(seed)
        except InputError as error:  # the box happens to stand on three of its rough corners
            refused.append(error.code)
            continue
        assert found.covariance is not None
        step = between(found.T_phone_object, truth.T_phone_object)
        bounds = bounds_95(found.covariance)
        told.append(
            (
                np.degrees(np.linalg.norm(step[:3])) < bounds.deg,
                1e3 * np.linalg.norm(step[3:]) < bounds.mm,
                step @ np.linalg.solve(found.covariance, step) < chi2.ppf(0.95, 6),
            )
        )
    assert len(refused) <= 0.03 * count
    assert set(refused) <= {"floor-no-side", "floor-contradicts-mount"}
    return tuple(np.mean(told, axis=0).tolist())


def test_the_truth_is_within_the_bounds():
    turn, shift, both = _covered(60)
    assert min(turn, shift, both) >= 0.9  # of 60; 0.93 of 400 in the slow test


@pytest.mark.slow
def test_the_truth_is_within_the_bounds_of_many():
    turn, shift, both = _covered(400)
    assert min(turn, shift, both) >= 0.93
