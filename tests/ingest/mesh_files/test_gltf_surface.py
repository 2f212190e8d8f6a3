"""What a glTF draws: every way in which it can give a box of 0.4 x 0.6 x 0.2 m, y up, from its middle."""

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from ingest.mesh import load_mesh
from ingest.scan.mesh_sources import read_scan_mesh
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh
from tests.ingest.mesh_files.glb_writer import Glb

SIDES = np.array([0.4, 0.6, 0.2])
BOX = trimesh.creation.box(SIDES)
VERTICES, FACES = np.asarray(BOX.vertices), np.asarray(BOX.faces)
VOLUME = float(np.prod(SIDES))


def is_the_box(mesh: ObjectMesh, atol: float = 1e-6) -> None:
    """The right size, z up, closed, its outside outside."""
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), SIDES[[0, 2, 1]], atol=atol)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert len(mesh.faces) == 12
    assert solid.is_watertight
    assert solid.volume == pytest.approx(VOLUME, rel=1e-2)


def simple(glb: Glb, **rest: Any) -> dict[str, Any]:
    return {
        "attributes": {"POSITION": glb.array(VERTICES), **rest},
        "indices": glb.array(FACES.ravel(), "u2"),
    }


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2"])
@pytest.mark.parametrize("normalized", [False, True])
def test_quantised_positions(tmp_path: Path, dtype: str, normalized: bool):
    glb = Glb()
    most = np.iinfo(dtype).max
    low, unit = (-1.0, 2.0) if dtype[0] == "u" else (0.0, 1.0)
    shape = VERTICES / 0.3  # -1 to 1
    stored = np.round((shape - low) / unit * most)
    position = glb.array(stored, dtype, normalized=normalized)
    scale = 0.3 * unit / (1 if normalized else most)
    mesh = glb.mesh(
        {"attributes": {"POSITION": position}, "indices": glb.array(FACES.ravel(), "u1")}
    )
    glb.node(mesh=mesh, scale=[scale] * 3, translation=[0.3 * low] * 3)
    glb.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    is_the_box(load_mesh(glb.write(tmp_path / "a.glb")), 5e-3)


@pytest.mark.parametrize("base", [False, True])
def test_sparse_positions(tmp_path: Path, base: bool):
    glb = Glb()
    primitive = simple(glb)
    accessor = glb.json["accessors"][primitive["attributes"]["POSITION"]]
    moved = np.arange(8) if not base else np.array([1, 4, 6])
    accessor["sparse"] = {
        "count": len(moved),
        "indices": {"bufferView": glb.view(moved.astype("u1").tobytes()), "componentType": 5121},
        "values": {"bufferView": glb.view(VERTICES[moved].astype("<f4").tobytes())},
    }
    if base:
        wrong = VERTICES.copy()
        wrong[moved] = 7
        accessor["bufferView"] = glb.view(wrong.astype("<f4").tobytes())
    else:
        del accessor["bufferView"]
    glb.node(mesh=glb.mesh(primitive))
    is_the_box(load_mesh(glb.write(tmp_path / "a.glb")))


@pytest.mark.parametrize("mode", ["strips", "fans", "no indices"])
def test_ways_to_name_triangles(tmp_path: Path, mode: str):
    glb = Glb()
    position = {"POSITION": glb.array(VERTICES)}
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    if mode == "no indices":
        primitives = [{"attributes": {"POSITION": glb.array(VERTICES[FACES].reshape(-1, 3))}}]
    elif mode == "fans":
        primitives = [
            {"attributes": position, "mode": 6, "indices": glb.array(quad, "u1")} for quad in quads
        ]
    else:  # one strip, its sides joined by triangles without area
        strip: list[int] = []
        for a, b, c, d in quads:
            strip += [*([strip[-1], a] if strip else []), a, b, d, c]
        primitives = [{"attributes": position, "mode": 5, "indices": glb.array(strip, "u2")}]
    points = {"attributes": position, "mode": 0}
    glb.json["meshes"] = [{"primitives": [*primitives, points]}]
    glb.node(mesh=0)
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh)
    assert any("lines or points" in note for note in mesh.notes)


