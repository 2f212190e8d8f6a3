"""A mesh laid on a scan: alignments tried, compared and refined."""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float64
from scipy.ndimage import label
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from ingest.uncertainty import between, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import procrustes
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


_SAME = 1e-4
"""Metres between vertices of one mesh in two frames."""
_POINTS, _FEW = 3000, 800
"""Points of the object that are compared, and those with which alignments begin."""
_SPACING, _MOST, _THIN = 0.008, 60_000, 8_000
"""Metres between the scan's points, how many there are at most, and at first."""
_MIN_OVERLAP, _MAX_RMS = 0.6, 0.012
_RIVAL = 0.03
"""Least excess of the cost (0 to 1) of any other alignment."""
_PATCH = 0.18
"""Side of the patches of a scan's surface that err by themselves, metres."""
_SURFACE, _SURFACE_TURN = 0.002, np.radians(0.1)
"""Standard deviation on each axis (m, rad) of the whole surface of a scan."""
_LOOSE_TURN, _LOOSE_SHIFT = np.radians(1.5), 0.015
"""rad and m; an alignment that is less sure in a direction slides there."""


@dataclass(frozen=True)
class Registration:
    """The object's pose in the scan's frame."""

    T_scan_object: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`, in the scan's axes."""
    rms: float
    """Metres between the object's surface and the scan's, where both are."""
    overlap: float
    """Part of the object's surface that the scan shows."""


def register(mesh: ObjectMesh, scan: ObjectMesh, where: str) -> Registration:
    """Align an object's mesh with a scan of it, both in metres.

    The scan may show the floor and other things, and need not show all of the object. The same
    vertices in another frame are aligned exactly.

    Args:
        mesh: the object, in its own frame.
        scan: in a world with y up.
        where: the scan's file, for messages.

    Raises:
        InputError: "scan-overlap" when the object is not in the scan, "scan-symmetric" when it fits
            in more than one way, "scan-slides" when its shape leaves a direction open.
    """
    if (T := _same_vertices(mesh, scan)) is not None:
        return Registration(T, _of_scan(), 0.0, 1.0)
    area = float(trimesh.Trimesh(scan.vertices, scan.faces, process=False).area)
    surface = surface_of(scan, min(_MOST, int(area / _SPACING**2) + 500))
    points = surface_of(mesh, _POINTS).points
    few = points[:_FEW]
    thin = surface.thinned(_THIN)
    found = [icp(T, few, thin, rounds=30) for T in starts(points, thin)]
    costs = np.array([cost(T, points, surface) for T in found])
    best = icp(found[int(costs.argmin())], points, surface, rounds=20)
    overlap, rms = fit(best, points, surface)
    if overlap < _MIN_OVERLAP or rms > _MAX_RMS:
        raise InputError(
            "scan-overlap",
            f"The object is not in the scan: at its best place {overlap:.0%} of its surface is "
            f"within {100 * REACH:g} cm of the scan's ({1e3 * rms:.0f} mm rms).",
            where=where,
            fix="Give the scan of this very object, whole and in metres; cut off what stands around "
            "it. The object's mesh must be in metres too.",
        )
    covariance = _covariance(best, points, surface, max(rms, _SURFACE), mesh)
    _check_firm(covariance, where)
    _check_only(best, found, costs, where)
    return Registration(best, covariance, rms, overlap)


def _same_vertices(mesh: ObjectMesh, scan: ObjectMesh) -> Float64[np.ndarray, "4 4"] | None:
    if len(mesh.vertices) != len(scan.vertices):
        return None
    ours, theirs = (np.asarray(m.vertices, np.float64) for m in (mesh, scan))
    found = procrustes(theirs, ours, np.ones(len(ours)))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = found.R, found.t
    return T if np.abs(found.residuals).max() < _SAME else None


def _covariance(
    T: Float64[np.ndarray, "4 4"],
    points: Float64[np.ndarray, "points 3"],
    surface: SampledSurface,
    error: float,
    mesh: ObjectMesh,
) -> Float64[np.ndarray, "6 6"]:
    """Covariance of an alignment with a scan whose patches err independently by `error` metres."""
    area = float(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).area)
    J, _ = planes(T, points, surface, REACH)
    patches = area * len(J) / len(points) / _PATCH**2
    # A direction in which nothing holds gets metres, not infinity.
    information = J.T @ J / len(J) * patches / error**2 + 1e-2 * np.eye(6)
    return np.linalg.inv(information) + _of_scan()


def _of_scan() -> Float64[np.ndarray, "6 6"]:
    """Covariance of the error of a scan as a whole."""
    return np.diag(np.repeat([_SURFACE_TURN**2, _SURFACE**2], 3))


def _check_firm(covariance: Float64[np.ndarray, "6 6"], where: str) -> None:
    turn, shift = (
        np.sqrt(np.linalg.eigvalsh(block).max())
        for block in (covariance[:3, :3], covariance[3:, 3:])
    )
    if turn < _LOOSE_TURN and shift < _LOOSE_SHIFT:
        return
    raise InputError(
        "scan-slides",
        "The object's shape does not say how it stands in the scan: it could turn or slide by "
        f"{np.degrees(turn):.1f} deg or {1e3 * shift:.0f} mm and fit as well.",
        where=where,
        fix="For a round or flat object, use the scan itself as the object's mesh (‹object›), or "
        "give its pose in the session's world (‹object_pose›).",
    )


def _check_only(
    best: Float64[np.ndarray, "4 4"],
    found: list[Float64[np.ndarray, "4 4"]],
    costs: Float64[np.ndarray, " found"],
    where: str,
) -> None:
    """Refuse an alignment that another one rivals."""
    rivals = [T for T, c in zip(found, costs, strict=True) if c < costs.min() + _RIVAL]
    others = [T for T in rivals if differ(T, best)]
    if not others:
        return
    turns = {
        f"{np.degrees(Rotation.from_matrix(T[:3, :3] @ best[:3, :3].T).magnitude()):.0f} deg"
        for T in others
    }
    shift = max(float(np.linalg.norm(between(best, T)[3:])) for T in others)
    raise InputError(
        "scan-symmetric",
        f"The object fits into the scan in {len(others) + 1} ways: also turned by "
        f"{', '.join(sorted(turns))} (and its origin moved by up to {shift:.2f} m).",
        where=where,
        fix="Its shape does not tell which way round it stands. Use the scan itself as the object's "
        "mesh (‹object›), or give its pose in the session's world (‹object_pose›).",
    )
