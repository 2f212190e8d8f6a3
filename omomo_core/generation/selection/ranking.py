"""Ranking of K samples without ground truth: the one to show is central and has few faults."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import rankdata

from omomo_core.generation.person import Person
from omomo_core.generation.result import Generation, notes_of
from omomo_core.generation.selection.config import SCORE
from omomo_core.generation.selection.scores import score
from omomo_core.motion import HumanMotion


def rank(people: Sequence[Person], must_hold: Bool[np.ndarray, " frames"]) -> Generation:
    """Return the samples with their scores, the one to show, and what is wrong with it.

    Args:
        people: of the same take.
        must_hold: frames in which somebody must hold the object.
    """
    scores = tuple(score(person, must_hold) for person in people)
    chosen = choose([person.human for person in people], scores)
    return Generation(tuple(people), chosen, scores, notes_of(scores[chosen]))


def choose(motions: Sequence[HumanMotion], scores: Sequence[Mapping[str, float]]) -> int:
    """Return the index of the sample with the lowest sum of two ranks: of its faults and of its distance.

    The sample with the fewest faults is often an outlier, and the most central one may skate. A sample that
    leaps is shown only where all do, and none whose body is much deeper in the object than another's.
    """
    central = rankdata(distance_to_others(np.stack([human.joints for human in motions])).round(6))
    faults = rankdata([s["total"] for s in scores])
    leaps, inside = (np.array([s[k] for s in scores]) for k in ("leaping", "inside_cm"))
    shown = (leaps == 0) | (leaps > 0).all()
    shown &= inside <= inside[shown].min() + 100 * SCORE.extra_depth
    return int(np.argmin(np.where(shown, central + faults, np.inf)))


def distance_to_others(
    points: Float[np.ndarray, "samples frames joints 3"],
) -> Float[np.ndarray, " samples"]:
    """Return each sample's mean distance from the others, the farthest ones left out; metres.

    The few samples that stand on the opposite side by design (`opposite_side.py`) do not count.
    """
    far = np.stack([np.linalg.norm(points - one, axis=-1).mean(axis=(1, 2)) for one in points])
    near = np.sort(far, axis=1)[:, : len(points) - len(points) // SCORE.outliers_one_in]
    return near.sum(axis=1) / max(1, near.shape[1] - 1)