@pytest.mark.parametrize("quantised", [False, True])
def test_instances(tmp_path: Path, quantised: bool):
    """Four copies at the corners, each turned by a quarter about y; one is a mirror."""
    glb = Glb()
    turn = Rotation.from_euler("y", 90, degrees=True).as_quat()
    at = np.array([[x, 0, z] for x in (-1, 1) for z in (-1, 1)], float)
    rotations = np.tile(turn, (4, 1))
    told = {
        "TRANSLATION": glb.array(at),
        "ROTATION": glb.array(np.round(rotations * 32767), "i2", normalized=True)
        if quantised
        else glb.array(rotations),
        "SCALE": glb.array([[1, 1, 1], [1, 1, 1], [1, 1, 1], [-1, 1, 1]]),
    }
    node = {"mesh": glb.mesh(simple(glb)), "translation": [0, 0.3, 0]}
    glb.node(**node, extensions={"EXT_mesh_gpu_instancing": {"attributes": told}})
    glb.json["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [2.2, 2.4, 0.6], atol=1e-3)
    assert len(mesh.faces) == 48
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(4 * VOLUME, rel=1e-3)
    assert "48 triangles from 4 instances" in mesh.notes


@pytest.mark.parametrize("weights", ["f4", "u1", "u2"])
def test_a_skin_is_where_its_joints_are(tmp_path: Path, weights: str):
    """The node's own transform counts for nothing; two joints, both at rest."""
    glb = Glb()
    bind = np.eye(4)
    bind[:3, 3] = [0.5, 0, 0]
    rest = np.linalg.inv(bind)
    most = 1 if weights == "f4" else np.iinfo(weights).max
    primitive = simple(
        glb,
        JOINTS_0=glb.array(np.tile([0, 1, 0, 0], (8, 1)), "u1"),
        WEIGHTS_0=glb.array(
            np.tile([most // 2 or 0.5, most - most // 2 if most > 1 else 0.5, 0, 0], (8, 1)),
            weights,
            **({} if most == 1 else {"normalized": True}),
        ),
    )
    matrices = glb.array([rest.T.ravel(), np.eye(4).ravel()])
    skinned = glb.node(mesh=glb.mesh(primitive), skin=0, scale=[9, 9, 9], translation=[5, 5, 5])
    arm = glb.node(translation=[0.5, 0, 0])
    root = glb.node(translation=[0, 0, 0])
    glb.json["skins"] = [{"joints": [arm, root], "inverseBindMatrices": matrices}]
    glb.json["scenes"] = [{"nodes": [skinned, arm, root]}]
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh)
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), 0, atol=1e-6)
    assert "skin applied in its rest pose" in mesh.notes


@pytest.mark.parametrize("where", ["mesh", "node"])
def test_morph_targets_by_their_resting_weights(tmp_path: Path, where: str):
    glb = Glb()
    primitive = simple(glb)
    primitive["attributes"]["POSITION"] = glb.array(VERTICES * [1, 0.5, 1])
    primitive["targets"] = [{"POSITION": glb.array(VERTICES * [0, 1, 0])}]
    mesh = glb.mesh(primitive, weights=[0.5 if where == "mesh" else 0.1])
    glb.node(mesh=mesh, **({} if where == "mesh" else {"weights": [0.5]}))
    is_the_box(load_mesh(glb.write(tmp_path / "a.glb")))


def test_hidden_coarse_and_other_scenes_are_not_drawn(tmp_path: Path):
    glb = Glb()
    mesh = glb.mesh(simple(glb))
    far = {"mesh": mesh, "translation": [3, 0, 0]}
    coarse = glb.node(**far)
    hidden = glb.node(**far, extensions={"KHR_node_visibility": {"visible": False}})
    other = glb.node(**far)
    box = glb.node(mesh=mesh, extensions={"MSFT_lod": {"ids": [coarse]}}, scale=[-1, 1, 1])
    glb.json["scenes"] = [{"nodes": [other]}, {"nodes": [box, hidden, coarse]}]
    glb.json["scene"] = 1
    glb.json["extensionsRequired"] = ["KHR_node_visibility"]
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh)
    assert "the default one of 2 scenes" in mesh.notes


def test_a_required_extension_that_is_not_known_is_named(tmp_path: Path):
    glb = Glb()
    glb.node(mesh=glb.mesh(simple(glb)))
    glb.json["extensionsUsed"] = glb.json["extensionsRequired"] = ["EXT_unheard_of"]
    path = glb.write(tmp_path / "a.glb")
    for read in (load_mesh, read_scan_mesh):
        with pytest.raises(InputError, match="EXT_unheard_of") as caught:
            read(path)
        assert caught.value.code == "gltf-extension"
    del glb.json["extensionsRequired"]
    assert "without what EXT_unheard_of may add" in load_mesh(glb.write(path)).notes
    glb.json["asset"]["version"] = "1.0"
    with pytest.raises(InputError, match=r"glTF 1\.0"):
        load_mesh(glb.write(path))


