"""BPS during training: nearest surface points looked up in a grid, so that any turn is cheap."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.geometry.bps import BASIS_RADIUS, basis
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMesh
from omomo_core.windows import ShapeLookup

CELLS = 24
"""Cells per axis of the cube around the basis ball: 8 cm; a lookup is off by under half of that."""


class ShapeGrids:
    """For each object, the surface point nearest to the middle of every cell of a cube around it."""

    def __init__(self, meshes: Sequence[ObjectMesh]) -> None:
        middle = (np.arange(CELLS) + 0.5) / CELLS * 2 * BASIS_RADIUS - BASIS_RADIUS
        cells = np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), -1).reshape(-1, 3)
        nearest, centres = [np.zeros((len(cells), 3), np.float16)], [np.zeros(3)]
        for mesh in meshes:
            surface = sample_surface(mesh)
            _, index = surface.tree.query(cells + surface.centre)
            nearest.append((surface.points[index] - surface.centre).astype(np.float16))
            centres.append(surface.centre)
        self.nearest = torch.from_numpy(np.stack(nearest))
        self.centres: Float[np.ndarray, "objects 3"] = np.stack(centres)

    def lookup(self, index: Int[Tensor, " b"], mirrored: Tensor, count: int) -> ShapeLookup:
        """Encoder for the objects `index` (0 = none); where `mirrored` the object's x is flipped."""
        points = torch.from_numpy(basis(count)).float()
        flip = torch.ones(len(index), 3)
        flip[mirrored, 0] = -1

        def shape(R_canonical_object: Float[Tensor, "b tokens 3 3"]) -> Tensor:
            query = points @ R_canonical_object * flip[:, None, None]
            cell = ((query + BASIS_RADIUS) * (CELLS / (2 * BASIS_RADIUS))).long()
            cell = cell.clamp(0, CELLS - 1)
            flat = (cell[..., 0] * CELLS + cell[..., 1]) * CELLS + cell[..., 2]
            found = self.nearest[index[:, None, None], flat].float()
            offset = (found - query) * flip[:, None, None]
            return offset @ R_canonical_object.transpose(-1, -2)

        return shape
