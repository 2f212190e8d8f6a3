"""Which of K samples to show when nobody knows the truth."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import rankdata

from omomo_core.generation.person import Person
from omomo_core.generation.result import Generation, notes_of
from omomo_core.generation.selection.scores import score
from omomo_core.motion import HumanMotion


def rank(people: Sequence[Person], must_hold: Bool[np.ndarray, " frames"]) -> Generation:
    """The samples judged, with the one to show and what is wrong with it.

    Args:
        people: of the same take.
        must_hold: frames in which somebody must hold the object.
    """
    scores = tuple(score(person, must_hold) for person in people)
    chosen = choose([person.human for person in people], scores)
    return Generation(tuple(people), chosen, scores, notes_of(scores[chosen]))


def choose(motions: Sequence[HumanMotion], scores: Sequence[Mapping[str, float]]) -> int:
    """Index of the sample to show: one amid the others and with few faults, by the sum of both ranks.

    The least faulty alone is often an outlier; the one amid the others alone may skate. Who leaps is shown
    only where all do.
    """
    amid = rankdata(distance_to_others(np.stack([human.joints for human in motions])).round(6))
    faults = rankdata([s["total"] for s in scores])
    leaps = np.array([s["leaping"] > 0 for s in scores])
    return int(np.argmin(np.where(leaps & ~leaps.all(), np.inf, amid + faults)))


def distance_to_others(
    points: Float[np.ndarray, "samples frames joints 3"],
) -> Float[np.ndarray, " samples"]:
    """Mean distance of each sample's points from the others', but for the farthest quarter; metres.

    The least is amid the others. The few who stand on the object's other side by design do not count.
    """
    far = np.stack([np.linalg.norm(points - one, axis=-1).mean(axis=(1, 2)) for one in points])
    near = np.sort(far, axis=1)[:, : len(points) - len(points) // 4]
    return near.sum(axis=1) / max(1, near.shape[1] - 1)
