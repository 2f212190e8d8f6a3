"""Animated nodes of glTF files."""

import json

import numpy as np
import pytest
import trimesh
from pygltflib import Attributes, Mesh, Primitive, Skin
from scipy.spatial.transform import Rotation, Slerp

from ingest.animated.animated_take import to_animated_take
from ingest.animated.detect import read_animation

TIMES = [0.5, 1.5, 2.5]
AT = 0.5 + np.arange(61) / 30


def about_y(*degrees):
    return Rotation.from_rotvec(np.outer(np.radians(degrees), [0, 1, 0]))


def x_of(glb, path, mode, values, **rest):
    box = glb.node("Box", mesh=0)
    glb.move(box, "translation", rest.get("times", TIMES), values, mode)
    return read_animation(glb.write(path)).T_file_object[:, 0, 3]


def test_step_holds_each_key(glb, tmp_path):
    found = x_of(glb, tmp_path / "a.glb", "STEP", [[0, 0, 0], [2, 0, 0], [3, 0, 0]])
    np.testing.assert_allclose(found, np.where(AT < 1.5, 0, np.where(AT < 2.5, 2, 3)))


def test_linear_is_straight(glb, tmp_path):
    found = x_of(glb, tmp_path / "a.glb", "LINEAR", [[0, 0, 0], [2, 0, 0], [3, 0, 0]])
    np.testing.assert_allclose(found, np.interp(AT, TIMES, [0, 2, 3]), atol=1e-6)


def test_cubic_splines_are_hermite_curves(glb, tmp_path):
    """Tangents of t^3 - t: the curve is that polynomial exactly."""
    times = np.array([0.0, 0.75, 2.0])
    value, slope = times**3 - times, 3 * times**2 - 1
    triplets = np.zeros((9, 3))
    triplets[0::3, 0], triplets[1::3, 0], triplets[2::3, 0] = slope, value, slope
    found = x_of(glb, tmp_path / "a.glb", "CUBICSPLINE", triplets, times=times)
    at = np.arange(61) / 30
    np.testing.assert_allclose(found, at**3 - at, atol=1e-5)


def test_rotations_take_the_shorter_arc(glb, tmp_path):
    keys = about_y(0, 80, 200).as_quat()
    box = glb.node("Box", mesh=0)
    glb.move(box, "rotation", TIMES, keys * np.array([[1], [-1], [1]]))
    T = read_animation(glb.write(tmp_path / "a.glb")).T_file_object
    expected = Slerp(TIMES, Rotation.from_quat(keys))(AT).as_matrix()
    np.testing.assert_allclose(T[:, :3, :3], expected, atol=1e-6)


def test_cubic_rotations_are_normalised(glb, tmp_path):
    keys = about_y(0, 80, 120).as_quat()
    triplets = np.zeros((9, 4))
    triplets[1::3] = keys
    glb.move(glb.node("Box", mesh=0), "rotation", TIMES, triplets, "CUBICSPLINE")
    T = read_animation(glb.write(tmp_path / "a.glb")).T_file_object
    blend = Rotation.from_quat((keys[0] + keys[1]) / np.linalg.norm(keys[0] + keys[1]))
    np.testing.assert_allclose(T[15, :3, :3], blend.as_matrix(), atol=1e-6)


def test_parents_and_children_are_placed_as_by_trimesh(glb, tmp_path):
    """A still tree: where a pose is held, trimesh and this reader see the same points."""
    turn = Rotation.from_rotvec([0.3, -0.7, 0.2]).as_quat().tolist()
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec([1.0, 0.1, 0]).as_matrix() * 1.5
    matrix[:3, 3] = [0.1, 0.2, 0.3]
    leaf = glb.node("Leg", mesh=0, matrix=matrix.T.ravel().tolist())
    box = glb.node("Chair", mesh=0, scale=[1, 2, 0.5], children=[leaf])
    glb.node("World", translation=[1, 2, 3], rotation=turn, scale=[0.5] * 3, children=[box])
    glb.node("Floor", mesh=0)
    held = Rotation.from_rotvec([0, 0.4, 0.9]).as_quat()
    glb.move(box, "rotation", [0, 2], [held, held])
    glb.move(box, "translation", [0, 2], [[0.3, 0, 0], [0.3, 0, 1]])
    glb.gltf.nodes[box].rotation, glb.gltf.nodes[box].translation = held.tolist(), [0.3, 0, 0]
    path = glb.write(tmp_path / "a.glb")

    read = read_animation(path)
    T = read.T_file_object[0]
    found = read.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    scene = trimesh.load_scene(path)
    expected = np.concatenate(
        [
            scene.geometry[name].vertices @ M[:3, :3].T + M[:3, 3]
            for node in ("Chair", "Leg")
            for M, name in [scene.graph[node]]
        ]
    )
    ordered = [np.unique(points.round(5), axis=0) for points in (found, expected)]
    np.testing.assert_allclose(ordered[0], ordered[1], atol=2e-5)
    assert read.mesh.name == "Chair"
    # The parent's scale and turn carry the last key's metre.
    moved = read.T_file_object[-1, :3, 3] - T[:3, 3]
    np.testing.assert_allclose(moved, Rotation.from_quat(turn).apply([0, 0, 0.5]), atol=1e-6)


