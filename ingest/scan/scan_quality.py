"""How good a scan is: verdicts on pictures, cameras and surface, and what to film again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial import KDTree

from ingest.mesh import MAX_EXTENT, MIN_EXTENT
from ingest.report.take_report import Check, Severity, grade, graded, worst
from ingest.scan.clean_mesh import UNSEEN, CleanMesh
from ingest.scan.scan_types import Region, View
from ingest.scan.scanned_object import ScannedObject
from omomo_core.geometry.transforms import inverse

AROUND = "all around"
"""The check of the circle; bad where one side of the object was filmed and the rest was not."""
_GAP_WARN, _GAP_BAD = 60.0, 150.0
"""Degrees of the circle around the object from which no picture is taken."""
_HIGH, _LOW = 25.0, 25.0
"""Degrees over the level: pictures above and below show the top and the sides."""


@dataclass(frozen=True)
class Coverage:
    """Directions from the object to the cameras whose pictures show it."""

    azimuth: Float64[np.ndarray, " views"]
    """Degrees to the right of where the film begins, as a person who faces the object walks."""
    elevation: Float64[np.ndarray, " views"]
    """Degrees over the level of the object's middle."""
    distance: Float64[np.ndarray, " views"]
    """From the object's middle, metres."""

    @property
    def gap(self) -> tuple[float, float]:
        """The widest stretch of the circle without a picture: where it begins and its width."""
        around = np.sort(self.azimuth % 360)
        if len(around) == 0:
            return 0.0, 360.0
        widths = np.diff(np.append(around, around[0] + 360))
        widest = int(widths.argmax())
        return float(around[widest]), float(widths[widest])


def coverage_of(found: ScannedObject) -> Coverage:
    """Return the directions from which the pictures are taken, seen from the middle of the object.

    Pictures of a symmetric object show it from the other side too.
    """
    T = inverse(found.cleaned.T_world_object)
    vertices = found.cleaned.mesh.vertices
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    R, t = found.cleaned.T_world_object[:3, :3], found.cleaned.T_world_object[:3, 3]
    shown = [view for view in found.registered.views if _shows(view, R @ middle + t)]
    eyes = np.array([view.T_world_camera[:3, 3] for view in shown]).reshape(-1, 3)
    if found.mirror is not None:
        floor = found.region.T_world_floor
        T_mirror = floor @ found.mirror.reflection @ inverse(floor)
        eyes = np.concatenate([eyes, eyes @ T_mirror[:3, :3].T + T_mirror[:3, 3]])
    x, y, z = (eyes @ T[:3, :3].T + T[:3, 3] - middle).T
    azimuth = np.degrees(np.arctan2(y, x))
    first = azimuth[0] if len(azimuth) else 0.0
    return Coverage(
        (azimuth - first) % 360,
        np.degrees(np.arctan2(z, np.hypot(x, y))),
        np.hypot(np.hypot(x, y), z),
    )


def _shows(view: View, point: Float64[np.ndarray, "3"]) -> bool:
    T = inverse(view.T_world_camera)
    x, y, z = T[:3, :3] @ point + T[:3, 3]
    fx, fy, cx, cy = view.intrinsics
    return bool(
        z > 0 and 0 <= fx * x / z + cx < view.size[0] and 0 <= fy * y / z + cy < view.size[1]
    )


def coverage_checks(coverage: Coverage) -> tuple[Check, ...]:
    """Whether the film goes all around, and both high and low."""
    start, width = coverage.gap
    severity = "bad" if width > _GAP_BAD else "warn" if width > _GAP_WARN else "ok"
    if severity == "ok":
        message = f"Pictures from all around; the widest gap between two is {width:.0f} degrees."
    else:
        message = f"No picture shows the object from {width:.0f} degrees of the circle around it."
    fix = (
        f"Film again from {start:.0f} to {start + width:.0f} degrees to the right of where the film "
        "begins, facing the object (90 is a quarter of the way around)."
    )
    return (graded(AROUND, severity, message, fix), _heights(coverage))


def _heights(coverage: Coverage) -> Check:
    if len(coverage.elevation) == 0:
        return Check("heights", "bad", "No picture shows the object.")
    low, high = float(coverage.elevation.min()), float(coverage.elevation.max())
    message = f"Pictures from {low:.0f} to {high:.0f} degrees over the level of its middle."
    fixes = ["Film a round from higher, looking down on it."] * (high < _HIGH)
    fixes += ["Film a round from lower, at the level of its middle."] * (low > _LOW)
    return graded("heights", "warn" if fixes else "ok", message, " ".join(fixes))


