"""An object and a clip of its motion at two sizes: as it is, and scaled to the networks' stature."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.contact.contact_config import ANCHOR
from omomo_core.contact.segment import ContactSegment
from omomo_core.contact.static_stability import (
    TippingLever,
    must_be_held,
    tipping_lever,
    touchable_range,
)
from omomo_core.geometry.distance_field import distance_field
from omomo_core.geometry.object_features import ObjectFeatures, object_features
from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.motion import ObjectMesh, ObjectMotion


@dataclass(frozen=True)
class ObjectClip:
    """A clip of an object's motion, in the world and as the networks' person would see it.

    That person is of another stature and without shoes: the scene is scaled, and lower by the soles.
    """

    take: ObjectFeatures
    """In metres."""
    trained: ObjectFeatures
    """Lower by `shoe_sole`, then every length times `scale`."""
    scale: float
    must_hold: Bool[np.ndarray, " frames"]
    """Frames in which somebody must hold the object."""
    shoe_sole: float = 0.0
    """How thick the soles of the person's shoes are, metres."""

    def above_soles(self, world: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3"]:
        """Return points of the world with heights measured from the top of the soles; not scaled."""
        return world - [0.0, 0.0, self.shoe_sole]

    def in_world(self, trained: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3"]:
        """Return points in the world, metres, given as in `trained`: scaled, and lower by the soles."""
        return trained / self.scale + [0.0, 0.0, self.shoe_sole]

    @cached_property
    def touchable_range(self) -> tuple[int, int]:
        """First frame, and the one after the last, in which hands may be on the object."""
        return touchable_range(self.take, self.must_hold)

    @cached_property
    def lever(self) -> TippingLever | None:
        """The lever that holds the object up while it stands on an edge, at the trained size."""
        return tipping_lever(self.trained, self.must_hold)


@dataclass(frozen=True)
class ObjectModel:
    """An object with its surface and its distance field, computed once for a take of any length."""

    mesh: ObjectMesh
    scale: float
    """Stature of the networks' body over that of the person."""
    shoe_sole: float = 0.0
    """How thick the soles of the person's shoes are, metres."""

    @cached_property
    def surface(self) -> Surface:
        """Points on the object, its frame, metres."""
        return sample_surface(self.mesh)

    @cached_property
    def obstacle(self) -> MeshObstacle:
        """The object as an obstacle: the signed distance to its surface, its frame, metres."""
        return MeshObstacle(
            distance_field(self.mesh), torch.from_numpy(self.surface.centre).float()
        )

    @cached_property
    def _palm_places(self) -> KDTree | None:
        """Places of palm joints above the surface that are not within the object; None without any."""
        points = [
            self.surface.points + sign * ANCHOR.palm_thickness * self.surface.normals
            for sign in (1, -1)
        ]
        every = np.concatenate(points)
        clear = self.obstacle.field.at(torch.from_numpy(every).float()).numpy()
        places = every[clear > ANCHOR.least_clearance * ANCHOR.palm_thickness]
        return KDTree(places) if len(places) else None

    def with_anchor_outside(self, segment: ContactSegment) -> ContactSegment:
        """Return the contact, its anchor moved to the nearest place outside if it is within the object."""
        clear = float(self.obstacle.field.at(torch.from_numpy(segment.anchor).float()))
        if clear > ANCHOR.least_clearance * ANCHOR.palm_thickness or self._palm_places is None:
            return segment
        _, nearest = self._palm_places.query(segment.anchor)
        return replace(segment, anchor=np.array(self._palm_places.data[nearest]))

    @cached_property
    def _scaled(self) -> tuple[ObjectMesh, Surface]:
        mesh = replace(self.mesh, vertices=self.mesh.vertices * self.scale)
        return mesh, self.surface.scaled(self.scale)

    def clip(self, T_world_object: Float[np.ndarray, "frames 4 4"]) -> ObjectClip:
        """Return a clip of the object's motion, given its poses in the world, metres."""
        valid = np.ones(len(T_world_object), bool)
        take = object_features(ObjectMotion(self.mesh, T_world_object, valid), self.surface)
        if self.scale == 1.0 and self.shoe_sole == 0.0:
            return ObjectClip(take, take, 1.0, must_be_held(take))
        T = T_world_object.copy()
        T[:, 2, 3] -= self.shoe_sole
        T[:, :3, 3] *= self.scale
        mesh, surface = self._scaled
        trained = object_features(ObjectMotion(mesh, T, valid), surface)
        return ObjectClip(take, trained, self.scale, must_be_held(take), self.shoe_sole)
