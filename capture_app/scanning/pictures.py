"""Pictures of a scan: the mesh from its sides, and its outline on what the phone saw."""

import cv2
import numpy as np
from jaxtyping import Float64, Int64, UInt8

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.scan_types import View
from ingest.scan.scanned_object import ScannedObject
from render.backends import open_renderer
from render.cameras import Camera, orbit, pinhole
from render.captions import caption
from render.normals import split_mesh
from render.outline import draw_outline
from render.scene import Drawable, Scene
from render.stills import contact_sheet

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
"""Of a box, between corners numbered by their low (0) or high (1) x, y, z."""


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


def outline_picture(found: ScannedObject, *, width: int = 720) -> RGB | None:
    """Two registered pictures with the mesh's outline and the box that it was looked for in.

    Args:
        found: the scan.
        width: of each picture, pixels.

    Returns:
        None where no picture can be read.
    """
    views = _two_sides(found)
    drawn = [picture for view in views if (picture := _outlined(found, view, width)) is not None]
    return contact_sheet(_of_one_size(drawn), 2) if drawn else None


def _two_sides(found: ScannedObject) -> list[View]:
    """The picture that shows the object best in its middle, and one from the side of that."""
    T, views = found.cleaned.T_world_object, found.registered.views
    middle = T[:3, :3] @ [0, 0, float(found.cleaned.mesh.vertices[:, 2].max()) / 2] + T[:3, 3]
    away = middle - np.array([view.T_world_camera[:3, 3] for view in views])
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    axes = np.array([view.T_world_camera[:3, 2] for view in views])
    centred = np.einsum("ij,ij->i", away, axes)
    first = int(centred.argmax())
    second = int((centred - 0.2 * np.abs(away @ away[first])).argmax())
    return [views[first], views[second]]


def _outlined(found: ScannedObject, view: View, width: int) -> RGB | None:
    bgr = cv2.imread(str(view.file), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None:
        return None
    scale = width / bgr.shape[1]
    small = cv2.resize(bgr, (width, round(scale * bgr.shape[0])), interpolation=cv2.INTER_AREA)
    picture = np.ascontiguousarray(small[..., ::-1])
    fx, fy, cx, cy = view.intrinsics * (width / view.size[0])
    camera = Camera(view.T_world_camera @ T_OPENCV_ARKIT_CAMERA, fx, fy, cx, cy)
    T = found.cleaned.T_world_object
    vertices = found.cleaned.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    draw_outline(picture, vertices, found.cleaned.mesh.faces, camera, None, _INK)
    draw_outline(picture, *_box_edges(found), camera, None, _BOX)
    return picture


def _box_edges(
    found: ScannedObject,
) -> tuple[Float64[np.ndarray, "corners 3"], Int64[np.ndarray, "faces 3"]]:
    """The region's edges as triangles without width, whose outline is a line."""
    region = found.region
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    T = region.T_world_floor
    corners = np.where(pick, region.high, region.low) @ T[:3, :3].T + T[:3, 3]
    return corners, np.array([(a, b, b) for a, b in _EDGES])


def _of_one_size(pictures: list[RGB]) -> list[RGB]:
    """Cut to the size that all of them have."""
    height = min(picture.shape[0] for picture in pictures)
    return [picture[:height] for picture in pictures]
