"""Ranks of squatting and standing: one scale for whatever height the hands are at."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from omomo_core.generation.sampling.sample_body import posture_levels
from omomo_core.learning.training.corpus import Uprightness


def _people(count: int, seed: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Palms at any height; who reaches low has a low pelvis, one more, another less."""
    rng = np.random.default_rng(seed)
    palm = rng.uniform(0.1, 1.1, count)
    pelvis = 0.95 - rng.uniform(0.0, 0.5, count) * (1.15 - palm)
    return torch.from_numpy(palm).float(), torch.from_numpy(pelvis).float()


def test_every_height_has_its_squats_and_its_straight_legs():
    palm, pelvis = _people(40_000, 0)
    rank = Uprightness(palm, pelvis)(palm, pelvis)
    for low in np.arange(0.1, 1.0, 0.1):
        some = rank[(palm >= low) & (palm < low + 0.1)]
        np.testing.assert_allclose(
            some.quantile(torch.tensor([0.1, 0.5, 0.9])), [0.1, 0.5, 0.9], atol=0.06
        )


@given(seed=st.integers(0, 1000), palm=st.floats(-0.2, 2.5))
def test_higher_pelvises_rank_higher(seed: int, palm: float):
    """At any height, those that nobody has had included."""
    rank = Uprightness(*_people(300, seed))
    heights = torch.linspace(-1.0, 3.0, 200)
    found = rank(torch.full((200,), palm), heights)
    assert found[0] == 0
    assert found[-1] == 1
    assert (found.diff() >= 0).all()


@pytest.mark.parametrize("samples", [1, 2, 7, 20])
def test_samples_differ_evenly_in_their_habits(samples: int):
    """And a seed always gives the same."""
    found = posture_levels(samples, 5)
    assert found.mean() == pytest.approx(0.5)
    assert found.min() + found.max() == pytest.approx(1.0)
    steps = found.sort().values.diff()
    np.testing.assert_allclose(steps, 1 / samples, rtol=1e-4)
    assert torch.equal(found, posture_levels(samples, 5))


@given(seed=st.integers(0, 999), first=st.integers(0, 15))
def test_neighbours_differ_in_their_habits_as_all_do(seed: int, first: int):
    """Some five of twenty hold from the same side: among them are some who squat and some who stoop."""
    found = posture_levels(20, seed)[first : first + 5].sort().values
    assert found[0] < 0.3
    assert found[-1] > 0.7
    assert found.diff().max() < 0.6
