"""painted: the picture on a USD mesh that has a UsdPreviewSurface with a UsdUVTexture."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from PIL import Image

from ingest.mesh_texture import Paint, pixels_of
from ingest.usd import pxr


def painted(
    prim: Any, faces: Int[np.ndarray, "faces 3"], corners: Int[np.ndarray, "faces 3"]
) -> Paint:
    """Places of the triangles' corners on the picture, and the picture.

    Two times None where the mesh has no picture, several materials, or a picture that cannot be read:
    it shapes no motion.

    Args:
        prim: of the mesh.
        faces: which points are the corners of its triangles.
        corners: which of the polygons' corners these are.
    """
    found = picture_on(prim, faces, corners)
    try:
        return (None, None) if found is None else (found[0], pixels_of(found[1]))
    except Exception:  # the decoders raise anything on a damaged picture
        return None, None


def picture_on(
    prim: Any, faces: Int[np.ndarray, "faces 3"], corners: Int[np.ndarray, "faces 3"]
) -> tuple[Float[np.ndarray, "faces 3 2"], Image.Image] | None:
    """The same with a picture that is not decoded yet."""
    try:
        sampler = _sampler(prim)
        places = None if sampler is None else _places(prim, sampler, faces, corners)
        if sampler is None or places is None:
            return None
        # USD counts from the bottom left.
        return places * [1.0, -1.0] + [0.0, 1.0], Image.open(BytesIO(_bytes(sampler)))
    except Exception:  # the decoders raise anything on a damaged file
        return None


def _sampler(prim: Any) -> Any:
    """The shader that reads the picture of the diffuse colour."""
    shade = pxr("UsdShade")
    material = shade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    surface = material.ComputeSurfaceSource()[0] if material else None
    colour = surface.GetInput("diffuseColor") if surface else None
    if not colour or not colour.HasConnectedSource():
        return None
    found = shade.Shader(colour.GetConnectedSource()[0].GetPrim())
    return found if found.GetIdAttr().Get() == "UsdUVTexture" else None


def _places(prim: Any, sampler: Any, faces: np.ndarray, corners: np.ndarray) -> np.ndarray | None:
    """Texture coordinates of the triangles' corners."""
    geom, name = pxr("UsdGeom"), "st"
    where = sampler.GetInput("st")
    if where and where.HasConnectedSource():
        reader = pxr("UsdShade").Shader(where.GetConnectedSource()[0].GetPrim())
        told = reader.GetInput("varname")
        name = str(told.Get()) if told and told.Get() else name
    primvar = geom.PrimvarsAPI(prim).GetPrimvar(name)
    if not primvar.HasValue():
        return None
    values = np.array(primvar.ComputeFlattened(), np.float64)
    whole = primvar.GetInterpolation() == geom.Tokens.faceVarying
    return values[corners if whole else faces]


def _bytes(sampler: Any) -> bytes:
    """The picture's file, which lies in the stage's or in its folder."""
    asset = sampler.GetInput("file").Get()
    stage = Path(sampler.GetPrim().GetStage().GetRootLayer().realPath).resolve()
    file = Path(asset.resolvedPath.partition("[")[0]).resolve()
    if not file.is_relative_to(stage.parent):
        raise ValueError(f"{file} lies elsewhere")
    ar = pxr("Ar")
    opened = ar.GetResolver().OpenAsset(ar.ResolvedPath(asset.resolvedPath))
    return bytes(opened.GetBuffer())
