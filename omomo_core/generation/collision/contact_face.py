"""Choice of the contact face: a hand whose arm would go through a thin board holds the board's other face.

Stage 1 predicts palms to some centimetres, and a table's top is thinner: the nearest face may be one that
the arm cannot reach.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.anatomy import build_anatomy
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.contact.config import ANCHOR
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.config import CONTACT_FACE
from omomo_core.generation.collision.root import ELBOWS
from omomo_core.generation.collision.sides import CollisionAvoidance
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.solving.config import BODY_SOLVING
from omomo_core.generation.solving.reach import solve_arms

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

    def better(k: int, old: ContactSegment, new: ContactSegment) -> ContactSegment:
        seen = torch.from_numpy((avoidance.seen >= old.start) & (avoidance.seen < old.stop))
        if old is new or not seen.any():
            return old
        now, then = (float(cost[k, seen, old.hand].mean()) for cost in costs)
        return new if now > CONTACT_FACE.crossed and then < now / 2 else old

    return [tuple(better(k, old, new) for old, new in own) for k, own in enumerate(pairs)]


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
