"""The GLB, read back with nothing but pygltflib, trimesh and the glTF specification."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from capture_app.exports.bones import strongest_influences
from capture_app.exports.glb import write_glb
from omomo_core.body.kinematics import full_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.motion import HumanMotion, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS

Reader = Any
"""GlbReader of the conftest."""
TOLERANCE = 1e-4


def y_up(points: np.ndarray) -> np.ndarray:
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


@pytest.fixture(scope="module")
def file(
    tmp_path_factory: pytest.TempPathFactory,
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
) -> Path:
    path = tmp_path_factory.mktemp("glb") / "motion.glb"
    write_glb(path, human, object_motion, body)
    return path


@pytest.fixture(scope="module")
def reader(file: Path, read_glb: Callable[[Path], Reader]) -> Reader:
    return read_glb(file)


@pytest.fixture(scope="module")
def posed(body: BodyModel, human: HumanMotion) -> np.ndarray:
    """All 52 joints, world, z up."""
    parts = (torch.from_numpy(x) for x in (human.root, human.rotations, human.fingers))
    return full_kinematics(body, *parts)[0].numpy()


def test_every_joint_is_where_the_motion_has_it(
    reader: Reader, human: HumanMotion, posed: np.ndarray
) -> None:
    frames = len(human.root)
    for j, name in enumerate(ALL_JOINTS):
        placed = reader.world(name, frames=frames)[:, :3, 3]
        np.testing.assert_allclose(placed, y_up(posed[:, j]), atol=TOLERANCE)
    for j in range(22):
        placed = reader.world(ALL_JOINTS[j], frames=frames)[:, :3, 3]
        np.testing.assert_allclose(placed, y_up(human.joints[:, j]), atol=TOLERANCE)
    for palm, name in ((22, "left_middle1"), (23, "right_middle1")):
        placed = reader.world(name, frames=frames)[:, :3, 3]
        # The palms of the 24 turn with the wrist: the base of a finger does too.
        np.testing.assert_allclose(placed, y_up(human.joints[:, palm]), atol=TOLERANCE)


def test_root_motion_is_on_the_pelvis(reader: Reader, human: HumanMotion) -> None:
    pelvis = reader.names["pelvis"]
    np.testing.assert_allclose(
        reader.track(pelvis, "translation"), y_up(human.root), atol=TOLERANCE
    )
    assert reader.gltf.skins[0].skeleton == pelvis
    assert pelvis in reader.gltf.scenes[0].nodes


def test_the_object_moves_as_recorded(reader: Reader, object_motion: ObjectMotion) -> None:
    T = reader.world("object", frames=len(object_motion.valid))
    vertices = object_motion.mesh.vertices
    placed = vertices @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    M = object_motion.T_world_object
    expected = vertices @ M[:, :3, :3].swapaxes(1, 2) + M[:, None, :3, 3]
    np.testing.assert_allclose(placed, y_up(expected), atol=TOLERANCE)


def test_key_frames_are_thirty_a_second_and_shared(reader: Reader, human: HumanMotion) -> None:
    (animation,) = reader.gltf.animations
    (times,) = {sampler.input for sampler in animation.samplers}
    np.testing.assert_allclose(
        reader.array(times)[:, 0], np.arange(len(human.root)) / 30.0, atol=1e-6
    )
    assert reader.gltf.accessors[times].max == [pytest.approx((len(human.root) - 1) / 30.0)]


def test_neighbouring_quaternions_never_flip(reader: Reader) -> None:
    for i in [*range(52), reader.names["object"]]:
        q = reader.track(i, "rotation")
        assert (np.sum(q[1:] * q[:-1], axis=1) > 0).all()
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-6)


def test_inverse_bind_matrices_undo_the_rest_pose(reader: Reader) -> None:
    skin = reader.gltf.skins[0]
    inverse = reader.array(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    for matrix, node in zip(inverse, skin.joints, strict=True):
        rest = reader.world(reader.gltf.nodes[node].name, animated=False)[0]
        np.testing.assert_allclose(rest @ matrix, np.eye(4), atol=1e-5)


def test_skinned_vertices_follow_their_bones(
    reader: Reader, body: BodyModel, human: HumanMotion
) -> None:
    """The specification's skinning sum, against the body's own with the same four influences."""
    frame = 17
    attributes = reader.gltf.meshes[0].primitives[0].attributes
    vertices = reader.array(attributes.POSITION).astype(float)
    joints, weights = reader.array(attributes.JOINTS_0), reader.array(attributes.WEIGHTS_0)
    skin = reader.gltf.skins[0]
    inverse = reader.array(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    frames = len(human.root)
    T = np.stack([reader.world(n, frames=frames)[frame] for n in ALL_JOINTS]) @ inverse
    points = np.concatenate([vertices, np.ones((len(vertices), 1))], axis=1)
    moved = np.einsum("vk,vkij,vj->vi", weights, T[joints], points)[:, :3]

    parts = (torch.from_numpy(x[frame]) for x in (human.root, human.rotations, human.fingers))
    placed, R = (x.double().numpy() for x in full_kinematics(body, *parts))
    rest = body.rest_joints.double().numpy()
    local = body.vertices.double().numpy()[:, None] - rest[joints]
    each = np.einsum("vkij,vkj->vki", R[joints], local) + placed[joints]
    np.testing.assert_allclose(moved, y_up((weights[..., None] * each).sum(1)), atol=TOLERANCE)


def test_four_influences_keep_the_strongest(body: BodyModel) -> None:
    joints, weights = strongest_influences(body)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert (joints[weights == 0] == 0).all()
    strongest = body.skin_joints[torch.arange(len(joints)), body.skin_weights.argmax(1)]
    assert (joints == strongest.numpy()[:, None]).any(axis=1).all()
    used = [set(j[w > 0]) for j, w in zip(joints, weights, strict=True)]
    assert all(len(s) == (w > 0).sum() for s, w in zip(used, weights, strict=True))


def test_accessors_declare_their_bounds(reader: Reader) -> None:
    for i, accessor in enumerate(reader.gltf.accessors):
        values = reader.array(i)
        np.testing.assert_array_equal(values.min(axis=0), np.float32(accessor.min))
        np.testing.assert_array_equal(values.max(axis=0), np.float32(accessor.max))
        assert np.isfinite(values).all()


def test_credit_travels_with_the_file(reader: Reader, body: BodyModel) -> None:
    assert reader.gltf.asset.extras["credit"] == body.credit
    assert reader.gltf.asset.generator.startswith("omocap ")


def test_trimesh_shows_the_object_at_its_first_pose(
    file: Path, object_motion: ObjectMotion
) -> None:
    scene = trimesh.load_scene(str(file))
    (node,) = [n for n in scene.graph.nodes_geometry if scene.graph[n][1] == "box"]
    T, geometry = scene.graph[node]
    loaded = trimesh.transform_points(scene.geometry[geometry].vertices, T)
    M = object_motion.T_world_object[0]
    expected = y_up(object_motion.mesh.vertices @ M[:3, :3].T + M[:3, 3])
    distance = np.linalg.norm(loaded[:, None] - expected, axis=-1)
    assert distance.min(axis=1).max() < TOLERANCE
    assert distance.min(axis=0).max() < TOLERANCE


def test_a_box_keeps_its_hard_edges(reader: Reader) -> None:
    attributes = reader.gltf.meshes[1].primitives[0].attributes
    normals = reader.array(attributes.NORMAL)
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1.0, atol=1e-5)


def test_the_same_motion_gives_the_same_bytes(
    tmp_path: Path, file: Path, human: HumanMotion, object_motion: ObjectMotion, body: BodyModel
) -> None:
    write_glb(tmp_path / "again.glb", human, object_motion, body)
    assert (tmp_path / "again.glb").read_bytes() == file.read_bytes()
