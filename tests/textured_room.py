"""A room as a phone's app exports it: one surface of floor and things, with a picture, y up."""

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from ingest.axes import T_ZUP_ARKIT
from tests.simulator.scan_film import ScanFilm

SIDE, CELL = 4.0, 0.04
"""Metres of the floor, and of a cell of the surface."""
THING = (0.5, 0.7, 0.6)
"""Metres along x and y, and its height."""
AT = (0.4, -0.6)


def room(places: tuple[tuple[float, float], ...] = (AT,), noise: float = 0.004) -> trimesh.Trimesh:
    """Boxes on a floor, z up: a sheet that lies on all, as an app's mesh does; its picture is x and y."""
    count = round(SIDE / CELL) + 1
    x, y = np.meshgrid(*[np.linspace(-SIDE / 2, SIDE / 2, count)] * 2, indexing="ij")
    z = noise * np.random.default_rng(0).uniform(-1, 1, x.shape)
    for at in places:
        inside = (np.abs(x - at[0]) < THING[0] / 2) & (np.abs(y - at[1]) < THING[1] / 2)
        z[inside] = THING[2]
    number = np.arange(count * count).reshape(count, count)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    uv = vertices[:, :2] / SIDE + 0.5
    look = TextureVisuals(uv=uv, material=PBRMaterial(baseColorTexture=picture()))
    return trimesh.Trimesh(vertices, faces, visual=look, process=False)


def picture() -> Image.Image:
    """Red grows with x, green with y."""
    grey = np.linspace(0, 255, 512)
    green, red = np.meshgrid(grey[::-1], grey, indexing="ij")
    return Image.fromarray(np.stack([red, green, 128 + 0 * red], axis=-1).astype(np.uint8))


def colour_at(points: np.ndarray) -> np.ndarray:
    """Red and green of the picture at places of the room, z up."""
    return 255 * (points[:, :2] / SIDE + 0.5)


def write_room(path: Path, mesh: trimesh.Trimesh) -> Path:
    """Write it y up, as ARKit's world is."""
    turned = mesh.copy()
    turned.vertices = np.asarray(mesh.vertices) @ T_ZUP_ARKIT[:3, :3]
    if path.suffix == ".obj":
        uv = mesh.visual.uv  # pyright: ignore[reportAttributeAccessIssue]
        turned.visual = TextureVisuals(uv=uv, material=SimpleMaterial(image=picture()))
    turned.export(path)
    return path


def write_room_of(film: ScanFilm, folder: Path) -> Path:
    """The room of a film in the phone's world: a box where the filmed thing stands, and another one."""
    both = room(((0.0, 0.0), (1.3, 1.2)))
    both.apply_transform(film.T_scan_object)
    return write_room(folder / "export.obj", both)


def write_room_usdz(folder: Path, mesh: trimesh.Trimesh) -> Path:
    """Write it as a package with its picture, y up, a unit of 1 cm."""
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils

    picture().save(folder / "room.png")
    stage = Usd.Stage.CreateNew(str(folder / "room.usdc"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    surface = UsdGeom.Mesh.Define(stage, "/room")
    points = 100 * np.asarray(mesh.vertices) @ T_ZUP_ARKIT[:3, :3]
    surface.CreatePointsAttr([Gf.Vec3f(*map(float, point)) for point in points])
    surface.CreateFaceVertexCountsAttr([3] * len(mesh.faces))
    surface.CreateFaceVertexIndicesAttr(mesh.faces.reshape(-1).tolist())
    kind = Sdf.ValueTypeNames
    st = UsdGeom.PrimvarsAPI(surface).CreatePrimvar("st", kind.TexCoord2fArray, "vertex")
    uv = mesh.visual.uv  # pyright: ignore[reportAttributeAccessIssue]
    st.Set([Gf.Vec2f(*map(float, place)) for place in uv])
    material = UsdShade.Material.Define(stage, "/look")
    shader = UsdShade.Shader.Define(stage, "/look/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    sampler = UsdShade.Shader.Define(stage, "/look/picture")
    sampler.CreateIdAttr("UsdUVTexture")
    sampler.CreateInput("file", kind.Asset).Set("./room.png")
    sampler.CreateOutput("rgb", kind.Float3)
    colour = shader.CreateInput("diffuseColor", kind.Color3f)
    colour.ConnectToSource(sampler.ConnectableAPI(), "rgb")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(surface.GetPrim()).Bind(material)
    stage.Save()
    path = folder / "room.usdz"
    UsdUtils.CreateNewUsdzPackage(str(folder / "room.usdc"), str(path))
    return path