def test_a_mirrored_object_keeps_its_outside(glb, tmp_path):
    box = glb.node("Box", mesh=0, scale=[-1, 1, 1])
    glb.move(box, "translation", [0, 2], [[0, 0, 0], [1, 0, 0]])
    mesh = read_animation(glb.write(tmp_path / "a.glb")).mesh
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(0.048, rel=1e-5)


def test_the_object_is_what_moves_and_has_a_mesh(glb, tmp_path, refused):
    keys = [0, 2], [[0, 0, 0], [1, 0, 0]]
    glb.node("Floor", mesh=0)
    glb.move(glb.node("Camera"), "translation", *keys)
    glb.move(glb.node("Chair", mesh=0), "translation", *keys)
    path = glb.write(tmp_path / "a.glb")
    assert read_animation(path).mesh.name == "Chair"
    glb.move(glb.node("Table", mesh=0), "translation", *keys)
    glb.write(path)
    told = refused("node-ambiguous", read_animation, path)
    assert "Chair, Table" in told
    assert "‹node›" in told
    assert read_animation(path, "Table").mesh.name == "Table"
    assert read_animation(path, "Camera").mesh is None
    assert "Chair, Table" in refused("node-missing", read_animation, path, "Sofa")
    refused("animation-missing", read_animation, path, "Floor")


def test_an_unmoving_file_is_refused(glb, tmp_path, refused):
    glb.node("Chair", mesh=0)
    refused("animation-missing", read_animation, glb.write(tmp_path / "a.glb"))


def test_clips_of_the_same_node_are_not_mixed(glb, tmp_path, refused):
    glb.gltf.animations.append(type(glb.gltf.animations[0])(name="second"))
    child = glb.node("Chair", mesh=0)
    parent = glb.node("Pivot", children=[child])
    glb.move(child, "translation", [0, 2], [[0, 0, 0], [1, 0, 0]])
    glb.move(parent, "translation", [0, 2], [[0, 0, 0], [0, 1, 0]], clip=1)
    T = read_animation(glb.write(tmp_path / "a.glb"), "Chair").T_file_object
    np.testing.assert_allclose(T[-1, :3, 3], [1, 1, 0], atol=1e-6)
    glb.move(child, "rotation", [0, 2], [[0, 0, 0, 1]] * 2, clip=1)
    told = refused("animation-ambiguous", read_animation, glb.write(tmp_path / "b.glb"))
    assert "take, second" in told


def test_what_is_not_rigid_is_named(glb, tmp_path, refused):
    box = glb.node("Box", mesh=0)
    glb.move(box, "scale", [0, 1, 2], [[1, 1, 1], [1, 1, 1], [2, 1, 1]])
    assert "1.03 s" in refused("animation-stretched", read_animation, glb.write(tmp_path / "a.glb"))


@pytest.mark.parametrize(
    ("times", "values", "code"),
    [
        ([0, 1, 1], [[0, 0, 0, 1]] * 3, "time-backwards"),
        ([0, 2, 1], [[0, 0, 0, 1]] * 3, "time-backwards"),
        ([0, 1, 2], [[0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 1]], "quaternion-not-unit"),
        ([0, 1, 2], [[0, 0, 0, 1], [0, np.nan, 0, 1], [0, 0, 0, 1]], "pose-not-finite"),
        ([0, 1, 2], [[0, 0, 0, 1]] * 2, "gltf-keys"),
        ([0, 1, 1e6], [[0, 0, 0, 1]] * 3, "animation-long"),
    ],
)
def test_bad_keys_are_named(glb, tmp_path, refused, times, values, code):
    glb.move(glb.node("Box", mesh=0), "rotation", times, values)
    told = refused(code, read_animation, glb.write(tmp_path / "a.glb"))
    assert "a.glb" in told


def test_integers_and_sparse_values_are_read(glb, tmp_path):
    """Rotations may be packed into normalised 16 bit integers; vertices may be patched."""
    keys = about_y(0, 60, 90).as_quat()
    box = glb.node("Box", mesh=0)
    glb.move(box, "rotation", TIMES, keys)
    output = glb.gltf.accessors[-1]
    view = glb.gltf.bufferViews[output.bufferView]
    packed = np.round(keys * 32767).astype("<i2").tobytes()
    glb.data = glb.data[: view.byteOffset] + packed
    view.byteLength, output.componentType, output.normalized = len(packed), 5122, True
    T = read_animation(glb.write(tmp_path / "a.glb")).T_file_object
    expected = Slerp(TIMES, Rotation.from_quat(keys))(AT).as_matrix()
    np.testing.assert_allclose(T[:, :3, :3], expected, atol=2e-4)


