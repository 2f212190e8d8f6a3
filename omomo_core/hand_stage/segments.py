"""Contact that comes and goes: segments per hand, each with one anchor on the object's surface."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.geometry.surface import Surface
from omomo_core.geometry.transforms import apply, inverse
from omomo_core.motion import HandMotion

ON, OFF = 0.6, 0.35
"""A contact begins above ON and lasts until the probability falls below OFF."""
SHORTEST = 6
"""Frames: shorter segments are dropped, shorter pauses bridged."""
BLEND = 8
"""Frames over which a palm goes from the prediction onto its anchor and back."""
PALM_THICKNESS = 0.02
"""Metres from the palm joint (inside the hand) to the skin that touches."""


@dataclass(frozen=True)
class Segment:
    """A hand holding one place of the object from frame `start` to `stop` (exclusive)."""

    hand: int
    start: int
    stop: int
    anchor: Float[np.ndarray, "3"]
    """Where the palm joint is kept, in the object's frame, metres."""


def hold(
    predicted: HandMotion,
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
    moving: Bool[np.ndarray, " frames"],
) -> tuple[HandMotion, list[Segment]]:
    """Turn predicted contact into segments and put the palms on their anchors.

    Args:
        predicted: palms and contact probabilities of stage 1, world, metres.
        surface: the object's surface in its own frame.
        T_world_object: the object's pose per frame.
        moving: frames in which the object cannot move by itself: somebody holds it.

    Returns:
        Palms that follow their anchors while in contact and blend into the prediction around it,
        contact weights in [0, 1], and the segments.
    """
    T_object_world = inverse(T_world_object)
    local = np.einsum("fij,fhj->fhi", T_object_world[:, :3, :3], predicted.palms)
    local += T_object_world[:, None, :3, 3]
    probability = _somebody_holds(predicted.contact, moving)
    palms, weight = predicted.palms.copy(), np.zeros(predicted.contact.shape)
    segments: list[Segment] = []
    for hand in range(2):
        for start, stop in _runs(probability[:, hand]):
            anchor = _anchor(local[start:stop, hand], surface)
            segments.append(Segment(hand, start, stop, anchor))
            w = _ramp(len(palms), start, stop)
            held = apply(T_world_object, anchor[None])[:, 0]
            palms[:, hand] += w[:, None] * (held - palms[:, hand])
            weight[:, hand] = np.maximum(weight[:, hand], w)
    return HandMotion(palms=palms, contact=weight), segments


def _somebody_holds(
    contact: Float[np.ndarray, "frames 2"], moving: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 2"]:
    """While the object moves and no hand is likely to hold it, the likelier hand does."""
    best = contact.max(axis=1, keepdims=True)
    lift = np.where(moving[:, None] & (best < ON), ON / np.maximum(best, 1e-6), 1.0)
    return np.minimum(contact * lift, 1.0)


def _runs(probability: Float[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """Hysteresis, then short pauses bridged and short contacts dropped."""
    runs: list[tuple[int, int]] = []
    start: int | None = None
    for frame, p in enumerate(probability):
        if start is None and p >= ON:
            start = frame
        elif start is not None and p < OFF:
            runs.append((start, frame))
            start = None
    if start is not None:
        runs.append((start, len(probability)))
    bridged: list[tuple[int, int]] = []
    for run in runs:
        if bridged and run[0] - bridged[-1][1] < SHORTEST:
            bridged[-1] = (bridged[-1][0], run[1])
        else:
            bridged.append(run)
    return [run for run in bridged if run[1] - run[0] >= SHORTEST]


def _anchor(local: Float[np.ndarray, "frames 3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """The segment's median palm, moved to a palm's thickness above the nearest surface."""
    middle = np.median(local, axis=0)
    _, nearest = surface.tree.query(middle)
    return surface.points[nearest] + PALM_THICKNESS * surface.normals[nearest]


def _ramp(frames: int, start: int, stop: int) -> Float[np.ndarray, " frames"]:
    """1 inside the segment, a smooth step to 0 over BLEND frames outside it."""
    t = np.arange(frames)
    outside = np.maximum(np.maximum(start - t, t - (stop - 1)), 0)
    x = np.clip(1 - outside / BLEND, 0, 1)
    return x * x * (3 - 2 * x)
