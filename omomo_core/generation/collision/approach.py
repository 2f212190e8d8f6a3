"""Palms led around what they come to, onto the face that they touch.

The network's palms take a straight path, which often leads through a corner of the object or through the
whole of it. Such a hand takes the shortest clear curve from the last place outside the object.

Stage 1 predicts palms to some centimetres, and a table's top is thinner: the nearest face may be one that
the arm cannot reach.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets, build_anatomy
from omomo_core.contact.contact_config import ANCHOR
from omomo_core.contact.segment import ContactSegment, Path, along, length_of, possible_paths
from omomo_core.generation.collision.avoidance import ELBOWS, CollisionAvoidance
from omomo_core.generation.collision.collision_config import APPROACH, CONTACT_FACE
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.solving.palm_plan import solve_arms
from omomo_core.generation.solving.solving_config import BODY_SOLVING
from omomo_core.geometry.surface import Surface
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


Held = Sequence[tuple[ContactSegment, ...]]


def choose_contact_faces(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    held: Held,
    object_model: ObjectModel,
    targets_for: Callable[[Held], InteractionTargets],
    prefix_frames: int,
) -> list[tuple[ContactSegment, ...]]:
    """Return the segments, each on the face that its arm reaches without going through the object.

    What rises is held from below or round its edge: a flat hand on top of it cannot lift.

    Args:
        body: whose arms.
        root: sampled pelvis, world, metres.
        rotations: sampled global rotations.
        held: segments of each sample.
        object_model: the object.
        targets_for: the solver targets of given segments.
        prefix_frames: segments that begin before this frame keep their faces.
    """
    turned = [tuple(_on_other_face(s, object_model, prefix_frames) for s in own) for own in held]
    pairs = [list(zip(*own, strict=True)) for own in zip(held, turned, strict=True)]
    if all(old is new for own in pairs for old, new in own):
        return list(held)
    targets = targets_for(held)
    free = torch.ones(root.shape[1])
    anatomy = build_anatomy(body, clearance=BODY_SOLVING.clearance)
    avoidance = CollisionAvoidance.of(
        anatomy, object_model.obstacle.field, targets.T_world_object, free
    )
    costs = [_cost(body, root, rotations, avoidance, w) for w in (targets, targets_for(turned))]

    surface, T = object_model.surface, targets.T_world_object

    def better(k: int, old: ContactSegment, new: ContactSegment) -> ContactSegment:
        seen = torch.from_numpy((avoidance.seen >= old.start) & (avoidance.seen < old.stop))
        if old is new or not seen.any():
            return old
        now, then = (
            float(cost[k, seen, old.hand].mean())
            + CONTACT_FACE.on_top * lifts_from_top(s, surface, T)
            for cost, s in zip(costs, (old, new), strict=True)
        )
        return new if now > CONTACT_FACE.crossed and then < now / 2 else old

    return [tuple(better(k, old, new) for old, new in own) for k, own in enumerate(pairs)]


def lifts_from_top(
    segment: ContactSegment, surface: Surface, T_world_object: Float[np.ndarray, "frames 4 4"]
) -> bool:
    """Return whether a hand is on top of a place that rises while it holds that place."""
    T = T_world_object[max(segment.start, 0) : segment.stop]
    height = T[:, 2, :3] @ segment.anchor + T[:, 2, 3]
    if not len(height) or height.max() - height[0] < CONTACT_FACE.rise:
        return False
    out = segment.anchor - surface.points[surface.tree.query(segment.anchor)[1]]
    rising = T[: max(int((height > height[0] + CONTACT_FACE.rise).argmax()), 1), 2, :3]
    return float((rising @ out).mean()) > CONTACT_FACE.top * float(np.linalg.norm(out))


def _on_other_face(
    segment: ContactSegment, object_model: ObjectModel, prefix_frames: int
) -> ContactSegment:
    """Return the segment on the other face of the board, or itself where there is no such face."""
    surface, anchor = object_model.surface, segment.anchor
    out = anchor - surface.points[surface.tree.query(anchor)[1]]
    out = out / max(float(np.linalg.norm(out)), 1e-6)
    ways = surface.points - anchor
    deep = -(ways @ out)
    beside = np.linalg.norm(ways + deep[:, None] * out, axis=-1)
    through = (
        (beside < CONTACT_FACE.beside)
        & (deep > CONTACT_FACE.thinnest * ANCHOR.palm_thickness)
        & (deep < ANCHOR.palm_thickness + CONTACT_FACE.thickest)
    )
    if segment.start < prefix_frames or not through.any():
        return segment
    place = anchor - (deep[through].max() + ANCHOR.palm_thickness) * out
    clear = float(object_model.obstacle.field.at(torch.from_numpy(place).float()))
    return replace(segment, anchor=place) if clear > ANCHOR.palm_thickness / 2 else segment


def _cost(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    avoidance: CollisionAvoidance,
    targets: InteractionTargets,
) -> Float[Tensor, "samples seen 2"]:
    """Return each arm's cost: its penetration of the object, and how far its hand is turned."""
    turned = rotations.clone()
    turned[:, :, WRISTS] = targets.R_world_wrist
    R = solve_arms(body, root, turned, targets)[:, avoidance.seen]
    deep = avoidance.penetration_cost(
        avoidance.spheres(root[:, avoidance.seen], R), avoidance.anatomy.radii
    )
    arms = [
        (avoidance.anatomy.follows[5:, [e, w]] > 0).any(dim=-1)
        for e, w in zip(ELBOWS, WRISTS, strict=True)
    ]
    inside = torch.stack([deep[..., own].sum(dim=-1) for own in arms], dim=-1)
    before, after = rotations[:, :, WRISTS], targets.R_world_wrist
    twist = 1 - (before[..., 1] * after[..., 1]).sum(dim=-1)
    return inside + CONTACT_FACE.twist * twist[:, avoidance.seen]