@pytest.mark.parametrize("cut", [8, 30, 300, -40])
def test_damaged_files_are_refused(glb, tmp_path, refused, cut):
    glb.move(glb.node("Box", mesh=0), "translation", [0, 2], [[0, 0, 0], [1, 0, 0]])
    path = glb.write(tmp_path / "a.glb")
    path.write_bytes(path.read_bytes()[:cut])
    refused("gltf-unreadable", read_animation, path)


def test_loops_and_wild_indices_are_refused(glb, tmp_path, refused):
    box = glb.node("Box", mesh=0, children=[1])
    glb.node("Loop", children=[0])
    glb.move(box, "translation", [0, 2], [[0, 0, 0], [1, 0, 0]])
    refused("gltf-unreadable", read_animation, glb.write(tmp_path / "a.glb"))
    glb.gltf.nodes[1].children, glb.gltf.nodes[0].children = [], []
    glb.gltf.accessors[0].count = 10**12
    refused("gltf-unreadable", read_animation, glb.write(tmp_path / "b.glb"))


def test_data_in_other_files_or_by_unknown_extensions_is_refused(glb, tmp_path, refused):
    glb.move(glb.node("Box", mesh=0), "translation", [0, 2], [[0, 0, 0], [1, 0, 0]])
    glb.gltf.extensionsRequired = ["EXT_unheard_of"]
    told = refused("gltf-extension", read_animation, glb.write(tmp_path / "a.glb"))
    assert "EXT_unheard_of" in told
    text = {
        "asset": {"version": "2.0"},
        "nodes": [],
        "buffers": [{"uri": "../a.bin", "byteLength": 4}],
    }
    (tmp_path / "a.gltf").write_text(json.dumps(text))
    refused("gltf-external", read_animation, tmp_path / "a.gltf")


def _skinned(glb, *, own_keys: bool) -> None:
    """A box bent by two bones, of which one turns."""
    joints, weights = np.zeros((8, 4)), np.zeros((8, 4))
    joints[4:, 0], weights[:, 0] = 1, 1
    primitive = glb.gltf.meshes[0].primitives[0]
    primitive.attributes.JOINTS_0 = glb.add(joints.astype(np.uint32))
    glb.gltf.accessors[-1].componentType = 5125
    primitive.attributes.WEIGHTS_0 = glb.add(weights)
    bones = [glb.node("hip"), glb.node("knee")]
    glb.gltf.skins = [Skin(joints=bones)]
    skin = glb.node("Trousers", mesh=0, skin=0)
    for bone in (*bones, *([skin] if own_keys else [])):
        glb.move(bone, "rotation", TIMES, about_y(0, 40, 80).as_quat())


@pytest.mark.parametrize("wanted", [None, "Trousers"])
@pytest.mark.parametrize("own_keys", [True, False])
def test_a_skinned_mesh_is_no_moving_object(glb, tmp_path, refused, own_keys, wanted):
    _skinned(glb, own_keys=own_keys)
    file = glb.write(tmp_path / "a.glb")
    told = refused("animation-skinned", read_animation, file, wanted)
    assert "The mesh of 'Trousers' in a.glb is bent by bones" in told


def test_a_solid_thing_beside_a_skinned_one_is_the_object(glb, tmp_path):
    _skinned(glb, own_keys=False)
    glb.move(glb.node("Ball", mesh=1), "translation", TIMES, [[0, 0, 0], [1, 0, 0], [2, 0, 0]])
    position, indices = glb.gltf.meshes[0].primitives[0].attributes.POSITION, 1
    solid = Primitive(attributes=Attributes(POSITION=position), indices=indices)
    glb.gltf.meshes.append(Mesh(primitives=[solid]))
    found = read_animation(glb.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(found.T_file_object[:, 0, 3], AT - 0.5, atol=1e-6)


def test_what_is_not_rigid_on_the_object_is_said(glb, tmp_path):
    keys = [0, 2], [[0, 0, 0], [1, 0, 0]]
    attributes = glb.gltf.meshes[0].primitives[0].attributes
    bulge = Attributes(POSITION=attributes.POSITION)
    glb.gltf.meshes.append(
        Mesh(primitives=[Primitive(attributes=attributes, indices=1, targets=[bulge])])
    )
    lid = glb.node("Lid", mesh=1)
    drawer = glb.node("Drawer", mesh=0, translation=[0, 0, 5])
    chest = glb.node("Chest", mesh=0, children=[lid, drawer])
    glb.move(chest, "translation", *keys)
    plain = read_animation(glb.write(tmp_path / "a.glb"))
    assert plain.notes == ()
    glb.move(drawer, "translation", *keys)
    glb.move(lid, "weights", [0, 2], [0.0, 1.0])
    glb.gltf.scenes[0].nodes = [chest]
    found = read_animation(glb.write(tmp_path / "a.glb"), "Chest")
    shape, left_out = to_animated_take(found, None).notes[:2]
    assert "The shape of Lid changes" in shape
    assert left_out.endswith("was left out: Drawer.")
    assert len(found.mesh.faces) == len(plain.mesh.faces) - 12
