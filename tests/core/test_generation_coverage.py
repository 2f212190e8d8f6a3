"""Few guesses that stand for many."""

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.selection.plausibility import (
    hypothesis_count,
    k_medoids,
    kernel_mean,
    order_by_side,
)
from omomo_core.generation.selection.selection_config import COVERAGE


def clustered(centres: np.ndarray, each: int, rng: np.random.Generator) -> np.ndarray:
    """Guesses of 9 frames in clusters."""
    palms = np.repeat(centres, each, axis=0)[:, None, None]
    return palms + rng.normal(0, 0.01, (len(palms), 9, 2, 3))


def mean_distance(palms: np.ndarray, kept: np.ndarray) -> float:
    apart = np.linalg.norm(palms[:, None] - palms[kept], axis=-1).mean(axis=(2, 3))
    return float(apart.min(axis=1).mean())


@given(seed=st.integers(0, 2**31), clusters=st.integers(1, 5), each=st.integers(2, 6))
@settings(max_examples=25)
def test_every_cluster_is_met_before_any_is_met_twice(seed: int, clusters: int, each: int):
    rng = np.random.default_rng(seed)
    centres = 5.0 * np.arange(clusters)[:, None] + rng.uniform(0, 1, (clusters, 3))
    palms = clustered(centres, each, rng)[rng.permutation(clusters * each)]
    kept = k_medoids(palms, clusters)
    nearest = np.linalg.norm(palms[kept].mean(axis=(1, 2))[:, None] - centres, axis=-1)
    assert sorted(nearest.argmin(axis=1)) == list(range(clusters))


@given(seed=st.integers(0, 2**31), total=st.integers(4, 20), count=st.integers(1, 4))
@settings(max_examples=25)
def test_no_guess_is_kept_twice_and_the_kept_stand_for_all_better_than_the_first_drawn(
    seed: int, total: int, count: int
):
    # All frames are alike, so that it does not matter which of them are compared.
    palms = np.random.default_rng(seed).normal(size=(total, 1, 2, 3)).repeat(6, axis=1)
    kept = k_medoids(palms, count)
    assert len(set(kept.tolist())) == count
    # Greedy choice is within 63 % of the best gain over the first; random ones are not that good.
    assert mean_distance(palms, kept[:1]) <= mean_distance(palms, np.arange(1)) + 1e-12
    assert all(
        mean_distance(palms, kept[: k + 1]) <= mean_distance(palms, kept[:k])
        for k in range(1, count)
    )
    everyone = k_medoids(palms, total)
    assert sorted(everyone.tolist()) == list(range(total))
    np.testing.assert_array_equal(everyone[:count], kept)


def test_one_alone_is_amid_the_others():
    palms = np.array([0.0, 1.0, 1.4, 2.0, 9.0])[:, None, None, None] * np.ones((5, 4, 2, 3))
    assert k_medoids(palms, 1).tolist() == [2]


@given(samples=st.integers(1, 300))
def test_never_fewer_are_drawn_than_kept(samples: int):
    assert hypothesis_count(samples) >= samples
    assert hypothesis_count(samples) <= max(samples, 100)


def _guesses(places: np.ndarray) -> torch.Tensor:
    """Features of guesses whose palms stand still at these places, holding, with 1 mm of noise."""
    features = torch.ones(len(places), 40, 8)
    features[..., :6] = torch.from_numpy(np.tile(places, 2)).float()[:, None]
    noise = torch.randn(len(places), 40, 6, generator=torch.Generator().manual_seed(0))
    return features + torch.nn.functional.pad(0.001 * noise, (0, 2))


@given(seed=st.integers(0, 2**31), each=st.integers(5, 12))
@settings(max_examples=25)
def test_guesses_of_a_kind_come_nearer_to_what_they_all_guess_and_kinds_stay_apart(
    seed: int, each: int
):
    rng = np.random.default_rng(seed)
    kinds = np.repeat([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], each, axis=0)
    x = _guesses(kinds + rng.normal(0, 0.05, kinds.shape))
    amid = kernel_mean(x)
    off, was = (
        torch.linalg.norm(f[..., :3] - torch.from_numpy(kinds)[:, None], dim=-1).mean()
        for f in (amid, x)
    )
    assert off < 0.8 * was
    torch.testing.assert_close(amid[..., 6:], x[..., 6:])


def test_a_kind_may_change_in_the_midst_of_a_take():
    """Two who hold the same place and then other ones are of a kind only while they do."""
    frames = 300
    x = torch.zeros(2, frames, 8)
    x[0, :, 0], x[1, :, 0] = 0.02, -0.02
    x[1, frames // 2 :, 0] = 2.0
    amid = kernel_mean(x)
    assert (amid[:, : frames // 3, 0].abs() < 0.02).all()
    torch.testing.assert_close(amid[:, -frames // 4 :], x[:, -frames // 4 :], atol=1e-3, rtol=0)


@given(distance=st.floats(4 * COVERAGE.kernel_width, 5.0))
def test_one_unlike_all_others_stays_as_it_is(distance: float):
    x = _guesses(np.array([[0.0, 0, 0], [distance, 0, 0], [2 * distance, 0, 0]]))
    torch.testing.assert_close(kernel_mean(x), x, atol=1e-4, rtol=0)


def test_who_holds_with_the_left_hand_is_not_of_a_kind_with_who_holds_with_the_right():
    x = _guesses(np.random.default_rng(0).normal(0, 0.05, (20, 3)))
    x[:10, :, 6], x[10:, :, 7] = -1, -1
    amid = kernel_mean(x)
    assert ((amid[..., 6:] > 0) == (x[..., 6:] > 0)).all()
    assert amid[..., 6:].abs().min() > 0.9


@given(sides=st.permutations(range(8)))
def test_who_holds_from_the_same_side_is_a_neighbour(sides: list[int]):
    """Where hands are that hold nothing does not count."""
    angle = torch.tensor(sides) * (2 * np.pi / 8) - 3.0
    features = torch.full((8, 6, 8), -1.0)
    features[:, :3, :6] = 9.0 * torch.randn(8, 3, 6)
    features[:, 3:, 6:] = 1.0
    for hand in (0, 1):
        features[:, 3:, 3 * hand] = angle.cos()[:, None]
        features[:, 3:, 3 * hand + 1] = angle.sin()[:, None]
    ordered = order_by_side(features)
    assert torch.equal(ordered, features[torch.tensor(sides).argsort()])
