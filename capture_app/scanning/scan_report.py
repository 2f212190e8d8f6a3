"""The report on a scan: data for programs, a page for people, and pictures."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64, Int64, UInt8

from capture_app.commands.scan import ScanRequest
from capture_app.report_page import ReportPage, figure, listed
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.report.take_report import Severity
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.scan_quality import Coverage, ScanReport
from ingest.scan.scan_types import View
from ingest.scan.scanned_object import ScannedObject
from render.backends import open_renderer
from render.cameras import Camera, orbit, pinhole
from render.lettering import caption
from render.overlay import draw_outline
from render.scene import Drawable, Scene, split_mesh
from render.video import contact_sheet


def report_data(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    scanned: ScannedObject | None,
    seconds: dict[str, float],
) -> dict[str, Any]:
    """Checks, sizes and numbers, of JSON's types alone; metres, seconds, degrees."""
    mesh = cleaned.mesh
    return {
        "source": str(request.source),
        "mesh": request.output.name,
        "severity": report.severity,
        "usable": report.usable,
        "checks": [asdict(check) for check in report.checks],
        "object": {
            "extents": _numbers(np.ptp(mesh.vertices, axis=0)),
            "vertices": len(mesh.vertices),
            "faces": len(mesh.faces),
            "watertight": cleaned.watertight,
            "seen": round(float(cleaned.seen.mean()), 3),
        },
        "seconds": seconds,
        **({} if scanned is None else _of_film(scanned, report)),
    }


def _of_film(scanned: ScannedObject, report: ScanReport) -> dict[str, Any]:
    registered, coverage = scanned.registered, report.coverage
    low, high = _box(scanned)
    return {
        "method": scanned.method,
        "voxel": round(scanned.voxel, 5),
        "pictures": {
            "given": scanned.frames.seen,
            "picked": len(scanned.frames.frames),
            "registered": len(registered.views),
            "left_out": {one.name: one.reason for one in registered.left_out},
        },
        "reprojection": round(registered.reprojection, 3),
        "scale": {
            **asdict(registered.scale),
            **({"sigma": None} if report.cut_off else {}),
            "up": registered.up,
        },
        "box": {"low": _numbers(low), "high": _numbers(high)},
        "T_world_object": [_numbers(row, 6) for row in scanned.cleaned.T_world_object],
        "coverage": None
        if coverage is None
        else {
            "azimuth": _numbers(coverage.azimuth, 1),
            "elevation": _numbers(coverage.elevation, 1),
            "gap": list(coverage.gap),
        },
    }


def _box(scanned: ScannedObject) -> tuple[np.ndarray, np.ndarray]:
    """Return what the option for a box takes: corners in the world that the stages work in."""
    region = scanned.region
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    T = region.T_world_floor
    corners = np.where(pick, region.high, region.low) @ T[:3, :3].T + T[:3, 3]
    return corners.min(axis=0) / scanned.stretched, corners.max(axis=0) / scanned.stretched


def _numbers(values: np.ndarray, digits: int = 4) -> list[float]:
    return [round(float(value), digits) for value in values]


_SIDE, _RADIUS = 320.0, 130.0
_RINGS = ((0.0, "level"), (30.0, "30°"), (60.0, "60°"))
_SHOWN_GAP = 40.0
"""Degrees without a picture that are shaded."""


