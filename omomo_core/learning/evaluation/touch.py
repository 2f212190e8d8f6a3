"""Contact and penetration: which palms touch a clip's object, and how deep a body is inside it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from omomo_core.body.kinematics import full_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import skin
from omomo_core.geometry.distance_field import DistanceField, distance_field
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HumanMotion, ObjectMotion

TOUCH = 0.05
"""Metres from palm joint to the object that count as touching, as in the paper's evaluation."""
DEEP = 0.04
"""Metres inside the object that count as a collision."""
EVERY, EVERY_OF_HANDS = 17, 7
"""One vertex in so many of the body without its hands, and of the hands, is tested."""
POINTS = 20_000
HANDS = (20, 21, *range(22, 52))


@dataclass(frozen=True)
class Touching:
    """A moving object, with what contacts and depths are measured against."""

    motion: ObjectMotion

    @cached_property
    def tree(self) -> KDTree:
        """The vertices, and points between them for meshes of few large faces."""
        mesh = self.motion.mesh
        return KDTree(np.concatenate([mesh.vertices, sample_surface(mesh, POINTS).points]))

    @cached_property
    def vertex_tree(self) -> KDTree:
        """The vertices alone."""
        return KDTree(self.motion.mesh.vertices)

    @cached_property
    def field(self) -> DistanceField:
        """What depths are measured against: the generator's own measure."""
        return distance_field(self.motion.mesh)

    def palms(self, palms: Float[np.ndarray, "frames 2 3"]) -> Bool[np.ndarray, "frames 2"]:
        """Which palms touch, world, metres."""
        return np.asarray(self.tree.query(to_local(self.motion.T_world_object, palms))[0] < TOUCH)

    def at_vertices(self, palms: Float[np.ndarray, "frames 2 3"]) -> Bool[np.ndarray, "frames 2"]:
        """Which palms touch as published: near a vertex, however far apart the vertices are."""
        local = to_local(self.motion.T_world_object, palms)
        return np.asarray(self.vertex_tree.query(local)[0] < TOUCH)

    def penetration(self, human: HumanMotion, body: BodyModel) -> dict[str, float]:
        """How deep the body without its hands, and how deep the hands are inside the object.

        Means over frames of the deepest vertex, cm, and the share of frames in which the body without
        its hands is deeper than 4 cm.
        """
        depth = self._depth(_vertices(human, body))
        hands = self._depth(_vertices(human, body, hands=True))
        return {
            "penetration_cm": 100 * float(depth.mean()),
            "body_collision_share": float((depth > DEEP).mean()),
            "hand_penetration_cm": 100 * float(hands.mean()),
        }

    def collisions(self, vertices: Float[np.ndarray, "frames verts 3"]) -> dict[str, float]:
        """Collision %: share of frames in which some vertex is deeper than 4 cm inside the object.

        The published evaluation compares 0.04 with depths in units of half the object's largest
        side, as its scan has it; ``collision_share_published`` does so for the mesh as given.

        Args:
            vertices: of the whole body, hands too, world, metres.
        """
        depth = self._depth(vertices)
        size = float(np.ptp(self.motion.mesh.vertices, axis=0).max())
        return {
            "collision_share": float((depth > DEEP).mean()),
            "collision_share_published": float((depth > DEEP * size / 2).mean()),
        }

    def _depth(self, vertices: Float[np.ndarray, "frames verts 3"]) -> Float[np.ndarray, " frames"]:
        """Of the deepest vertex in each frame, metres; 0 outside."""
        T, mesh = self.motion.T_world_object, self.motion.mesh
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        depth = np.zeros(len(T))
        for frame in range(len(T)):
            local = to_local(T[frame : frame + 1], vertices[frame : frame + 1])[0]
            near = local[((local > low) & (local < high)).all(axis=1)]
            if len(near):
                depth[frame] = max(0.0, -float(self.field.at(torch.from_numpy(near)).min()))
        return depth


def _vertices(
    human: HumanMotion, body: BodyModel, *, hands: bool = False
) -> Float[np.ndarray, "frames n 3"]:
    """Return some vertices of the body without its hands, or of the hands; world, metres."""
    main = body.skin_joints[torch.arange(len(body.vertices)), body.skin_weights.argmax(dim=1)]
    among = torch.isin(main, torch.tensor(HANDS)) == hands
    kept = torch.nonzero(among)[:: EVERY_OF_HANDS if hands else EVERY, 0]
    few = replace(
        body,
        vertices=body.vertices[kept],
        skin_joints=body.skin_joints[kept],
        skin_weights=body.skin_weights[kept],
    )
    parts = (torch.from_numpy(a).float() for a in (human.root, human.rotations, human.fingers))
    joints, R = full_kinematics(few, *parts)
    return skin(few, joints, R).double().numpy()
