"""USD: a UsdSkel person with a skinned mesh, and the object as a mesh with a moving transform."""

from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from capture_app.commands.export import Units, UpAxis
from capture_app.exports.bones import creased
from capture_app.exports.exported_take import Skeleton, Take, pose_locals, rest_locals
from capture_app.exports.glb import BLUE, ORANGE
from capture_app.picture_bytes import encoded
from omomo_core.errors import InputError
from omomo_core.geometry.rotations import xyzw_from_matrix
from omomo_core.motion import Texture

_METRES: dict[Units, float] = {"m": 1.0, "cm": 0.01}
ROOT = "/take"
_Surface = tuple[Float[np.ndarray, "v 3"], Float[np.ndarray, "v 3"], Int[np.ndarray, "faces 3"]]
"""Vertices, normals, triangles."""


def write_usd(
    path: Path, take: Take, up: UpAxis, units: Units, picture: str = "object.png"
) -> None:
    """Write a stage: /take/person (SkelRoot) with skeleton, animation and body, and /take/object
    (a mesh that moves).

    The stage says its up axis, its unit and its frame rate; frame 0 is the first.

    Args:
        path: ending in .usd, .usdc (binary), .usda (text) or .usdz (packed).
        take: in the axes and units of the file.
        up: the take's.
        units: the take's.
        picture: name of the file with the object's texture. A usdz file holds it; beside a layer the
            caller writes it.

    Raises:
        InputError: usd-core is not installed.
        OSError: the file cannot be written.
    """
    stage = _stage(take, up, units)
    person = _pxr("UsdSkel").Root.Define(stage, f"{ROOT}/person")
    skeleton = _skeleton(stage, f"{ROOT}/person/skeleton", take.skeleton)
    _animation(stage, skeleton, take)
    _body(stage, f"{ROOT}/person/body", skeleton, take)
    _extent(person, take)
    _object(stage, f"{ROOT}/object", take, picture)
    _contacts(stage.GetPrimAtPath(f"{ROOT}/object"), take)
    try:
        _save(stage, path, take.mesh.texture, picture)
    except _pxr("Tf").ErrorException as error:
        raise OSError(str(error)) from error


def _save(stage: Any, path: Path, texture: Texture | None, picture: str) -> None:
    if path.suffix != ".usdz":
        stage.GetRootLayer().Export(str(path))
        return
    with TemporaryDirectory(dir=path.parent, prefix=".usdz_") as folder:
        layer = Path(folder, "take.usdc")
        stage.GetRootLayer().Export(str(layer))
        if texture is not None:
            Path(folder, picture).write_bytes(encoded(texture.image).data)
        asset = _pxr("Sdf").AssetPath(str(layer))
        _pxr("UsdUtils").CreateNewUsdzPackage(asset, str(path))


def _stage(take: Take, up: UpAxis, units: Units) -> Any:
    Usd, UsdGeom = _pxr("Usd"), _pxr("UsdGeom")
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, up.upper())
    UsdGeom.SetStageMetersPerUnit(stage, _METRES[units])
    stage.SetTimeCodesPerSecond(take.fps)
    stage.SetFramesPerSecond(take.fps)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(take.positions) - 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, ROOT).GetPrim())
    stage.GetRootLayer().documentation = f"omocap {version('omocap')}. Body: {take.credit}"
    return stage


def _skeleton(stage: Any, path: str, bones: Skeleton) -> Any:
    UsdSkel = _pxr("UsdSkel")
    skeleton = UsdSkel.Skeleton.Define(stage, path)
    skeleton.CreateJointsAttr(joint_paths(bones))
    local = rest_locals(bones)
    skeleton.CreateRestTransformsAttr(_matrices(local.positions, local.rotations))
    skeleton.CreateBindTransformsAttr(_matrices(bones.positions, bones.rotations))
    return skeleton


def joint_paths(bones: Skeleton) -> list[str]:
    """Joints as USD names them: the whole way from the root, in names without colons and dots."""
    make = _pxr("Tf").MakeValidIdentifier
    paths: list[str] = []
    for name, parent in zip(bones.names, bones.parents, strict=True):
        paths.append(make(name) if parent < 0 else f"{paths[parent]}/{make(name)}")
    return paths


def _animation(stage: Any, skeleton: Any, take: Take) -> None:
    UsdSkel, Vt, Gf = _pxr("UsdSkel"), _pxr("Vt"), _pxr("Gf")
    animation = UsdSkel.Animation.Define(stage, f"{skeleton.GetPath()}/animation")
    joints = len(take.skeleton.names)
    animation.CreateJointsAttr(skeleton.GetJointsAttr().Get())
    moves, turns = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    animation.CreateScalesAttr(Vt.Vec3hArray(joints, Gf.Vec3h(1)))
    local = pose_locals(take)
    wxyz = xyzw_from_matrix(local.rotations)[..., [3, 0, 1, 2]]
    for frame, (place, q) in enumerate(zip(local.positions, wxyz, strict=True)):
        moves.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(place, np.float32)), frame)
        turns.Set(Vt.QuatfArray([Gf.Quatf(*row) for row in q.tolist()]), frame)
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])


def _body(stage: Any, path: str, skeleton: Any, take: Take) -> None:
    skin, Vt = take.skin, _pxr("Vt")
    mesh = _mesh(stage, path, (skin.vertices, skin.normals, skin.faces), BLUE)
    binding = _pxr("UsdSkel").BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    joints = Vt.IntArray.FromNumpy(skin.joints.astype(np.int32).reshape(-1))
    weights = Vt.FloatArray.FromNumpy(skin.weights.astype(np.float32).reshape(-1))
    binding.CreateJointIndicesPrimvar(False, skin.joints.shape[1]).Set(joints)
    binding.CreateJointWeightsPrimvar(False, skin.weights.shape[1]).Set(weights)
    binding.CreateGeomBindTransformAttr(_pxr("Gf").Matrix4d(1))


