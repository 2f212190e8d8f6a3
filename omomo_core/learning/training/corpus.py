"""Clips in memory as flat tensors, random windows of them, and their objects' shapes."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float16, Int
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.geometry.object_features import BASIS_RADIUS, basis
from omomo_core.geometry.rotations import rotmat_to_6d
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import angular_velocity, velocity
from omomo_core.learning.recordings.clips import SYNTHESIS, Clip
from omomo_core.motion import FPS, ObjectMesh
from omomo_core.stages.body_capture import reference_path
from omomo_core.stages.stage import WINDOW, HumanWindows, ObjectWindows, ShapeLookup

KEPT = 512
"""Surface points kept of each object: one for every 5 cm of a table."""
CELLS = 24
"""Cells per axis of the cube around the basis ball: 8 cm; a lookup is off by under half of that."""


class ShapeGrids:
    """Nearest surface points of each object to the middle of every cell of a cube around it, and
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


RECORDED_CONTACT = 6
"""How often a recorded frame with an object is drawn for each of the synthesis: they are few, and true."""
_APART = 30
"""Frames between the starts of the windows whose pelvis heights are ranked."""
SWAP = (0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22)
"""The joint on the other side of the body, for the 24 joints of the model."""

_STEP = 0.08
"""Metres of palm height that count as equally low."""
_BINS = 20
_QUANTILES = 65
_FEWEST = 200
"""Windows in a bin, at least; with less, its neighbours' count too."""


@dataclass(frozen=True)
class Windows:
    """A training batch."""

    object: ObjectWindows
    human: HumanWindows
    surface: Float[Tensor, "b points 3"]
    """Points on each window's object, in its own axes, from its centre; meaningless without an object."""


class Corpus:
    """All clips, joined along frames; `draw` returns random windows of them."""

    def __init__(self, clips: Sequence[Clip], body: BodyModel, synthesis_share: float) -> None:
        self.lengths = torch.tensor([len(clip.root) for clip in clips])
        self.starts = torch.cumsum(self.lengths, 0) - self.lengths
        has_object = torch.tensor([c.object_motion is not None for c in clips])
        self.grids = ShapeGrids([c.object_motion.mesh for c in clips if c.object_motion])
        self.object_of = torch.where(has_object, torch.cumsum(has_object, 0), 0)
        self.rows: dict[str, Tensor] = {}
        """Every frame of all clips, joined, by the name of the feature."""
        total = int(self.lengths.sum())
        for clip, first, index in zip(clips, self.starts, self.object_of, strict=True):
            for key, rows in _rows(clip, body, self.grids.centres[int(index)]).items():
                # One buffer from the start: joining parts at the end would hold everything twice.
                if key not in self.rows:
                    self.rows[key] = torch.empty(total, *rows.shape[1:])
                self.rows[key][first : first + len(rows)] = rows
        recorded = torch.tensor([c.source != SYNTHESIS for c in clips])
        lengths = self.lengths * (1 + (RECORDED_CONTACT - 1) * (has_object & recorded))
        self.weights = _weights(lengths.float(), has_object, synthesis_share)
        ranked = self.object_of > 0 if has_object.any() else ~has_object
        joints = self.rows["joints"]
        # The minimum over the palms comes first: the joints of all windows at once need too much memory.
        low = torch.stack([joints[:, 22:, 2].amin(dim=1), joints[:, 0, 2]], dim=1)
        self.uprightness = Uprightness(*low[self._windows(ranked)].amin(dim=1).T)

    def _windows(self, ranked: Bool[Tensor, " clips"]) -> Int[Tensor, "windows frames"]:
        """Return the frames of one window per second of the clips in the mask."""
        index = [
            start + first + torch.arange(WINDOW).clamp(max=length - first - 1)
            for start, length in zip(
                self.starts[ranked].tolist(), self.lengths[ranked].tolist(), strict=True
            )
            for first in range(0, max(length - WINDOW, 0) + 1, _APART)
        ]
        return torch.stack(index)

    def draw(self, count: int, basis_points: int, *, objects_only: bool = False) -> Windows:
        """Random windows, half of them mirrored left to right; short clips are padded."""
        weights = self.weights * (self.object_of > 0) if objects_only else self.weights
        clip = torch.multinomial(weights, count, replacement=True)
        room = (self.lengths[clip] - WINDOW).clamp(min=0)
        first = (torch.rand(count) * (room + 1)).long()
        offset = first[:, None] + torch.arange(WINDOW)
        valid = offset < self.lengths[clip][:, None]
        frame = self.starts[clip][:, None] + offset.minimum(self.lengths[clip][:, None] - 1)
        mirrored = torch.rand(count) < 0.5
        r = {k: v[frame] for k, v in self.rows.items()}
        r = {k: torch.where(_like(mirrored, v), _mirror(k, v), v) for k, v in r.items()}
        lookup = self.grids.lookup(self.object_of[clip], mirrored, basis_points)
        moved = ("centre", "lowest", "velocity", "spin", "R_world_object")
        person = ("joints", "rotations_6d", "hand_contact", "foot_contact", "reference")
        return Windows(
            ObjectWindows(
                **{k: r[k] for k in moved},
                shape=lookup,
                present=self.object_of[clip] > 0,
                valid=valid,
            ),
            HumanWindows(
                **{k: r[k] for k in person}, upright=self.uprightness(*_depths(r["joints"]))
            ),
            self.grids.surface(self.object_of[clip], mirrored),
        )