def _meshopt(glb: Glb, values: np.ndarray, mode: str, name: str) -> int:
    meshopt = pytest.importorskip("meshopt")
    packed = meshopt.encode_gltf_buffer(values, mode)
    told = {
        "buffer": 0,
        "byteOffset": len(glb.data) + -len(glb.data) % 4,
        "byteLength": len(packed),
        "byteStride": values.itemsize * (values.size // len(values)),
        "count": len(values),
        "mode": mode,
    }
    glb.view(bytes(packed))
    view = {"buffer": 1, "byteLength": told["byteStride"] * len(values), "extensions": {name: told}}
    glb.json["bufferViews"].append(view)
    glb.json["buffers"] = [{}, {"byteLength": 10**6, "extensions": {name: {"fallback": True}}}]
    return len(glb.json["bufferViews"]) - 1


def _packed_by_meshopt(glb: Glb, name: str) -> None:
    rows = np.zeros((8, 4), "<i2")
    rows[:, :3] = np.round(VERTICES / 0.3 * 32767)
    view = _meshopt(glb, rows, "ATTRIBUTES", name)
    glb.json["bufferViews"][view]["byteStride"] = 8
    position = {"bufferView": view, "componentType": 5122, "count": 8, "type": "VEC3"}
    indices = {
        "bufferView": _meshopt(glb, FACES.ravel().astype("<u2"), "TRIANGLES", name),
        "componentType": 5123,
        "count": 36,
        "type": "SCALAR",
    }
    glb.json["accessors"] = [{**position, "normalized": True}, indices]
    glb.node(mesh=glb.mesh({"attributes": {"POSITION": 0}, "indices": 1}), scale=[0.3] * 3)
    glb.json["extensionsUsed"] = glb.json["extensionsRequired"] = [name, "KHR_mesh_quantization"]


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_is_unpacked(tmp_path: Path, name: str):
    glb = Glb()
    _packed_by_meshopt(glb, name)
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh, 1e-4)
    assert f"decompressed ({name})" in mesh.notes


def _packed_by_draco(glb: Glb) -> None:
    draco = pytest.importorskip("DracoPy")
    packed = draco.encode(VERTICES.astype("f4"), FACES.astype("u4"), quantization_bits=16)
    told = {"bufferView": glb.view(packed), "attributes": {"POSITION": 0}}
    glb.json["accessors"] = [
        {"componentType": 5126, "count": 8, "type": "VEC3"},
        {"componentType": 5123, "count": 36, "type": "SCALAR"},
    ]
    extensions = {"KHR_draco_mesh_compression": told}
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "extensions": extensions}
    glb.node(mesh=glb.mesh(primitive))
    glb.json["extensionsUsed"] = glb.json["extensionsRequired"] = list(extensions)


def test_draco_is_unpacked(tmp_path: Path):
    glb = Glb()
    _packed_by_draco(glb)
    is_the_box(load_mesh(glb.write(tmp_path / "a.glb")), 1e-4)


@pytest.mark.parametrize(
    ("module", "pack", "name"),
    [
        ("DracoPy", _packed_by_draco, "KHR_draco_mesh_compression"),
        ("meshopt", lambda glb: _packed_by_meshopt(glb, "EXT_meshopt_compression"), "EXT_meshopt"),
    ],
)
def test_compression_without_its_decoder_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, pack: Any, name: str
):
    glb = Glb()
    pack(glb)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=name) as caught:
        load_mesh(glb.write(tmp_path / "a.glb"))
    assert caught.value.code == "gltf-compressed"
    assert "omocap[compressed]" in caught.value.fix
    assert "without compression" in caught.value.fix


def _picture(glb: Glb, kind: str = "PNG") -> int:
    """Four pixels: red, green above blue, white."""
    pixels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
    encoded = io.BytesIO()
    Image.fromarray(pixels).save(encoded, kind, **({"lossless": True} if kind == "WEBP" else {}))
    glb.json["images"] = [{"bufferView": glb.view(encoded.getvalue()), "mimeType": "image/png"}]
    return 0