def one_sided(views: Sequence[View], region: Region) -> bool:
    """Whether a wide stretch of the circle around the region is not filmed from."""
    T = inverse(region.T_world_floor)
    middle = (region.low + region.high) / 2
    eyes = np.array([view.T_world_camera[:3, 3] for view in views])
    x, y, z = (eyes @ T[:3, :3].T + T[:3, 3] - middle).T
    around = Coverage(np.degrees(np.arctan2(y, x)), np.zeros(len(x)), np.hypot(np.hypot(x, y), z))
    return around.gap[1] > _GAP_WARN


_ALL = 0.9
"""Part of the pictures that are registered: below it is looked at. What is missing for it is not bad by
itself: where it leaves the object unseen, the checks of what was seen say so."""
_OFF_WARN, _OFF_BAD = 1.5, 4.0
"""Pixels between features and points, in a picture 960 pixels wide."""
_SCALE_WARN, _SCALE_BAD = 0.01, 0.05
_PLAUSIBLE = (0.1, 2.5)
"""Metres of the largest side of what people carry, drag or sweep with."""
_LEFT_OVER = 0.3
"""Part of the measured surface that may belong to other things."""
_NEAR = 0.02
"""Metres between a sparse point and the surface, at most; and at least from it to the floor."""
_FEW = 100.0
"""Sparse points on a square metre of the surface."""


@dataclass(frozen=True)
class ScanReport:
    """All the verdicts, in the order in which a person wants to read them."""

    checks: tuple[Check, ...]
    coverage: Coverage | None
    """None for a ready mesh, which has no pictures."""

    @property
    def severity(self) -> Severity:
        """The worst of the checks."""
        return worst([check.severity for check in self.checks])

    @property
    def usable(self) -> bool:
        """Whether the mesh may be used, if within limits: nothing is wrong with it that is bad."""
        return self.severity != "bad"

    @property
    def cut_off(self) -> bool:
        """Whether most of the object was not filmed, so that its size is not that of the mesh."""
        return cut_off(self.checks)

    def of(self, severity: Severity) -> list[Check]:
        """The checks of one severity."""
        return [check for check in self.checks if check.severity == severity]


def cut_off(checks: Sequence[Check]) -> bool:
    """Whether some checks say that one side alone was filmed, or that most of the surface is made up."""
    return any(check.severity == "bad" and check.name in (AROUND, UNSEEN) for check in checks)


def inspect_scan(found: ScannedObject) -> ScanReport:
    """Check a scan."""
    coverage = coverage_of(found)
    around = coverage_checks(coverage)
    cut = cut_off((*around, *found.cleaned.mesh.notes))
    checks = (
        *found.frames.notes,
        _pictures(found),
        *(note for note in found.registered.notes if note.name != "registered"),
        _reprojection(found),
        *around,
        *_mirrored(found),
        _scale(found, cut),
        _texture_check(found),
        *found.region.notes,
        _pieces(found),
        *found.cleaned.mesh.notes,
        *_of_mesh(found.cleaned),
    )
    return ScanReport(checks, coverage)


def inspect_ready(cleaned: CleanMesh) -> ScanReport:
    """Look a mesh over that another app made."""
    return ScanReport((*cleaned.mesh.notes, *_of_mesh(cleaned)), None)


def _pictures(found: ScannedObject) -> Check:
    there, absent = len(found.registered.views), len(found.registered.left_out)
    share = there / (there + absent)
    severity = "warn" if share < _ALL else "ok"
    message = f"{there} of {there + absent} pictures were placed."
    if absent:
        first = found.registered.left_out[0]
        message += f" Of {first.name}: {first.reason}."
    return graded(
        "registered", severity, message, "Film what is missing more slowly, with more overlap."
    )


def _reprojection(found: ScannedObject) -> Check:
    off = found.registered.reprojection
    width = max(max(view.size) for view in found.registered.views)
    message = f"Points lie {off:.2f} pixels from where the pictures show them."
    fix = "Film slowly, with a steady hand; the object and its surroundings must not move."
    return graded("reprojection", grade(off * 960 / width, _OFF_WARN, _OFF_BAD), message, fix)


