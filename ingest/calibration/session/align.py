"""Alignment of points with a scanned surface: from many starts, by point-to-plane steps."""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float64
from scipy.ndimage import label
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from ingest.uncertainty import between, moved
from omomo_core.motion import ObjectMesh

REACH = 0.02
"""Metres from the scan at which a point of the object counts as missing from it."""
_CELL = 0.03
"""Side of the boxes that tell whether surfaces hang together, metres."""
_STARTS, _TRIED, _KEPT = 500, 60, 12
"""Rotations that are looked at, begun with, and finished."""
_ROUGH = 250
"""Points that are compared at first."""
_OTHER_TURN, _OTHER_SHIFT = np.radians(12.0), 0.04
"""rad and metres between two alignments that are not the same."""


@dataclass(frozen=True)
class SampledSurface:
    """Points sampled on a surface, with their normals and a KD-tree."""

    points: Float64[np.ndarray, "points 3"]
    normals: Float64[np.ndarray, "points 3"]
    tree: KDTree

    def thinned(self, count: int) -> "SampledSurface":
        """The same surface by fewer of its points, which lie in no order."""
        points = self.points[:count]
        return SampledSurface(points, self.normals[:count], KDTree(points))


def surface_of(mesh: ObjectMesh, count: int) -> SampledSurface:
    """`count` points strewn evenly over a mesh, always the same."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(solid, count, seed=0)[:2]
    points = np.asarray(points, np.float64)
    return SampledSurface(points, np.asarray(solid.face_normals)[faces], KDTree(points))


def starts(
    points: Float64[np.ndarray, "points 3"], surface: SampledSurface
) -> list[Float64[np.ndarray, "4 4"]]:
    """Alignments that are worth finishing: each ends somewhere else, the best first.

    Begun with many rotations about each place where the object could be.
    """
    few = points[:_ROUGH]
    turns = Rotation.random(_STARTS, rng=np.random.default_rng(0)).as_matrix()
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    middle = box.mean(axis=0)
    starts: list[Float64[np.ndarray, "4 4"]] = []
    for place in _places(surface, float(np.linalg.norm(np.ptp(box, axis=0)))):
        T = np.tile(np.eye(4), (len(turns), 1, 1))
        T[:, :3, :3] = turns
        T[:, :3, 3] = place - turns @ middle
        starts += list(T)
    wide = 5 * REACH
    starts.sort(key=lambda T: cost(T, few, surface, wide))
    tried = [icp(T, few, surface, 12, wide) for T in starts[:_TRIED]]
    tried.sort(key=lambda T: cost(T, few, surface, 2 * REACH))
    return _distinct(tried)[:_KEPT]


def _places(surface: SampledSurface, size: float) -> list[Float64[np.ndarray, "3"]]:
    """The scan's middle, and that of each thing of about the object's size on its floor."""
    middles = [(surface.points.min(axis=0) + surface.points.max(axis=0)) / 2]
    level = np.abs(surface.normals[:, 1]) > 0.95
    lowest = np.quantile(surface.points[:, 1], 0.01)
    above = surface.points[~(level & (surface.points[:, 1] < lowest + _CELL))]
    cells = ((above - surface.points.min(axis=0)) / _CELL).astype(int)
    filled = np.zeros(cells.max(axis=0) + 1, bool)
    filled[tuple(cells.T)] = True
    numbered = np.zeros(filled.shape, np.int32)
    label(filled, np.ones((3, 3, 3)), output=numbered)
    things = numbered[tuple(cells.T)]
    for thing in np.unique(things):
        points = above[things == thing]
        if 0.5 * size < np.linalg.norm(np.ptp(points, axis=0)) < 1.5 * size:
            middles.append((points.min(axis=0) + points.max(axis=0)) / 2)
    return middles


def _distinct(poses: list[Float64[np.ndarray, "4 4"]]) -> list[Float64[np.ndarray, "4 4"]]:
    """One of each group of poses that will end in the same."""
    kept: list[Float64[np.ndarray, "4 4"]] = []
    for T in poses:
        if all(differ(T, known) for known in kept):
            kept.append(T)
    return kept


def differ(T: Float64[np.ndarray, "4 4"], known: Float64[np.ndarray, "4 4"]) -> bool:
    """Whether two alignments are not the same one."""
    step = between(known, T)
    return bool(np.linalg.norm(step[:3]) > _OTHER_TURN or np.linalg.norm(step[3:]) > _OTHER_SHIFT)


def cost(
    T: Float64[np.ndarray, "4 4"],
    points: Float64[np.ndarray, "points 3"],
    surface: SampledSurface,
    reach: float = REACH,
) -> float:
    """0 when every point is on the scan, 1 when none is within reach."""
    placed = points @ T[:3, :3].T + T[:3, 3]
    distance = surface.tree.query(placed, distance_upper_bound=reach)[0]
    return float(((distance / reach).clip(max=1) ** 2).mean())


def fit(
    T: Float64[np.ndarray, "4 4"], points: Float64[np.ndarray, "points 3"], surface: SampledSurface
) -> tuple[float, float]:
    """Part of the points within reach of the scan, and how far those are from its surface."""
    placed = points @ T[:3, :3].T + T[:3, 3]
    distance, nearest = surface.tree.query(placed, distance_upper_bound=REACH)
    near, at = distance < REACH, nearest[distance < REACH]
    off = ((placed[near] - surface.points[at]) * surface.normals[at]).sum(axis=1)
    return float(near.mean()), float(np.sqrt((off**2).mean())) if near.any() else np.inf


def icp(
    start: Float64[np.ndarray, "4 4"],
    points: Float64[np.ndarray, "points 3"],
    surface: SampledSurface,
    rounds: int,
    reach: float = 2 * REACH,
) -> Float64[np.ndarray, "4 4"]:
    """Point-to-plane steps until nothing moves; far points do not count."""
    pose = start
    for _ in range(rounds):
        J, off = planes(pose, points, surface, reach)
        if len(J) < 12:
            break
        # A little damping: a flat thing may slide, but must not fly away.
        information = J.T @ J
        damped = information + np.diag(np.diag(information)) * 1e-6 + 1e-9 * np.eye(6)
        step = -np.linalg.solve(damped, J.T @ off)
        pose = moved(pose, step)
        if np.abs(step).max() < 1e-6:
            break
    return pose


def planes(
    T: Float64[np.ndarray, "4 4"],
    points: Float64[np.ndarray, "points 3"],
    surface: SampledSurface,
    reach: float,
) -> tuple[Float64[np.ndarray, "near 6"], Float64[np.ndarray, " near"]]:
    """Distances from the scan's planes, and how they change with a step of `moved`."""
    turned = points @ T[:3, :3].T
    placed = turned + T[:3, 3]
    distance, nearest = surface.tree.query(placed, distance_upper_bound=reach)
    near = distance < reach
    normals = surface.normals[nearest[near]]
    weight = (1 - (distance[near] / reach) ** 2)[:, None]
    J = np.concatenate([np.cross(turned[near], normals), normals], axis=1) * weight
    off = ((placed[near] - surface.points[nearest[near]]) * normals).sum(axis=1)
    return J, off * weight[:, 0]
