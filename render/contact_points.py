"""Where hands hold the object: green patches on its surface, for as long as they do."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from omomo_core.contact.segment import ContactSegment
from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.motion import ObjectMotion
from render.actors import Actor
from render.props import CONTACT_COLOR, ball
from render.scene import Drawable

_RADIUS, _THICKNESS = 0.042, 0.004
"""Of a patch, metres."""


def held_places(segments: Sequence[ContactSegment], moved: ObjectMotion) -> list[Actor]:
    """One patch per hand that holds anything, on the surface where it is nearest to the palm.

    Args:
        segments: who holds where and when.
        moved: the object, with faces.
    """
    hands = sorted({segment.hand for segment in segments})
    if not hands:
        return []
    surface = sample_surface(moved.mesh)
    return [_patches([s for s in segments if s.hand == hand], moved, surface) for hand in hands]


def _patches(segments: Sequence[ContactSegment], moved: ObjectMotion, surface: Surface) -> Actor:
    """The patches of one hand: one that goes from place to place, and hides between them."""
    vertices, faces = ball(_RADIUS)
    flat = vertices * [1.0, 1.0, _THICKNESS / _RADIUS]
    T_world_patch = moved.T_world_object.copy()
    visible = np.zeros(len(T_world_patch), bool)
    for segment in segments:
        held = slice(max(segment.start, 0), segment.stop)
        T_world_patch[held] = moved.T_world_object[held] @ _on_surface(segment.anchor, surface)
        visible[held] = True
    name = f"{('left', 'right')[segments[0].hand]} hold"
    drawable = Drawable(name, flat, faces, CONTACT_COLOR, casts_shadow=False)
    return Actor(drawable, T_world=T_world_patch, visible=visible)


def _on_surface(anchor: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "4 4"]:
    """Pose in the object's frame at the nearest point of the surface, z along its normal."""
    nearest = int(surface.tree.query(anchor)[1])
    z = surface.normals[nearest]
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = surface.points[nearest]
    return T