def _scale(found: ScannedObject, cut: bool) -> Check:
    scale = found.registered.scale
    if cut:
        return _scale_of_a_part(found)
    largest = float(np.ptp(found.cleaned.mesh.vertices, axis=0).max())
    message = (
        f"The size comes from {scale.description}, sure to {scale.sigma:.1%}: "
        f"{1e3 * scale.sigma * largest:.0f} mm in its largest side of {largest:.2f} m."
    )
    fix = "Measure the object's height and give it (‹height›), or lay a board beside it (‹board›)."
    return graded("scale", grade(scale.sigma, _SCALE_WARN, _SCALE_BAD), message, fix)


def _scale_of_a_part(found: ScannedObject) -> Check:
    """Nothing is sure about the size of what was filmed in part, however well the metre is known."""
    scale = found.registered.scale
    if scale.by == "height":
        tall = float(np.ptp(found.cleaned.mesh.vertices[:, 2]))
        message = (
            f"The height of {tall:.2f} m was given to what was filmed, which is not the object: "
        )
        return Check("scale", "bad", message + "nothing is known about the object's size.")
    message = f"The metre comes from {scale.description}, but the size is that of what was filmed: how large "
    return Check("scale", "bad", message + "the object is, is not known.")


def _mirrored(found: ScannedObject) -> tuple[Check, ...]:
    """That one half of the object stands for the other, where it does."""
    if found.mirror is None:
        return ()
    message = (
        "The object is symmetric, and the film does not go around it: what one half hides is the "
        f"mirror image of the other ({found.mirror.support:.0%} of what was seen was seen on both)."
    )
    fix = "Film all around, or turn it off (‹symmetry› off) if the halves differ."
    return (Check("symmetry", "warn", message, None, fix),)


def _pieces(found: ScannedObject) -> Check:
    message = f"{found.pieces_cut:.0%} of the measured surface were other things, and cut off."
    fix = "Look at the pictures; if a part of the object is missing, give a box around it (‹box›)."
    return graded("cut off", "warn" if found.pieces_cut > _LEFT_OVER else "ok", message, fix)


def _of_mesh(cleaned: CleanMesh) -> tuple[Check, ...]:
    sides = np.ptp(cleaned.mesh.vertices, axis=0)
    largest = float(sides.max())
    description = f"It is {sides[0]:.2f} x {sides[1]:.2f} m wide and {sides[2]:.2f} m high."
    usual = _PLAUSIBLE[0] <= largest <= _PLAUSIBLE[1]
    severity = "bad" if not MIN_EXTENT <= largest <= MAX_EXTENT else "ok" if usual else "warn"
    fix = "Measure it; if that is wrong, give its height (‹height›) or the box it is in (‹box›)."
    count = f"{len(cleaned.mesh.vertices):,} vertices, {len(cleaned.mesh.faces):,} triangles."
    return (graded("size", severity, description, fix), Check("vertices", "ok", count))


def _points_on(found: ScannedObject) -> int:
    """Sparse points that lie on the object, those near its floor left out."""
    T = inverse(found.cleaned.T_world_object)
    points = found.registered.points @ T[:3, :3].T + T[:3, 3]
    above = points[points[:, 2] > _NEAR]
    if len(above) == 0:
        return 0
    vertices, faces = found.cleaned.mesh.vertices, found.cleaned.mesh.faces
    known = np.concatenate([vertices, vertices[faces].mean(axis=1)])
    return int((KDTree(known).query(above, distance_upper_bound=_NEAR)[0] < _NEAR).sum())


def _area_of(found: ScannedObject) -> float:
    """Area of the surface, square metres."""
    a, b, c = (found.cleaned.mesh.vertices[found.cleaned.mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _texture_check(found: ScannedObject) -> Check:
    """A plain object gives few points, however busy its room is; LiDAR measures it all the same."""
    count, area = _points_on(found), _area_of(found)
    plain = count < _FEW * area
    message = (
        f"{count:,} points were found on the object itself, {count / area:,.0f} a square metre."
    )
    if plain and found.method == "stereo":
        message += " It has next to no texture, so its shape is partly guessed."
    elif plain:
        message += " It has next to no texture; its shape is what the phone's depth says."
    fix = "Textureless object: stick some tape or paper with a pattern on it, and film it closer."
    return graded("texture", "warn" if plain else "ok", message, fix)
