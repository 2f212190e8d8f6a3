"""Printed boards and markers painted into pictures, as they would look lying at a known place."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from ingest.axes import T_ZUP_ARKIT
from ingest.calibration.board.board_place import Reference, Tags
from ingest.calibration.board.board_spec import Board, Checkerboard
from ingest.scan.cameras.metric_scale import Similarity
from ingest.scan.scan_types import View
from tests.ingest.calibration.board.filmed import sheet_of
from tests.ingest.scan.orbiting import ring

CHAIR = Path(__file__).parents[3] / "../shared/data/scan/chair_3d_scanner_app"
SIZE = (960, 720)
_FINER = 4
"""Pixels of a painted picture along one side of a pixel of its result."""
_CELL = 24
"""Pixels of a square or of a marker's cell in its pattern."""
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
Grey = UInt8[np.ndarray, "height width"]


def pattern_of(reference: Reference, number: int = 0) -> tuple[Grey, float]:
    """Its picture with white around, and how many of its pixels a metre has.

    The white is as wide as a square, or as a cell of a marker.
    """
    if isinstance(reference, Tags):
        cells = reference.codes.markerSize + 2
        marker = cv2.aruco.generateImageMarker(reference.codes, number, cells * _CELL)
        return np.pad(
            np.asarray(marker), _CELL, constant_values=255
        ), cells * _CELL / reference.side
    return sheet_of(reference, _CELL, _CELL), _CELL / reference.square


def painted(
    picture: Grey, view: View, T_world_print: Float64[np.ndarray, "4 4"], print_: tuple[Grey, float]
) -> Grey:
    """The picture with a print in it whose frame lies there (see `Grid`)."""
    pattern, scale = print_
    fx, fy, cx, cy = view.intrinsics
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    T = np.linalg.inv(view.T_world_camera) @ T_world_print
    to_metres = np.array([[1 / scale, 0, -(_CELL - 0.5) / scale], [0, 1 / scale, 0], [0, 0, 1]])
    to_metres[1, 2] = to_metres[0, 2]
    H = K @ T[:3, [0, 1, 3]] @ to_metres
    rows, columns = pattern.shape
    outline = np.array([[0, 0, 1], [columns, 0, 1], [columns, rows, 1], [0, rows, 1.0]]) @ H.T
    ends = outline[:, :2] / outline[:, 2:]
    left, top = np.floor(ends.min(axis=0)).astype(int).clip(0)
    right, bottom = np.ceil(ends.max(axis=0)).astype(int) + 1
    part = picture[top:bottom, left:right]
    half = (_FINER - 1) / 2
    finer = np.array(
        [[_FINER, 0, half - _FINER * left], [0, _FINER, half - _FINER * top], [0, 0, 1]]
    )
    size = part.shape[::-1]
    large = (size[0] * _FINER, size[1] * _FINER)
    ink = cv2.warpPerspective(pattern, finer @ H, large, flags=cv2.INTER_LINEAR)
    there = cv2.warpPerspective(np.full_like(pattern, 255), finer @ H, large)
    small = [cv2.resize(x, size, interpolation=cv2.INTER_AREA) for x in (ink, there)]
    mixed = (small[0] + part * (1.0 - small[1] / 255.0)).astype(np.float32)
    mixed = cv2.GaussianBlur(mixed, (0, 0), 0.7)
    out = picture.copy()
    out[top:bottom, left:right] = np.where(small[1] > 0, np.rint(mixed.clip(0, 255)), part)
    return out


def chair_views() -> list[tuple[View, Grey]]:
    """The real garden chair's pictures, smaller, with their logged poses."""
    views: list[tuple[View, Grey]] = []
    for file in sorted(CHAIR.glob("frame_*.jpg")):
        record = json.loads(file.with_suffix(".json").read_bytes())
        picture = np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE))
        shrink = SIZE[0] / picture.shape[1]
        K = shrink * np.array(record["intrinsics"]).reshape(3, 3)
        pose = np.array(record["cameraPoseARFrame"]).reshape(4, 4)
        lens = np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2]])
        view = View(file.name, file, SIZE, lens, T_ZUP_ARKIT @ pose @ _FLIP)
        views.append((view, cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA)))
    return views


def drawn_views() -> list[tuple[View, Grey]]:
    """Pictures of nothing but noise, taken from half around."""
    rng = np.random.default_rng(0)
    lens = np.array([720.0, 720.0, 479.5, 359.5])
    views: list[tuple[View, Grey]] = []
    for k, T in enumerate(ring([0.0, 0.0, 0.0], 12, turn=np.pi)):
        noise = cv2.GaussianBlur(rng.normal(128, 60, SIZE[::-1]).astype(np.float32), (0, 0), 3)
        view = View(f"{k:05d}.jpg", Path(), SIZE, lens, T)
        views.append((view, noise.clip(0, 255).astype(np.uint8)))
    return views


BACKGROUNDS: Mapping[str, Callable[[], list[tuple[View, Grey]]]] = {
    "drawn": drawn_views,
    "real": chair_views,
}


def middle_of(views: list[View]) -> Float64[np.ndarray, "3"]:
    """The place at which most of the cameras look."""
    T = np.array([view.T_world_camera for view in views])
    across = np.eye(3) - T[:, :3, 2, None] * T[:, None, :3, 2]
    return np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, T[:, :3, 3]))


def lying(
    where: Float64[np.ndarray, "3"], degrees: float, reference: Reference
) -> Float64[np.ndarray, "4 4"]:
    """T_world_print of a print that lies face up with its middle there, turned by some degrees."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    T = np.eye(4)
    T[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.diag([1.0, -1.0, -1.0])
    if isinstance(reference, Board | Checkerboard):
        half = np.array([reference.width, reference.height, 0]) / 2
    else:
        half = np.array([reference.side, reference.side, 0]) / 2
    T[:3, 3] = where - T[:3, :3] @ half
    return T


def resized(view: View, file: Path, model_of_world: Similarity) -> View:
    """The view of a picture that was written, in a model of another size and place."""
    T = model_of_world.poses(view.T_world_camera[None])[0]
    return View(view.name, file, view.size, view.intrinsics, T)
