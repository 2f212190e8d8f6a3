"""Contact segments per hand, and palms that follow their anchors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from omomo_core.contact.config import ANCHOR
from omomo_core.contact.detour import along, path_between
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.surface import Surface
from omomo_core.motion import HandMotion


@dataclass(frozen=True)
class ContactSpan:
    """A hand on the object from frame `start` to `stop` (exclusive)."""

    hand: int
    """0 is left, 1 right."""
    start: int
    """Negative where it began before the frames at hand."""
    stop: int


@dataclass(frozen=True)
class ContactSegment(ContactSpan):
    """A span in which the hand keeps to one place of the object."""

    anchor: Float[np.ndarray, "3"]
    """Where the palm joint is kept, in the object's frame, metres."""


def follow_anchors(
    segments: Sequence[ContactSegment],
    predicted: HandMotion,
    T_world_object: Float[np.ndarray, "frames 4 4"],
    surface: Surface,
) -> HandMotion:
    """Return palms that are on their anchors within segments and blend into the prediction around them.

    Where a hand's next segment begins before both blends are over, the palm goes from anchor to anchor,
    straight or around what is in between.

    Args:
        segments: of both hands, in any order; those of one hand do not overlap.
        predicted: palms, world, metres.
        T_world_object: the object's pose per frame.
        surface: the object's, in its frame.

    Returns:
        The palms, world, metres, and contact weights in [0, 1]: 1 in segments, 0 away from them.
    """
    palms, contact = predicted.palms.copy(), np.zeros(predicted.contact.shape)
    for hand in range(2):
        held = sorted((s for s in segments if s.hand == hand), key=lambda s: s.start)
        if held:
            place, obeyed, contact[:, hand] = _anchor_path(held, len(palms), surface)
            R, t = T_world_object[:, :3, :3], T_world_object[:, :3, 3]
            goal = np.einsum("fij,fj->fi", R, place) + t
            palms[:, hand] += obeyed[:, None] * (goal - palms[:, hand])
    return HandMotion(palms=palms, contact=contact)


def _anchor_path(
    held: Sequence[ContactSegment], frames: int, surface: Surface
) -> tuple[
    Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"], Float[np.ndarray, " frames"]
]:
    """Return one hand's path of anchors (object frame), how far the palm follows it, and contact weights."""
    t, last = np.arange(frames), len(held) - 1
    starts = np.array([s.start for s in held])
    ends = np.array([s.stop - 1 for s in held])
    anchors = np.stack([s.anchor for s in held])
    begun = np.searchsorted(starts, t, side="right") - 1
    here, there = np.maximum(begun, 0), np.minimum(begun + 1, last)
    pause = starts[there] - ends[here]
    share = min_jerk((t - ends[here]) / np.maximum(pause, 1))
    weight = min_jerk(1 - _frames_to_segment(t, begun, starts, ends) / ANCHOR.blend)
    between = (begun >= 0) & (begun < last) & (pause <= 2 * ANCHOR.blend)
    place = anchors[here] + share[:, None] * (anchors[there] - anchors[here])
    for first in np.unique(here[between]):
        going = between & (here == first)
        path = path_between(anchors[first], anchors[first + 1], surface)
        place[going] = along(path, share[going])
    return place, np.where(between, 1.0, weight), weight


def _frames_to_segment(
    t: Int[np.ndarray, " frames"],
    begun: Int[np.ndarray, " frames"],
    starts: Int[np.ndarray, " segments"],
    ends: Int[np.ndarray, " segments"],
) -> Float[np.ndarray, " frames"]:
    """Return the frames to the nearest segment; 0 or less inside one."""
    since = t - np.append(ends, -np.inf)[begun]
    until = np.append(starts, np.inf)[begun + 1] - t
    return np.minimum(since, until)