def _extent(person: Any, take: Take) -> None:
    """Return a generous box around the person over the whole take, for programs that cull."""
    reach = np.ptp(take.skin.vertices, axis=0).max() / 2
    low, high = take.positions.min(axis=(0, 1)) - reach, take.positions.max(axis=(0, 1)) + reach
    person.CreateExtentAttr(_vectors(np.stack([low, high])))


def _object(stage: Any, path: str, take: Take, picture: str) -> None:
    """The mesh itself moves: programs that merge a transform into its only mesh keep the name."""
    UsdGeom, Gf = _pxr("UsdGeom"), _pxr("Gf")
    shown = creased(take.mesh)
    thing = _mesh(stage, path, (shown.vertices, shown.normals, shown.faces), ORANGE)
    if shown.uv is not None:
        _texture(stage, thing, shown.uv, picture)
    double, T = UsdGeom.XformOp.PrecisionDouble, take.T_world_object
    place, turn = thing.AddTranslateOp(double), thing.AddOrientOp(double)
    for frame, (x, q) in enumerate(
        zip(T[:, :3, 3].tolist(), xyzw_from_matrix(T[:, :3, :3]).tolist(), strict=True)
    ):
        place.Set(Gf.Vec3d(*x), frame)
        turn.Set(Gf.Quatd(q[3], *q[:3]), frame)


def _contacts(thing: Any, take: Take) -> None:
    """Lists of one length on the object: part, from and to in seconds, point in its frame (feet: 0)."""
    types, points = (
        _pxr("Sdf").ValueTypeNames,
        [np.zeros(3) if s.point is None else s.point for s in take.spans],
    )
    lists = {
        "part": (types.TokenArray, [span.part for span in take.spans]),
        "from": (types.DoubleArray, [span.start for span in take.spans]),
        "to": (types.DoubleArray, [span.stop for span in take.spans]),
        "point": (types.Point3fArray, _vectors(np.array(points).reshape(-1, 3))),
    }
    for name, (kind, values) in lists.items():
        thing.CreateAttribute(f"contacts:{name}", kind, True).Set(values)


def _mesh(stage: Any, path: str, surface: _Surface, colour: tuple[float, float, float]) -> Any:
    vertices, normals, faces = surface
    UsdGeom, Vt = _pxr("UsdGeom"), _pxr("Vt")
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(_vectors(vertices))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.astype(np.int32).reshape(-1)))
    mesh.CreateExtentAttr(_vectors(np.stack([vertices.min(axis=0), vertices.max(axis=0)])))
    mesh.CreateNormalsAttr(_vectors(normals))
    mesh.SetNormalsInterpolation("vertex")
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreateDisplayColorAttr([_pxr("Gf").Vec3f(*colour)])
    _paint(stage, f"{ROOT}/materials/{Path(path).name}", mesh, colour)
    return mesh


def _paint(stage: Any, path: str, mesh: Any, colour: tuple[float, float, float]) -> None:
    """A material: many programs show no displayColor."""
    UsdShade, Sdf = _pxr("UsdShade"), _pxr("Sdf")
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(_pxr("Gf").Vec3f(*colour))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.7)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _texture(stage: Any, mesh: Any, uv: Float[np.ndarray, "v 2"], picture: str) -> None:
    """The object's picture in place of its colour; USD counts texture coordinates from below."""
    UsdGeom, UsdShade, Sdf, Vt = _pxr("UsdGeom"), _pxr("UsdShade"), _pxr("Sdf"), _pxr("Vt")
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    )
    flat = np.ascontiguousarray(uv * [1.0, -1.0] + [0.0, 1.0], np.float32)
    st.Set(Vt.Vec2fArray.FromNumpy(flat))
    at = f"{ROOT}/materials/object"
    reader = UsdShade.Shader.Define(stage, f"{at}/st")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    sampler = UsdShade.Shader.Define(stage, f"{at}/picture")
    sampler.CreateIdAttr("UsdUVTexture")
    sampler.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./{picture}")
    for side in ("wrapS", "wrapT"):
        sampler.CreateInput(side, Sdf.ValueTypeNames.Token).Set("repeat")
    coordinates = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    sampler.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(coordinates)
    colour = sampler.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface = UsdShade.Shader.Get(stage, f"{at}/surface")
    surface.GetInput("diffuseColor").ConnectToSource(colour)


def _vectors(points: Float[np.ndarray, "n 3"]) -> Any:
    return _pxr("Vt").Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))


def _matrices(
    positions: Float[np.ndarray, "joints 3"], rotations: Float[np.ndarray, "joints 3 3"]
) -> Any:
    """USD's matrices act on rows: ours transposed."""
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, :3], T[:, 3, :3] = rotations.swapaxes(1, 2), positions
    return _pxr("Vt").Matrix4dArray([_pxr("Gf").Matrix4d(m) for m in T])


def _pxr(module: str) -> Any:
    try:
        return import_module(f"pxr.{module}")
    except ImportError:
        raise InputError(
            "usd-missing",
            "Writing USD needs a package that is not installed: usd-core.",
            where="‹to› usd",
            fix="Run pip install usd-core, or export ‹to› glb.",
        ) from None
