"""Paths of hands that approach what they hold, and that leave it: around the object, not through it.

The network's palms take a straight path, which often leads through a corner of the object or through the
whole of it. Such a hand takes the shortest clear curve from the last place outside the object.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float, Int

from omomo_core.contact.config import ANCHOR
from omomo_core.contact.detour import Path, along, length_of, possible_paths
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.config import APPROACH
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion


def lead_around(
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    clip: ObjectClip,
    object_model: ObjectModel,
    first: int = 0,
) -> list[HandMotion]:
    """Return palms of each sample that approach and leave outside the object; clear paths stay as they are.

    Args:
        hands: palms that follow their anchors (`follow_anchors`), world, metres.
        segments: what they hold and when.
        clip: where the object is.
        object_model: the object.
        first: frames before this one are fixed.
    """
    T = clip.take.motion.T_world_object
    return [
        _led(hand, held, T, object_model, first) for hand, held in zip(hands, segments, strict=True)
    ]


def _led(
    hand: HandMotion,
    held: tuple[ContactSegment, ...],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    object_model: ObjectModel,
    first: int,
) -> HandMotion:
    local, palms = to_local(T_world_object, hand.palms), hand.palms.copy()
    for side in range(2):
        for way in _ways([s for s in held if s.hand == side], first, len(palms)):
            around = _around(local[way, side], T_world_object[way], object_model)
            at = way[len(way) - len(around) :]
            R, t = T_world_object[at, :3, :3], T_world_object[at, :3, 3]
            palms[at, side] = np.einsum("fij,fj->fi", R, around) + t
    return replace(hand, palms=palms)


def _ways(
    held: Sequence[ContactSegment], first: int, frames: int
) -> Iterator[Int[np.ndarray, " way"]]:
    """Yield the frames in which one hand approaches or leaves each contact; the last one is in contact."""
    held = sorted(held, key=lambda s: s.start)
    long = 2 * APPROACH.longest
    for k, s in enumerate(held):
        before = s.start - held[k - 1].stop + 1 if k else long
        after = held[k + 1].start - s.stop + 1 if k + 1 < len(held) else long
        came = max(first, s.start - _time(before))
        gone = min(frames - 1, s.stop - 1 + _time(after))
        if came < s.start < frames:
            yield np.arange(came, s.start + 1)
        if first <= s.stop - 1 < gone:
            yield np.arange(gone, s.stop - 2, -1)


def _time(pause: int) -> int:
    """Return the longest time of one approach, frames: at most half of the pause between two contacts."""
    # Between contacts that are nearer than that, hands go from anchor to anchor anyway.
    return 0 if pause <= 2 * ANCHOR.blend else min(APPROACH.longest, pause // 2)


def _around(
    way: Float[np.ndarray, "way 3"],
    T_world_object: Float[np.ndarray, "way 4 4"],
    object_model: ObjectModel,
) -> Float[np.ndarray, "last 3"]:
    """Return new places for the last part of a way that goes through the object.

    There are none where the way is clear, and where no clear path is found.

    Args:
        way: the palm joint, object's frame, metres; its last place is the anchor.
        T_world_object: the object's pose in the same frames.
        object_model: the object.
    """
    frames = np.arange(len(way))
    fine = np.linspace(0, len(way) - 1, APPROACH.finer * (len(way) - 1) + 1)
    clear = _clearance(np.stack([np.interp(fine, frames, x) for x in way.T], axis=1), object_model)
    inside = np.flatnonzero(clear < -APPROACH.depth)
    before = clear[: inside[0] if len(inside) else 0 : APPROACH.finer]
    outside = np.flatnonzero(before > APPROACH.clearance)
    if not len(outside):
        return way[:0]
    begin = int(outside[-1])
    path = _path(way, begin, T_world_object, object_model)
    latest = len(way) - 1 - int(np.ceil(length_of(path) / APPROACH.pace))
    if begin > latest:
        begin = int(outside[outside <= max(latest, outside[0])][-1])
        path = _path(way, begin, T_world_object, object_model)
    if not len(path):
        return path
    # A hand comes at its speed, and stops.
    u = np.linspace(0, 1, len(way) - begin)
    return along(path, (3 * u - u**3) / 2)


def _path(
    way: Float[np.ndarray, "way 3"],
    begin: int,
    T_world_object: Float[np.ndarray, "way 4 4"],
    object_model: ObjectModel,
) -> Path:
    """Return the shortest path from a place of the way to its end that is clear of object and floor."""
    paths = possible_paths(way[begin], way[-1], object_model.surface)
    T = T_world_object[(begin + len(way)) // 2]
    height = paths @ T[2, :3] + T[2, 3]
    # A hand that holds the lower edge of something is that low itself.
    lowest = np.minimum(ANCHOR.palm_thickness, height[:, [0, -1]].min(axis=1, keepdims=True))
    paths = paths[(height > lowest - APPROACH.clearance).all(axis=1)]
    near = np.linalg.norm(paths[:, :, None] - way[[begin, -1]], axis=-1).min(axis=-1)
    clear = _clearance(paths, object_model)
    for least in (ANCHOR.least_clearance * ANCHOR.palm_thickness, 0.0):
        # Near its ends a path is as close to the surface as the places themselves.
        fits = (clear > np.where(near < ANCHOR.palm_thickness, 0.0, least)).all(axis=1)
        if fits.any():
            return paths[int(fits.argmax())]
    return way[:0]


def _clearance(
    places: Float[np.ndarray, "*some 3"], object_model: ObjectModel
) -> Float[np.ndarray, " *some"]:
    return object_model.obstacle.field.at(torch.from_numpy(places).float()).numpy()
