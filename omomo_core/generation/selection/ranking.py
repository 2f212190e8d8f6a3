"""Scores of samples without the truth, and their ranking."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.trajectory_optimization.solver_config import JOINT_RANGES
from omomo_core.generation.generation_config import RECORDED
from omomo_core.generation.generation_options import Generation, notes_of
from omomo_core.generation.person import Person
from omomo_core.generation.selection.selection_config import SCORE, SCORE_WEIGHTS
from omomo_core.generation.selection.speed_limits import speed_excess
from omomo_core.long_arrays import in_blocks
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import joint

FEET = (7, 8, 10, 11)
"""Ankles and toes, in the order of a motion's foot contacts."""
_WEIGHTS: dict[str, float] = asdict(SCORE_WEIGHTS)
_LASTING = ("miss_cm", "inside_cm", "skate_cm_s")
"""Faults of people as sampled that tell of those that are left when they are solved."""


def score(person: Person, must_hold: Bool[np.ndarray, " frames"]) -> dict[str, float]:
    """Return the faults of one sample; "total", their weighted sum, ranks the samples: less is better.

    Args:
        person: the sample.
        must_hold: frames in which somebody must hold the object.
    """
    human, held = person.human, person.human.hand_contact > 0.5
    faults = {
        "unheld": float((must_hold & ~held.any(axis=1)).sum() / max(1, must_hold.sum())),
        "miss_cm": 100 * float(person.miss[held].mean()) if held.any() else 0.0,
        "skate_cm_s": _skate(human),
        "inside_cm": 100 * float(person.depth.mean()),
        "hands_inside_cm": _hand_depth(person),
        "wrists_beyond": _wrists_beyond(human),
        "floating": float((_lowest_foot(human) > SCORE.floating_height).mean()),
        "jerk_m_s3": _jerk(human.joints),
        "leaping": speed_excess(human),
    }
    return {**faults, "total": sum(_WEIGHTS[k] * v for k, v in faults.items())}


def _hand_depth(person: Person) -> float:
    """Return the mean depth of the deepest finger or palm of a hand that holds, cm; 0 if unknown."""
    held = person.human.hand_contact > 0.5
    if person.finger_fit is None or not held.any():
        return 0.0
    return 100 * float(person.finger_fit.depth[held].mean())


def _wrists_beyond(human: HumanMotion) -> float:
    """Return the share of frames of holding hands in which their wrists are beyond their range."""
    held = human.hand_contact > 0.5
    beyond = in_blocks(_both_wrists, human.rotations)
    return float((beyond > SCORE.wrist_slack)[held].mean()) if held.any() else 0.0


def _both_wrists(rotations: Float[np.ndarray, "frames 22 3 3"]) -> Float[np.ndarray, "frames 2"]:
    return np.stack([wrist_excess(rotations, side) for side in range(2)], axis=1)


def wrist_excess(
    rotations: Float[np.ndarray, "frames 22 3 3"], side: int
) -> Float[np.ndarray, " frames"]:
    """Return how far the left (0) or right (1) wrist is beyond its range, radians.

    Args:
        rotations: global R_world_joint.
        side: which wrist.
    """
    name = ("left", "right")[side]
    forearm = rotations[:, joint(f"{name}_elbow")].swapaxes(-1, -2)
    bend = Rotation.from_matrix(forearm @ rotations[:, WRISTS[side]]).as_rotvec()
    low, high = np.array(getattr(JOINT_RANGES, f"{name}_wrist")).T
    return np.maximum(low - bend, bend - high).max(axis=1).clip(min=0.0)


def _skate(human: HumanMotion) -> float:
    """Return the mean horizontal speed of planted ankles and toes, cm/s."""
    feet = in_blocks(lambda joints: joints[:, FEET, :2], human.joints)
    speed = 100 * FPS * np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    planted = human.foot_contact[1:] > 0.5
    return float(speed[planted].mean()) if planted.any() else 0.0


def _lowest_foot(human: HumanMotion) -> Float[np.ndarray, " frames"]:
    """Return the height of the lower toe joint above its floor in the whole motion, metres."""
    lowest = in_blocks(lambda joints: joints[:, FEET[2:], 2].min(axis=1), human.joints)
    return lowest - np.quantile(lowest, SCORE.floor_quantile)


def _jerk(joints: Float[np.ndarray, "frames 24 3"]) -> float:
    if len(joints) < 4:
        return 0.0
    jerk = in_blocks(
        lambda some: np.linalg.norm(np.diff(some, n=3, axis=0), axis=-1), joints, lost=3
    )
    return float(jerk.mean() * FPS**3)


