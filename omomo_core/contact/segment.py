"""Contact segments: when a hand holds, where its anchor is, and how palms get around corners to it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from omomo_core.contact.contact_config import ANCHOR, DETOUR
from omomo_core.geometry.runs import min_jerk
from omomo_core.geometry.surface import Surface
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion

Path = Float[np.ndarray, "points 3"]
"""Points in the object's frame, metres, from the first place to the last."""
Paths = Float[np.ndarray, "paths points 3"]


def path_between(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface) -> Path:
    """Return the straight path from `a` to `b`, or the shortest clear curve where the object is between them.

    Where no curve is clear, the path is straight.

    Args:
        a: where the palm joint leaves, in the object's frame, metres.
        b: where it arrives.
        surface: the object's.
    """
    paths = possible_paths(a, b, surface)
    near = surface.tree.query(paths[:, 1:-1], distance_upper_bound=ANCHOR.palm_thickness)[0]
    least = ANCHOR.least_clearance * ANCHOR.palm_thickness
    # Near its ends a path is as close to the surface as the places themselves.
    ends = np.linalg.norm(paths[:, 1:-1, None] - np.stack([a, b]), axis=-1).min(axis=-1)
    clear = ((near >= least) | (ends < ANCHOR.palm_thickness)).all(axis=1)
    return paths[int(clear.argmax())] if clear.any() else _straight(a, b)


def possible_paths(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface) -> Paths:
    """Return the straight path and curves from `a` to `b`, shortest first; no curves where `a` is `b`.

    They are cubic Bézier curves that leave and arrive along the surface's normal and bulge to one of several
    sides. The arguments are those of `path_between`.
    """
    if np.linalg.norm(b - a) < 1e-6:
        return _straight(a, b)[None]
    lift, bulge, side = _choices()
    u, v = _across(b - a)
    out = bulge[:, None] * (np.cos(side)[:, None] * u + np.sin(side)[:, None] * v)
    t = np.linspace(0, 1, DETOUR.points)[:, None]
    first, last = (p + lift[:, None] * _off(p, surface) + out for p in (a, b))
    curves = (
        (1 - t) ** 3 * a
        + 3 * t * (1 - t) ** 2 * first[:, None]
        + 3 * t**2 * (1 - t) * last[:, None]
        + t**3 * b
    )
    paths = np.concatenate([_straight(a, b)[None], curves])
    return paths[np.argsort(length_of(paths), kind="stable")]


def length_of(paths: Float[np.ndarray, "*b points 3"]) -> Float[np.ndarray, "*b"]:
    """Return the length of each path, metres."""
    return np.asarray(np.linalg.norm(np.diff(paths, axis=-2), axis=-1).sum(axis=-1))


def along(path: Path, share: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 3"]:
    """Return the points at these shares of a path's length, from 0 to 1."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    gone = np.append(0.0, np.cumsum(steps)) / max(float(steps.sum()), 1e-9)
    return np.stack([np.interp(share, gone, x) for x in path.T], axis=1)


def _straight(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Path:
    return a + np.linspace(0, 1, DETOUR.points)[:, None] * (b - a)


@lru_cache(maxsize=1)
def _choices() -> tuple[Float[np.ndarray, " curves"], ...]:
    """Return lift, bulge and side of each curve."""
    sides = np.linspace(0, 2 * np.pi, DETOUR.sides, endpoint=False)
    choices = np.meshgrid(DETOUR.lifts, DETOUR.bulges, sides, indexing="ij")
    return tuple(choice.ravel() for choice in choices)


def _across(line: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return two unit vectors at right angles to a line and to each other."""
    ahead = line / np.linalg.norm(line)
    u = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(ahead, u)


def _off(place: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """Return the direction from the nearest point of the surface to a place."""
    off = place - surface.points[surface.tree.query(place)[1]]
    return off / max(float(np.linalg.norm(off)), 1e-9)


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
    """Place of the palm joint in the object's frame, metres."""


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


def anchor_spans(
    spans: Iterable[ContactSpan],
    predicted: HandMotion,
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
) -> tuple[ContactSegment, ...]:
    """Return each span as a segment whose anchor is the surface point nearest to the predicted palm.

    Args:
        spans: those that are segments already keep their anchors; the others overlap the frames.
        predicted: palms, world, metres.
        surface: the object's surface in its own frame.
        T_world_object: the object's pose per frame.
    """
    palms = to_local(T_world_object, predicted.palms)

    def fix(span: ContactSpan) -> ContactSegment:
        if isinstance(span, ContactSegment):
            return span
        median = np.median(palms[max(span.start, 0) : span.stop, span.hand], axis=0)
        return ContactSegment(
            span.hand, span.start, span.stop, _project_to_surface(median, surface)
        )

    return tuple(fix(span) for span in spans)


def _project_to_surface(palm: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """Return the palm joint at its thickness above the nearest point of the surface, object frame, metres."""
    _, nearest = surface.tree.query(palm)
    point, normal = surface.points[nearest], surface.normals[nearest]
    # Scans wind some faces the wrong way round. A palm with nothing of the object beyond it is
    # outside, whatever the normal says; amid the object's parts the normal is all there is.
    above = (surface.points - palm) @ -normal
    if (point - palm) @ normal > 0 and above.max() < 0:
        normal = -normal
    return point + ANCHOR.palm_thickness * normal
