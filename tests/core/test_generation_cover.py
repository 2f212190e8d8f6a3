"""Few guesses that stand for many."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.cover import cover, guesses


def around(centres: np.ndarray, each: int, rng: np.random.Generator) -> np.ndarray:
    """Guesses of 9 frames in clusters."""
    palms = np.repeat(centres, each, axis=0)[:, None, None]
    return palms + rng.normal(0, 0.01, (len(palms), 9, 2, 3))


def mean_distance(palms: np.ndarray, kept: np.ndarray) -> float:
    apart = np.linalg.norm(palms[:, None] - palms[kept], axis=-1).mean(axis=(2, 3))
    return float(apart.min(axis=1).mean())


@given(seed=st.integers(0, 2**31), clusters=st.integers(1, 5), each=st.integers(2, 6))
@settings(max_examples=25, deadline=None)
def test_every_cluster_is_met_before_any_is_met_twice(seed: int, clusters: int, each: int):
    rng = np.random.default_rng(seed)
    centres = 5.0 * np.arange(clusters)[:, None] + rng.uniform(0, 1, (clusters, 3))
    palms = around(centres, each, rng)[rng.permutation(clusters * each)]
    kept = cover(palms, clusters)
    nearest = np.linalg.norm(palms[kept].mean(axis=(1, 2))[:, None] - centres, axis=-1)
    assert sorted(nearest.argmin(axis=1)) == list(range(clusters))


@given(seed=st.integers(0, 2**31), total=st.integers(4, 20), count=st.integers(1, 4))
@settings(max_examples=25, deadline=None)
def test_no_guess_is_kept_twice_and_the_kept_stand_for_all_better_than_the_first_drawn(
    seed: int, total: int, count: int
):
    # All frames are alike, so that it does not matter which of them are compared.
    palms = np.random.default_rng(seed).normal(size=(total, 1, 2, 3)).repeat(6, axis=1)
    kept = cover(palms, count)
    assert len(set(kept.tolist())) == count
    # Greedy choice is within 63 % of the best gain over the first; random ones are not that good.
    assert mean_distance(palms, kept[:1]) <= mean_distance(palms, np.arange(1)) + 1e-12
    assert all(
        mean_distance(palms, kept[: k + 1]) <= mean_distance(palms, kept[:k])
        for k in range(1, count)
    )
    everyone = cover(palms, total)
    assert sorted(everyone.tolist()) == list(range(total))
    np.testing.assert_array_equal(everyone[:count], kept)


def test_one_alone_is_amid_the_others():
    palms = np.array([0.0, 1.0, 1.4, 2.0, 9.0])[:, None, None, None] * np.ones((5, 4, 2, 3))
    assert cover(palms, 1).tolist() == [2]


@given(samples=st.integers(1, 300))
def test_never_fewer_are_drawn_than_kept(samples: int):
    assert guesses(samples) >= samples
    assert guesses(samples) <= max(samples, 100)
