"""BPS during training: nearest surface points looked up in a grid, so that any turn is cheap."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from jaxtyping import Float, Float16, Int
from torch import Tensor

from omomo_core.geometry.bps import BASIS_RADIUS, basis
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMesh
from omomo_core.stages.windows import ShapeLookup

KEPT = 512
"""Surface points kept of each object: one for every 5 cm of a table."""
CELLS = 24
"""Cells per axis of the cube around the basis ball: 8 cm; a lookup is off by under half of that."""


class ShapeGrids:
    """For each object, the surface point nearest to the middle of every cell of a cube around it, and
    some points of its surface.
    """

    def __init__(self, meshes: Sequence[ObjectMesh]) -> None:
        cells = _cells()
        self.nearest = torch.zeros(len(meshes) + 1, len(cells), 3, dtype=torch.float16)
        self.points = torch.zeros(len(meshes) + 1, KEPT, 3, dtype=torch.float16)
        self.centres: Float[np.ndarray, "objects 3"] = np.zeros((len(meshes) + 1, 3))
        # scipy's search lets go of the interpreter: threads share the work and the memory.
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            grids = pool.map(lambda mesh: _grid(mesh, cells), meshes)
            for k, (nearest, points, centre) in enumerate(grids, start=1):
                self.nearest[k], self.points[k] = (
                    torch.from_numpy(nearest),
                    torch.from_numpy(points),
                )
                self.centres[k] = centre

    def surface(self, index: Int[Tensor, " b"], mirrored: Tensor) -> Float[Tensor, "b points 3"]:
        """Points of the objects `index`, from their centres; where `mirrored` x is flipped."""
        return self.points[index].float() * _flip(mirrored)[:, None]

    def lookup(self, index: Int[Tensor, " b"], mirrored: Tensor, count: int) -> ShapeLookup:
        """Encoder for the objects `index` (0 = none); where `mirrored` the object's x is flipped."""
        points = torch.from_numpy(basis(count)).float()
        flip = _flip(mirrored)

        def shape(R_canonical_object: Float[Tensor, "b tokens 3 3"]) -> Tensor:
            query = points @ R_canonical_object * flip[:, None, None]
            cell = ((query + BASIS_RADIUS) * (CELLS / (2 * BASIS_RADIUS))).long()
            cell = cell.clamp(0, CELLS - 1)
            flat = (cell[..., 0] * CELLS + cell[..., 1]) * CELLS + cell[..., 2]
            found = self.nearest[index[:, None, None], flat].float()
            offset = (found - query) * flip[:, None, None]
            return offset @ R_canonical_object.transpose(-1, -2)

        return shape


def _flip(mirrored: Tensor) -> Float[Tensor, "b 3"]:
    flip = torch.ones(len(mirrored), 3)
    flip[mirrored, 0] = -1
    return flip


def _cells() -> Float[np.ndarray, "cells 3"]:
    """Middles of the cells, metres from the object's centre."""
    middle = (np.arange(CELLS) + 0.5) / CELLS * 2 * BASIS_RADIUS - BASIS_RADIUS
    return np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), -1).reshape(-1, 3)


def _grid(
    mesh: ObjectMesh, cells: Float[np.ndarray, "cells 3"]
) -> tuple[Float16[np.ndarray, "cells 3"], Float[np.ndarray, "points 3"], Float[np.ndarray, "3"]]:
    """Nearest surface point to each cell, some surface points, and the centre all are measured from."""
    surface = sample_surface(mesh)
    # No point of the basis ball lies in the corners of the cube.
    asked = np.linalg.norm(cells, axis=-1) < BASIS_RADIUS * (1 + np.sqrt(3) / CELLS)
    nearest = np.zeros((len(cells), 3), np.float16)
    _, index = surface.tree.query(cells[asked] + surface.centre)
    nearest[asked] = surface.points[index] - surface.centre
    return nearest, surface.points[:KEPT] - surface.centre, surface.centre