@pytest.mark.parametrize("dtype", ["f4", "u2"])
def test_places_on_the_picture_are_transformed(tmp_path: Path, dtype: str):
    """All corners lie on green after a turn by a quarter, a scale and an offset, in TEXCOORD_1."""
    glb = Glb()
    wanted = np.tile([0.75, 0.25], (8, 1))
    # scale 2, then a quarter against the clock with v down: (u, v) -> (v, -u), then the offset.
    turned = wanted - [0.5, 0.5]
    stored = np.stack([-turned[:, 1], turned[:, 0]], axis=1) / 2
    told = {"scale": [2, 2], "rotation": np.pi / 2, "offset": [0.5, 0.5], "texCoord": 1}
    uv = glb.array(
        stored * (1 if dtype == "f4" else 65535),
        dtype,
        **({"normalized": True} if dtype == "u2" else {}),
    )
    zero = glb.array(np.zeros((8, 2)))
    _picture(glb, "WEBP")
    glb.json["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    texture = {"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": told}}
    glb.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": texture}}]
    glb.node(mesh=glb.mesh({**simple(glb, TEXCOORD_0=zero, TEXCOORD_1=uv), "material": 0}))
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh)
    assert mesh.texture is not None
    np.testing.assert_allclose(mesh.texture.uv, np.broadcast_to(wanted[0], (12, 3, 2)), atol=1e-4)
    np.testing.assert_array_equal(mesh.texture.image[0, 1], [0, 255, 0])


def test_a_picture_that_is_not_read_is_told(tmp_path: Path):
    glb = Glb()
    glb.json["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    glb.json["materials"] = [material]
    uv = glb.array(np.zeros((8, 2)))
    glb.node(mesh=glb.mesh({**simple(glb, TEXCOORD_0=uv), "material": 0}))
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    is_the_box(mesh)
    assert mesh.texture is None
    assert any("KTX2" in note for note in mesh.notes)


@pytest.mark.parametrize(("dtype", "half"), [("f4", 0.21586), ("u1", 55), ("u2", 14147)])
def test_colours_of_vertices_are_linear(tmp_path: Path, dtype: str, half: float):
    glb = Glb()
    colours = np.tile([half, 0, 0], (8, 1))
    whole = {} if dtype == "f4" else {"normalized": True}
    glb.node(mesh=glb.mesh(simple(glb, COLOR_0=glb.array(colours, dtype, **whole))))
    mesh = read_scan_mesh(glb.write(tmp_path / "a.glb"))
    assert mesh.colours is not None
    np.testing.assert_array_equal(np.unique(mesh.colours, axis=0), [[128, 0, 0]])


@pytest.mark.parametrize("shade", [1.0, 0.5])
def test_colours_over_a_picture_are_told_where_they_change_it(tmp_path: Path, shade: float):
    glb = Glb()
    _picture(glb)
    glb.json["textures"] = [{"source": 0}]
    base = {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.3, 0.3, 0.3, 1]}
    glb.json["materials"] = [{"pbrMetallicRoughness": base}]
    uv, colours = glb.array(np.zeros((8, 2))), glb.array(np.full((8, 3), shade))
    glb.node(mesh=glb.mesh({**simple(glb, TEXCOORD_0=uv, COLOR_0=colours), "material": 0}))
    mesh = load_mesh(glb.write(tmp_path / "a.glb"))
    assert mesh.texture is not None
    said = "colours of vertices over a picture left out" in mesh.notes
    assert said == (shade < 1)


def test_many_copies_are_counted_before_they_are_made(tmp_path: Path):
    glb = Glb()
    told = {"TRANSLATION": glb.array(np.zeros((200_000, 3)))}
    node = {"mesh": glb.mesh(simple(glb))}
    glb.node(**node, extensions={"EXT_mesh_gpu_instancing": {"attributes": told}})
    with pytest.raises(InputError, match="2,400,000 triangles"):
        load_mesh(glb.write(tmp_path / "a.glb"))


@pytest.mark.parametrize(
    "harm",
    [
        lambda j: j["nodes"][0].update(children=[0]),
        lambda j: j["nodes"][0].update(mesh=-1),
        lambda j: j["accessors"][0].update(count=10**12),
        lambda j: j["accessors"][0].update(count=9),
        lambda j: j["accessors"][1].update(byteOffset=-4),
        lambda j: j["bufferViews"][0].update(byteLength=10**9),
        lambda j: j["meshes"].append(None) or j["nodes"][0].update(mesh=1),
    ],
)
def test_damaged_descriptions_are_refused(tmp_path: Path, harm: Any):
    glb = Glb()
    glb.node(mesh=glb.mesh(simple(glb)))
    harm(glb.json)
    with pytest.raises(InputError) as caught:
        load_mesh(glb.write(tmp_path / "a.glb"))
    assert caught.value.code in ("mesh-unreadable", "mesh-empty")
