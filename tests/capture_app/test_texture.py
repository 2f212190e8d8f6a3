"""A textured object keeps its picture in the result, the film, the exports and the replay."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.render import RenderRequest
from capture_app.exports.export_sample import export_result
from capture_app.picture_bytes import decoded, encoded
from capture_app.pipeline import run_take
from capture_app.rendering import render_result
from capture_app.replay.scene_pack import pack_result
from capture_app.result import Result, load_result
from ingest.animated.detect import read_animation
from tests.capture_app.conftest import Inputs
from tests.textured_box import COLOURS, write_textured_box


@pytest.fixture
def made(inputs: Inputs, weights: Path) -> Result:
    box = write_textured_box(inputs.folder / "painted.obj")
    request = inputs.request(weights).model_copy(
        update={"object": box, "samples": 1, "force": True}
    )
    return run_take(request)


def test_the_result_keeps_the_picture(made: Result) -> None:
    texture = load_result(made.folder).object_motion.mesh.texture
    assert texture is not None
    assert set(map(tuple, COLOURS.tolist())) <= set(
        map(tuple, texture.image.reshape(-1, 3).tolist())
    )
    glb = trimesh.load_scene(made.folder / "motion.glb")
    thing = next(part for part in glb.geometry.values() if len(part.faces) == 12)
    np.testing.assert_array_equal(
        np.asarray(thing.visual.material.baseColorTexture.convert("RGB")), texture.image
    )


def test_it_is_drawn(made: Result, tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "still.png"
    render_result(RenderRequest(result=made.folder, output=path, still=1.0, size=(320, 240)))
    picture = np.asarray(Image.open(path).convert("RGB"), float)
    tint = picture / np.maximum(picture.max(axis=2, keepdims=True), 1)
    seen = [
        (np.abs(tint - colour / colour.max()).max(axis=2) < 0.1).sum() > 30 for colour in COLOURS
    ]
    assert sum(seen) >= 2


@pytest.mark.parametrize("kind", ["usda", "usdz"])
def test_usd_shows_it(made: Result, tmp_path: Path, kind: str) -> None:
    from pxr import Usd, UsdGeom, UsdShade

    file = tmp_path / f"take.{kind}"
    request = ExportRequest(result=made.folder, output=file, to=ExportFormat.usd)
    assert len(export_result(request).files) == (1 if kind == "usdz" else 2)
    stage = Usd.Stage.Open(str(file))
    sampler = UsdShade.Shader(stage.GetPrimAtPath("/take/materials/object/picture"))
    assert sampler.GetInput("file").Get().resolvedPath
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/take/object"))
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get()
    assert len(st) == len(mesh.GetPointsAttr().Get()) == 24


def test_the_replay_has_it(made: Result) -> None:
    pack = pack_result(load_result(made.folder), film=False)
    (length,) = struct.unpack_from("<I", pack)
    arrays = json.loads(pack[4 : 4 + length])["arrays"]
    assert arrays["object_uv"]["shape"] == [24, 2]
    assert arrays["object_png"]["dtype"] == "u1"


def test_a_photograph_becomes_a_jpeg() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (700, 700, 3), np.uint8)
    small = encoded(noise[:8, :8])
    assert (small.ending, small.mime) == ("png", "image/png")
    np.testing.assert_array_equal(decoded(small.data), noise[:8, :8])
    assert encoded(noise).ending == "jpg"


@pytest.mark.parametrize("kind", ["glb", "usda", "usdz"])
def test_an_animated_object_brings_its_picture_along(made: Result, tmp_path: Path, kind: str):
    file = made.folder / "motion.glb"
    if kind != "glb":
        file = tmp_path / f"take.{kind}"
        export_result(ExportRequest(result=made.folder, output=file, to=ExportFormat.usd))
    mesh = read_animation(file, "object").mesh
    assert mesh is not None
    before = load_result(made.folder).object_motion.mesh.texture
    assert mesh.texture is not None
    assert before is not None
    np.testing.assert_array_equal(mesh.texture.image, before.image)
    wanted = np.sort(before.uv.reshape(-1, 2) % 1.0, axis=0)
    there = np.sort(mesh.texture.uv.reshape(-1, 2) % 1.0, axis=0)
    np.testing.assert_allclose(there, wanted, atol=1e-5)
