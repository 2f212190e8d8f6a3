"""combine: several results of one mount become one that knows how sure it is, or are refused by name."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ingest.calibration.combine import NamedMount, combine
from ingest.mount import Mount
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError

SURE = np.diag([np.radians(0.5) ** 2] * 3 + [0.003**2] * 3)


def pose(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.normal(scale=0.3, size=3)
    return T


def result(
    T: np.ndarray, covariance: np.ndarray, rng: np.random.Generator, name: str = "a", **more
) -> NamedMount:
    """What a calibration of the mount T with these errors finds."""
    found = moved(T, rng.multivariate_normal(np.zeros(6), covariance))
    return NamedMount(name, Mount(found, name, covariance, **more))


def skewed(rng: np.random.Generator) -> np.ndarray:
    """Turns of about a degree, shifts of about a centimetre, all hanging together."""
    A = np.diag([0.012] * 3 + [0.007] * 3) @ rng.normal(size=(6, 12))
    return A @ A.T / 6


def _covered(count: int) -> list[float]:
    """Share of random truths within the bounds: of turn, of shift, and of all six together."""
    rng = np.random.default_rng(0)
    inside: list[list[bool]] = []
    for _ in range(count):
        truth = pose(rng)
        results = [result(truth, skewed(rng), rng) for _ in range(int(rng.integers(2, 5)))]
        try:
            found = combine(results)
        except InputError:
            continue
        assert found.covariance is not None
        each = [np.trace(r.mount.covariance) for r in results if r.mount.covariance is not None]
        assert np.trace(found.covariance) <= 1.001 * min(each)
        step, bounds = between(found.T_phone_object, truth), bounds_95(found.covariance)
        inside.append(
            [
                np.degrees(np.linalg.norm(step[:3])) < bounds.deg,
                1e3 * np.linalg.norm(step[3:]) < bounds.mm,
                step @ np.linalg.solve(found.covariance, step) < chi2.ppf(0.95, 6),
            ]
        )
    assert len(inside) >= 0.99 * count  # honest results are called contradictory in 1 of 1,000
    return np.mean(inside, axis=0).tolist()


def test_the_truth_is_within_the_bounds_of_what_is_combined():
    assert min(_covered(100)) >= 0.9  # of 100; 0.93 of 1,000 in the slow test


@pytest.mark.slow
def test_the_truth_is_within_the_bounds_of_many_that_are_combined():
    shares = _covered(1000)
    assert 0.93 <= min(shares) <= max(shares) <= 0.97


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_order_does_not_matter_and_one_that_knows_nothing_changes_nothing(seed: int):
    rng = np.random.default_rng(seed)
    truth = pose(rng)
    covariances = {name: skewed(rng) for name in "abc"}
    # Better than they say, so that they agree for certain.
    found = [result(truth, 0.1 * C, rng, name).mount for name, C in covariances.items()]
    results = [NamedMount(m.method, replace(m, covariance=covariances[m.method])) for m in found]
    blind = NamedMount("blind", Mount(truth, "blind", np.diag([1.0] * 3 + [1e6] * 3)))
    found = combine(results)
    for other in (combine(results[::-1]), combine([*results, blind])):
        np.testing.assert_allclose(other.T_phone_object, found.T_phone_object, atol=1e-5)
        np.testing.assert_allclose(other.covariance, found.covariance, rtol=1e-2, atol=1e-9)


def test_what_one_leaves_open_another_fills_in():
    rng = np.random.default_rng(1)
    truth = pose(rng)
    up, right = np.eye(6)[4], np.eye(6)[3]
    pushed = result(truth, SURE + 0.3**2 * np.outer(up, up), rng, "pushed", free=("height",))
    seen = result(truth, SURE + 0.2**2 * np.outer(right, right), rng, "seen", free=("side",))
    found = combine([pushed, seen])
    assert found.free == ()
    np.testing.assert_allclose(found.T_phone_object[:3, 3], truth[:3, 3], atol=0.015)
    again = result(truth, SURE + 0.2**2 * np.outer(up, up), rng, "again", free=("height",))
    open_still = combine([pushed, again])
    assert open_still.free == ("the place of the object along the camera's y (up)",)


def test_two_that_disagree_are_refused_with_how_far_and_how_far_they_may():
    rng = np.random.default_rng(2)
    truth = pose(rng)
    off = moved(truth, np.array([0, 0, np.radians(4), 0.03, 0, 0]))
    with pytest.raises(InputError) as caught:
        combine([result(truth, SURE, rng, "board.json"), result(off, SURE, rng, "scan.json")])
    assert caught.value.code == "mounts-disagree"
    assert caught.value.where == "board.json, scan.json"
    assert "mm and" in caught.value.what
    assert "within 11." in caught.value.what or "within 12." in caught.value.what


@pytest.mark.parametrize("wrong", [0, 1, 2, 3])
def test_of_more_the_odd_one_is_named(wrong: int):
    rng = np.random.default_rng(3)
    truth = pose(rng)
    off = moved(truth, np.array([0, np.radians(6), 0, 0, 0, 0]))
    names = ["a.json", "b.json", "c.json", "d.json"]
    results = [result(off if k == wrong else truth, SURE, rng, n) for k, n in enumerate(names)]
    with pytest.raises(InputError, match=f"{names[wrong]} disagrees with the others") as caught:
        combine(results)
    assert caught.value.where == names[wrong]
    assert combine([r for k, r in enumerate(results) if k != wrong]).covariance is not None


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"covariance": None}, "mount-without-covariance"),
        ({"object_id": "stool, 3 x 3 x 4 cm"}, "mounts-object"),
        ({"phone": "iPhone 12"}, "mounts-phone"),
        ({"object_scale": 1.05}, "mounts-scale"),
    ],
)
def test_what_does_not_belong_is_refused_by_name(change: dict, code: str):
    rng = np.random.default_rng(4)
    truth = pose(rng)
    first = result(truth, SURE, rng, "first.json", object_id="chair", phone="iPhone 15")
    silent = result(truth, SURE, rng, "silent.json")
    other = result(truth, SURE, rng, "other.json", object_id="chair", phone="iPhone 15")
    together = combine([silent, first, other])
    assert (together.object_id, together.phone) == ("chair", "iPhone 15")
    with pytest.raises(InputError) as caught:
        combine([silent, first, NamedMount("other.json", replace(other.mount, **change))])
    assert caught.value.code == code
    assert "other.json" in caught.value.where
    with pytest.raises(InputError, match="1 mount to combine"):
        combine([first])


def test_a_mount_by_numbers_without_error_combines():
    rng = np.random.default_rng(5)
    truth = pose(rng)
    exact = NamedMount("drawing.json", Mount(truth, "drawing", np.zeros((6, 6))))
    found = combine([exact, result(truth, SURE, rng)])
    np.testing.assert_allclose(found.T_phone_object, truth, atol=1e-4)
    assert found.method == "drawing and a, combined"
