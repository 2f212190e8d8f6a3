"""What the solver takes the trackers' noise to be, against noise that is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, f

from ingest.calibration.hand_eye.hand_eye import solve
from ingest.calibration.hand_eye.hand_eye_model import (
    PHONE_SD,
    TARGET_SD,
    PoseStream,
    matched,
    paired,
)
from ingest.calibration.hand_eye.hand_eye_refine import (
    _beyond,
    _noise_and_walk,
    _path,
    _shown_by_jitter,
    refine,
)
from ingest.calibration.hand_eye.to_mount import calibrate_by_motion
from ingest.uncertainty import moved
from omomo_core.geometry.transforms import inverse
from tests.ingest.calibration.hand_eye.two_trackers import two_trackers


def test_a_sample_has_the_covariance_of_the_nearest_pose():
    take = two_trackers(1)
    sizes = 1 + np.arange(len(take.target.times))[:, None, None]
    target = replace(take.target, covariance=sizes * np.eye(6))
    samples = paired(take.phone, target, take.offset)
    nearest = target.times[samples.target_covariance[:, 0, 0].round().astype(int) - 1]
    assert np.abs(nearest - samples.times).max() <= np.diff(target.times).max() / 2 + 1e-9


@pytest.mark.parametrize(("noise", "walk"), [(0.003, 0.0), (0.002, 0.002), (0.003, 0.01)])
def test_noise_and_walk_are_told_apart(noise: float, walk: float):
    times = np.arange(300) / 10
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        steps = walk * np.sqrt(0.1) * rng.normal(size=(300, 3))
        series = steps.cumsum(axis=0) + noise * rng.normal(size=(300, 3))
        along = rng.normal(size=(300, 3))
        found.append(_noise_and_walk(series, along, times))
    got = np.median(found, axis=0)
    assert got[0] == pytest.approx(noise, rel=0.15)
    assert got[1] == pytest.approx(walk, rel=0.1, abs=0.1 * noise)


def test_noise_of_pairs_without_drift_is_measured():
    """Twice as noisy as is expected of both trackers: the factor says so."""
    rng = np.random.default_rng(0)
    X = moved(np.eye(4), np.array([0.3, -0.2, 0.5, 0.1, 0.2, -0.1]))
    Z = moved(np.eye(4), np.array([0.1, 0.7, -0.3, 1.0, 0.5, 2.0]))
    P = np.tile(np.eye(4), (200, 1, 1))
    P[:, :3, :3] = Rotation.random(200, random_state=rng).as_matrix()
    P[:, :3, 3] = rng.normal(size=(200, 3))
    seen = inverse(Z) @ P @ X
    times = np.arange(200.0)
    spread = 2 * np.hypot(PHONE_SD, TARGET_SD)
    noisy = np.stack([moved(T, spread * rng.normal(size=6)) for T in seen])
    fit = refine(matched(PoseStream(times, P), PoseStream(times, noisy)), X)
    assert fit.noise == pytest.approx([2.0, 2.0], rel=0.2)


def test_what_turns_by_noise_alone_is_taken_for_shown_grows_with_that_noise():
    take = two_trackers(1)
    samples = paired(take.phone, take.target, take.offset)
    fit = refine(samples, take.T_phone_target, lambda late: samples.later(take.phone, late))
    few, many = (
        np.trace(_shown_by_jitter(replace(fit, noise=np.array([k, 1.0])), samples)) for k in (2, 4)
    )
    assert many / few == pytest.approx(4, rel=0.3)


def test_stretches_that_disagree_no_more_than_noise_widen_by_what_few_of_them_need():
    pull = np.random.default_rng(0).normal(size=(8, 3))
    expected = (pull**2).sum() / (3 * 7) * 8
    expected *= 3 * f.ppf(0.95, 3, 21) / chi2.ppf(0.95, 3)
    assert _beyond(pull, 8) == pytest.approx(expected)


def test_a_short_path_is_as_long_as_its_steps():
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])
    assert _path(corner) == pytest.approx(2)
    assert _path(np.zeros((1, 3))) == 0
    straight = np.linspace([0, 0, 0], [1, 0, 0], 11)
    assert _path(straight) == pytest.approx(0.8)


def test_a_mount_says_how_many_moments_were_used():
    take = two_trackers(3, wild=0.1)
    kept = solve(take.phone, take.target).kept
    told = calibrate_by_motion(take.phone, take.target, np.eye(4), np.zeros((6, 6)), "tracker")
    assert 50 < told.residuals["moments used_%"] == pytest.approx(100 * kept.mean(), abs=0.06)
    assert kept.mean() < 1