def rank(
    people: Sequence[Person],
    must_hold: Bool[np.ndarray, " frames"],
    *,
    shortest_way: bool = False,
) -> Generation:
    """Return the samples with their scores, the one to show, and what is wrong with it.

    Args:
        people: of the same take.
        must_hold: frames in which somebody must hold the object.
        shortest_way: as `choose` takes it.
    """
    scores = tuple(score(person, must_hold) for person in people)
    chosen = choose([person.human for person in people], scores, shortest_way=shortest_way)
    return Generation(tuple(people), chosen, scores, notes_of(scores[chosen]))


def choose(
    motions: Sequence[HumanMotion],
    scores: Sequence[Mapping[str, float]],
    *,
    shortest_way: bool = False,
) -> int:
    """Return the index of the sample with the lowest sum of two ranks: of its faults and of its distance.

    The sample with the fewest faults is often an outlier, and the most central one may skate. A sample that
    leaps is shown only where all do, and then none that leaps much more than another. None is shown whose
    body is much deeper in the object than another's.

    Args:
        motions: of the same take.
        scores: their faults.
        shortest_way: the length of the pelvis' way is a third rank. Where only the start position is known,
            samples that walk round the object are often wrong about its side.
    """
    central = _ranks(distance_to_others([human.joints for human in motions]).round(6))
    faults = _ranks(np.array([s["total"] for s in scores]))
    if shortest_way:
        faults = faults + _ranks(np.array([_way(human.joints) for human in motions]))
    leaps, inside = (np.array([s[k] for s in scores]) for k in ("leaping", "inside_cm"))
    shown = leaps <= (leaps.min() + SCORE.more_leaping if leaps.all() else 0.0)
    shown &= inside <= inside[shown].min() + 100 * SCORE.extra_depth
    return int(np.argmin(np.where(shown, central + faults, np.inf)))


def order_as_sampled(
    people: Sequence[Person],
    must_hold: Bool[np.ndarray, " frames"],
    *,
    shortest_way: bool = False,
) -> tuple[list[int], tuple[dict[str, float], ...]]:
    """Return in which order people who are not solved are worth solving, and their scores.

    The order is that of the sum of two ranks, as in `choose`, but of the faults that solving hardly mends:
    palms far from their targets, a body in the object, and skating feet.

    Args:
        people: as sampled, of the same take.
        must_hold: frames in which somebody must hold the object.
        shortest_way: as `choose` takes it.
    """
    scores = tuple(score(person, must_hold) for person in people)
    joints = [p.human.joints for p in people]
    central = _ranks(distance_to_others(joints, SCORE.stride).round(6))
    faults = np.array([sum(_WEIGHTS[name] * s[name] for name in _LASTING) for s in scores])
    ranks = central + _ranks(faults)
    if shortest_way:
        ranks = ranks + _ranks(np.array([_way(own) for own in joints]))
    order = np.argsort(ranks, kind="stable")
    return order.tolist(), scores


def is_good(scores: Mapping[str, float], frames: int) -> bool:
    """Return whether a solved sample may be shown without a look at others: not deep, few faults, no leap.

    Somewhere in a long take every sample leaps a little, so a little is allowed after the first chunk.

    Args:
        scores: faults of the sample.
        frames: of the take.
    """
    minutes = max(frames - RECORDED.length, 0) / (60 * FPS)
    deep = scores["inside_cm"] > 100 * SCORE.extra_depth
    leaps = scores["leaping"] > SCORE.leaping_a_minute * minutes
    others = scores["total"] - _WEIGHTS["leaping"] * scores["leaping"]
    return not deep and not leaps and others <= SCORE.most_faults


def _way(joints: Float[np.ndarray, "frames 24 3"]) -> float:
    """Return how far the pelvis travels over the floor, metres."""
    place = in_blocks(lambda some: some[:, 0, :2], joints)
    return float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum())


def _ranks(values: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """Return the rank of each value, from 1; equal ones share the mean of theirs."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return (count.cumsum() - (count - 1) / 2)[place]


def distance_to_others(
    points: Sequence[Float[np.ndarray, "frames joints 3"]], stride: int = 1
) -> Float[np.ndarray, " samples"]:
    """Return each sample's mean distance from the others, the farthest ones left out; metres.

    The few samples that stand on the opposite side by design (`plausibility.py`) do not count.

    Args:
        points: of each sample.
        stride: step between the frames that are compared.
    """

    def apart(
        a: Float[np.ndarray, "frames joints 3"], b: Float[np.ndarray, "frames joints 3"]
    ) -> Float[np.ndarray, "frames joints"]:
        return np.linalg.norm(a - b, axis=-1)

    far = np.zeros((len(points), len(points)))
    for i, k in combinations(range(len(points)), 2):
        both = points[i][::stride], points[k][::stride]
        far[i, k] = far[k, i] = in_blocks(apart, *both).mean()
    near = np.sort(far, axis=1)[:, : len(points) - len(points) // SCORE.outliers_one_in]
    return near.sum(axis=1) / max(1, near.shape[1] - 1)