def circle(coverage: Coverage) -> str:
    """A dot for each picture: near the rim it was taken from the level, near the middle from above.

    The film begins below; to its right is where a person walks to who faces the object.
    """
    parts = [f'<svg viewBox="0 0 {_SIDE:g} {_SIDE:g}" role="img" aria-label="Directions filmed">']
    start, width = coverage.gap
    if width > _SHOWN_GAP:
        parts.append(_sector(start, width))
    for elevation, word in _RINGS:
        x, y = _place(180.0, elevation)
        radius = _RADIUS * (1 - elevation / 90)
        middle = _SIDE / 2
        parts.append(f'<circle class="axis" cx="{middle}" cy="{middle}" r="{radius:.1f}"/>')
        parts.append(f'<text x="{x:.1f}" y="{y - 4:.1f}" text-anchor="middle">{word}</text>')
    for azimuth, elevation in zip(coverage.azimuth, coverage.elevation, strict=True):
        x, y = _place(float(azimuth), float(elevation))
        parts.append(f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="4"/>')
    x, y = _place(0.0, -12.0)
    parts.append(
        f'<text class="label" x="{x:.1f}" y="{y + 8:.1f}" text-anchor="middle">start</text>'
    )
    return "".join([*parts, "</svg>"])


def _place(azimuth: float, elevation: float) -> tuple[float, float]:
    """Pixels; counter-clockwise from below."""
    radius = _RADIUS * (1 - np.clip(elevation, -15, 90) / 90)
    turn = np.radians(azimuth)
    return _SIDE / 2 + radius * np.sin(turn), _SIDE / 2 + radius * np.cos(turn)


def _sector(start: float, width: float) -> str:
    x0, y0 = _place(start, 0.0)
    x1, y1 = _place(start + min(width, 359.9), 0.0)
    large, middle = int(width > 180), _SIDE / 2
    return (
        f'<path class="gap" d="M{middle} {middle}L{x0:.1f} {y0:.1f}'
        f'A{_RADIUS:g} {_RADIUS:g} 0 {large} 0 {x1:.1f} {y1:.1f}Z"/>'
    )


_HEADLINES: dict[Severity, str] = {
    "ok": "This scan is good",
    "warn": "This scan is usable with limits",
    "bad": "This scan is not usable as it is",
}
_STYLE = """
figure img { display:block; width:100%; height:auto; border-radius:8px; }
figure.small svg { max-width:26rem; margin:0 auto; }
.gap { fill:var(--bad); opacity:.3; }
figcaption { color:var(--quiet); font-size:.88rem; padding:.5rem 0 .4rem; }
"""


def scan_page(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    scanned: ScannedObject | None,
    pictures: Mapping[str, UInt8[np.ndarray, "h w 3"]],
) -> str:
    """The whole page; it loads nothing from anywhere.

    Args:
        request, cleaned, report, scanned: of the scan.
        pictures: by what is written below them.
    """
    shown = "".join(figure(words, picture) for words, picture in pictures.items())
    troubles = report.of("bad") or report.of("warn")
    advice = next((check.fix for check in troubles if check.fix), "")
    return ReportPage(
        kind="Scan report",
        name=request.output.name,
        verdict=report.severity,
        headline=_HEADLINES[report.severity],
        advice=[f"To do first: {advice}" if advice else "Nothing is to be done: use it."],
        facts=_facts(cleaned, scanned, report),
        sections=[("Pictures", shown + _around(report)), ("Checks", listed(report.checks))],
        source=str(request.source),
        style=_STYLE,
    ).html()


def _facts(
    cleaned: CleanMesh, scanned: ScannedObject | None, report: ScanReport
) -> list[tuple[str, str]]:
    sides = np.ptp(cleaned.mesh.vertices, axis=0)
    facts = [
        ("Size, metres", " × ".join(f"{side:.2f}" for side in sides)),
        ("Vertices", f"{len(cleaned.mesh.vertices):,}"),
        ("Surface", "closed" if cleaned.watertight else "open"),
    ]
    if scanned is not None:
        views, absent = len(scanned.registered.views), len(scanned.registered.left_out)
        facts.append(("Pictures placed", f"{views} of {views + absent}"))
        sure = "nothing" if report.cut_off else f"{scanned.registered.scale.sigma:.1%}"
        facts.append(("Size is sure to", sure))
        facts.append(
            ("Measured by", {"both": "pictures and depth"}.get(scanned.method, scanned.method))
        )
    return facts


def _around(report: ScanReport) -> str:
    if report.coverage is None:
        return ""
    words = (
        "Where the pictures were taken, seen from above: the rim is level with the object's middle, "
        "the centre right above it. Red: nothing was filmed from there."
    )
    return (
        f'<figure class="small">{circle(report.coverage)}<figcaption>{words}</figcaption></figure>'
    )


RGB = UInt8[np.ndarray, "h w 3"]
_FOV, _MARGIN, _LIFT = 0.55, 1.1, 0.3
_SIDES = ("from +x", "from +y", "from -x", "from -y")
_PLAIN = (0.62, 0.66, 0.70)
_INK, _BOX = (1.0, 0.35, 0.05), (0.1, 0.85, 1.0)
_EDGES = (
    (0, 1),
    (0, 2),
    (0, 4),
    (1, 3),
    (1, 5),
    (2, 3),
    (2, 6),
    (3, 7),
    (4, 5),
    (4, 6),
    (5, 7),
    (6, 7),
)
"""Edges of a box, between corners numbered by their low (0) or high (1) x, y, z."""


def views_picture(cleaned: CleanMesh, *, side: int = 360) -> RGB:
    """The mesh from four sides: above in its colours, below its shape alone.

    Args:
        cleaned: in its own frame.
        side: of each view, pixels.
    """
    mesh = cleaned.mesh
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    distance = _MARGIN * float(np.linalg.norm(high - low)) / 2 / np.sin(_FOV / 2)
    surface = split_mesh(mesh.vertices, mesh.faces)
    plain = Drawable("object", surface.vertices, surface.faces, _PLAIN)
    looks = [plain] if mesh.colours is None else [_painted(cleaned), plain]
    pictures: list[RGB] = []
    with open_renderer(side, side) as renderer:
        for look in looks:
            renderer.show(Scene([look]))
            for quarter, name in enumerate(_SIDES):
                T = orbit((low + high) / 2, distance, quarter * np.pi / 2 + 0.25, _LIFT)
                pictures.append(caption(renderer.color(pinhole(T, _FOV, side, side)), label=name))
    return contact_sheet(pictures, len(_SIDES))


def _painted(cleaned: CleanMesh) -> Drawable:
    """Each triangle has its own square of four texels in a texture, the first three its corners'."""
    mesh = cleaned.mesh
    assert mesh.colours is not None
    count = len(mesh.faces)
    across = int(np.ceil(np.sqrt(count)))
    number = np.arange(count)
    corner = 2 * np.stack([number % across, number // across], axis=1)
    texture = np.zeros((2 * across, 2 * across, 3), np.uint8)
    places = corner[:, None] + np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    colours = mesh.colours[mesh.faces]
    last = (colours[:, 1].astype(int) + colours[:, 2] - colours[:, 0]).clip(0, 255)
    texture[places[..., 1], places[..., 0]] = np.concatenate([colours, last[:, None]], axis=1)
    uv = (places[:, :3] + 0.5) / texture.shape[0]
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    faces = np.arange(3 * count).reshape(-1, 3)
    return Drawable("object", corners, faces, uv=uv.reshape(-1, 2), texture=texture)


def outline_picture(scanned: ScannedObject, *, width: int = 720) -> RGB | None:
    """Two registered pictures with the mesh's outline and the box that it was looked for in.

    Args:
        scanned: the scan.
        width: of each picture, pixels.

    Returns:
        None where no picture can be read.
    """
    views = _two_sides(scanned)
    drawn = [picture for view in views if (picture := _outlined(scanned, view, width)) is not None]
    return contact_sheet(_of_one_size(drawn), 2) if drawn else None


def _two_sides(scanned: ScannedObject) -> list[View]:
    """The picture that shows the object best in its middle, and one from the side of that."""
    T, views = scanned.cleaned.T_world_object, scanned.registered.views
    middle = T[:3, :3] @ [0, 0, float(scanned.cleaned.mesh.vertices[:, 2].max()) / 2] + T[:3, 3]
    away = middle - np.array([view.T_world_camera[:3, 3] for view in views])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    axes = np.array([view.T_world_camera[:3, 2] for view in views])
    centred = np.einsum("ij,ij->i", away, axes)
    first = int(centred.argmax())
    second = int((centred - 0.2 * np.abs(away @ away[first])).argmax())
    return [views[first], views[second]]


def _outlined(scanned: ScannedObject, view: View, width: int) -> RGB | None:
    bgr = cv2.imread(str(view.file), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None:
        return None
    scale = width / bgr.shape[1]
    small = cv2.resize(bgr, (width, round(scale * bgr.shape[0])), interpolation=cv2.INTER_AREA)
    picture = np.ascontiguousarray(small[..., ::-1])
    fx, fy, cx, cy = view.intrinsics * (width / view.size[0])
    camera = Camera(view.T_world_camera @ T_OPENCV_ARKIT_CAMERA, fx, fy, cx, cy)
    T = scanned.cleaned.T_world_object
    vertices = scanned.cleaned.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    draw_outline(picture, vertices, scanned.cleaned.mesh.faces, camera, None, _INK)
    draw_outline(picture, *_box_edges(scanned), camera, None, _BOX)
    return picture


def _box_edges(
    scanned: ScannedObject,
) -> tuple[Float64[np.ndarray, "corners 3"], Int64[np.ndarray, "faces 3"]]:
    """The region's edges as triangles without width, whose outline is a line."""
    region = scanned.region
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    T = region.T_world_floor
    corners = np.where(pick, region.high, region.low) @ T[:3, :3].T + T[:3, 3]
    return corners, np.array([(a, b, b) for a, b in _EDGES])


def _of_one_size(pictures: list[RGB]) -> list[RGB]:
    """Cut to the size that all of them have."""
    height = min(picture.shape[0] for picture in pictures)
    return [picture[:height] for picture in pictures]
