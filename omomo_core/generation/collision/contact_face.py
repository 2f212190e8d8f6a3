"""A hand whose arm would go through a thin board holds the board's other face.

Stage 1 knows palms to some centimetres, and a table's top is thinner: the nearest face may be the one that
the arm cannot get to.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.anatomy import anatomy
from omomo_core.contact.anchor import PALM_THICKNESS
from omomo_core.contact.segment import Segment
from omomo_core.generation.collision.root import ELBOWS
from omomo_core.generation.collision.sides import Around
from omomo_core.generation.object_clip import Thing
from omomo_core.generation.solving.bodies import CLEARANCE
from omomo_core.generation.solving.reach import arms_that_hold
from omomo_core.generation.wish import Wish

THICKEST, BESIDE = 0.08, 0.03
"""Metres: a board is no thicker, and its other face is looked for so near the line through it."""
CROSSED = 0.5
"""Cost per frame (as of `side.INSIDE`) under which an arm only brushes the board."""
TWIST = 2.0
"""Cost per frame of a hand whose back, not palm, is toward what it holds."""

Held = Sequence[tuple[Segment, ...]]


def other_faces(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    held: Held,
    thing: Thing,
    wished: Callable[[Held], Wish],
    decided: int,
) -> list[tuple[Segment, ...]]:
    """The segments, those on other faces whose arms get there without going through the object.

    Args:
        body: whose arms.
        root: sampled pelvis, world, metres.
        rotations: sampled global rotations.
        held: segments of each sample.
        thing: the object.
        wished: what bodies are solved for, given the segments.
        decided: segments that begin before this frame keep their faces.
    """
    turned = [tuple(_turned_over(s, thing, decided) for s in own) for own in held]
    pairs = [list(zip(*own, strict=True)) for own in zip(held, turned, strict=True)]
    if all(old is new for own in pairs for old, new in own):
        return list(held)
    wish = wished(held)
    free = torch.ones(root.shape[1])
    flesh = anatomy(body, clearance=CLEARANCE)
    around = Around.of(flesh, thing.barrier.field, wish.T_world_object, free)
    costs = [_cost(body, root, rotations, around, w) for w in (wish, wished(turned))]

    def better(k: int, old: Segment, new: Segment) -> Segment:
        seen = torch.from_numpy((around.seen >= old.start) & (around.seen < old.stop))
        if old is new or not seen.any():
            return old
        now, then = (float(cost[k, seen, old.hand].mean()) for cost in costs)
        return new if now > CROSSED and then < now / 2 else old

    return [tuple(better(k, old, new) for old, new in own) for k, own in enumerate(pairs)]


def _turned_over(segment: Segment, thing: Thing, decided: int) -> Segment:
    """The same hold on the other face of the board, or itself where there is no such face."""
    surface, anchor = thing.surface, segment.anchor
    out = anchor - surface.points[surface.tree.query(anchor)[1]]
    out = out / max(float(np.linalg.norm(out)), 1e-6)
    ways = surface.points - anchor
    deep = -(ways @ out)
    beside = np.linalg.norm(ways + deep[:, None] * out, axis=-1)
    through = (
        (beside < BESIDE) & (deep > 1.25 * PALM_THICKNESS) & (deep < PALM_THICKNESS + THICKEST)
    )
    if segment.start < decided or not through.any():
        return segment
    place = anchor - (deep[through].max() + PALM_THICKNESS) * out
    clear = float(thing.barrier.field.at(torch.from_numpy(place).float()))
    return replace(segment, anchor=place) if clear > PALM_THICKNESS / 2 else segment


def _cost(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    around: Around,
    wish: Wish,
) -> Float[Tensor, "samples seen 2"]:
    """Of each arm that holds: what is inside the object, and how far its hand is turned."""
    turned = rotations.clone()
    turned[:, :, WRISTS] = wish.R_world_wrist
    R = arms_that_hold(body, root, turned, wish)[:, around.seen]
    deep = around.inside(around.balls(root[:, around.seen], R), around.flesh.radii)
    arms = [
        (around.flesh.follows[5:, [e, w]] > 0).any(dim=-1)
        for e, w in zip(ELBOWS, WRISTS, strict=True)
    ]
    inside = torch.stack([deep[..., own].sum(dim=-1) for own in arms], dim=-1)
    before, after = rotations[:, :, WRISTS], wish.R_world_wrist
    twist = 1 - (before[..., 1] * after[..., 1]).sum(dim=-1)
    return inside + TWIST * twist[:, around.seen]