def _depths(
    joints: Float[Tensor, "b frames 24 3"],
) -> tuple[Float[Tensor, " b"], Float[Tensor, " b"]]:
    """Height of the lowest palm and of the lowest pelvis in each window, metres."""
    return joints[:, :, 22:, 2].amin(dim=(1, 2)), joints[:, :, 0, 2].amin(dim=1)


def _weights(
    lengths: Float[Tensor, " clips"], has_object: Tensor, synthesis_share: float
) -> Float[Tensor, " clips"]:
    """Return the chance of each clip: by length, with a fixed share for the clips that have objects."""
    weights = lengths / lengths.sum()
    for group, share in ((has_object, synthesis_share), (~has_object, 1 - synthesis_share)):
        if group.any():
            weights[group] *= share / weights[group].sum()
    return weights


def _rows(clip: Clip, body: BodyModel, centre_object: Float[np.ndarray, "3"]) -> dict[str, Tensor]:
    root, R = torch.from_numpy(clip.root).float(), torch.from_numpy(clip.rotations).float()
    joints = forward_kinematics(body, root, R)
    return {
        "joints": joints,
        "rotations_6d": rotmat_to_6d(R),
        "hand_contact": torch.from_numpy(clip.hand_contact).float(),
        "foot_contact": torch.from_numpy(clip.foot_contact).float(),
        "reference": reference_path(joints[:, 22:]),
        **_object_rows(clip, len(root), centre_object),
    }


def _object_rows(
    clip: Clip, frames: int, centre_object: Float[np.ndarray, "3"]
) -> dict[str, Tensor]:
    moved = clip.object_motion
    pose = moved.T_world_object if moved else np.tile(np.eye(4), (frames, 1, 1))
    R_world_object, position = pose[:, :3, :3], pose[:, :3, 3]
    centre, lowest = np.zeros((frames, 3)), np.zeros(frames)
    if moved:
        centre = R_world_object @ centre_object + position
        lowest = (moved.mesh.vertices @ R_world_object[:, 2].T).min(axis=0) + position[:, 2]
    rows = {
        "centre": centre,
        "lowest": lowest,
        "velocity": velocity(centre, FPS),
        "spin": angular_velocity(R_world_object, FPS),
        "R_world_object": R_world_object,
    }
    return {k: torch.from_numpy(np.asarray(v, np.float32)) for k, v in rows.items()}


def _like(flag: Tensor, x: Tensor) -> Tensor:
    return flag.view(-1, *[1] * (x.ndim - 1))


def _mirror(key: str, x: Tensor) -> Tensor:
    """Reflect world x; a rotation becomes S R S, so the axis that lay along x keeps its image."""
    S = x.new_tensor([-1.0, 1.0, 1.0])
    if key == "joints":
        return x[:, :, SWAP, :] * S
    if key == "rotations_6d":
        return x[:, :, SWAP[:22], :, :] * S * x.new_tensor([-1.0, 1.0])[:, None]
    if key == "hand_contact":
        return x.flip(-1)
    if key == "foot_contact":
        return x[..., (1, 0, 3, 2)]
    if key == "reference":
        return x * S[:2]
    if key == "spin":
        return -x * S
    if key == "R_world_object":
        return x * S[:, None] * S
    return x * S if x.shape[-1] == 3 and x.ndim == 3 else x


class Uprightness:
    """Ranks of pelvis heights among windows whose lowest palm is at about the same height.

    Palms do not say whether somebody stoops or squats for what lies low. A rank says it on one scale for
    all heights: 0 is the deepest squat, 1 the straightest legs.
    """

    def __init__(self, palm: Float[Tensor, " windows"], pelvis: Float[Tensor, " windows"]) -> None:
        """Rank windows by the heights of their lowest palm and lowest pelvis, metres."""
        levels = torch.linspace(0, 1, _QUANTILES)
        self._table = torch.stack([_near(palm, pelvis, k).quantile(levels) for k in range(_BINS)])

    def __call__(
        self, palm: Float[Tensor, " b"], pelvis: Float[Tensor, " b"]
    ) -> Float[Tensor, " b"]:
        """The rank in [0, 1] of each window."""
        row = self._table[_bin(palm)]
        above = torch.searchsorted(row, pelvis[:, None]).clamp(1, _QUANTILES - 1)
        low, high = row.gather(1, above - 1)[:, 0], row.gather(1, above)[:, 0]
        part = ((pelvis - low) / (high - low).clamp(min=1e-6)).clamp(0, 1)
        return (above[:, 0] - 1 + part) / (_QUANTILES - 1)


def _bin(palm: Float[Tensor, " b"]) -> Tensor:
    return (palm / _STEP).long().clamp(0, _BINS - 1)


def _near(palm: Tensor, pelvis: Tensor, k: int) -> Float[Tensor, " windows"]:
    """Pelvis heights of the bin, widened until there are enough."""
    away = (_bin(palm) - k).abs()
    for wider in range(_BINS):
        near = pelvis[away <= wider]
        if len(near) >= _FEWEST:
            return near
    return pelvis
