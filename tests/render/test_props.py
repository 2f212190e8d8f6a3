"""Floor, trail, markers, and the helpers beneath them."""

import numpy as np
import pytest
import trimesh

from omomo_core.motion import ObjectMesh, ObjectMotion
from render.lettering import caption, time_code
from render.props import (
    CONTACT_COLOR,
    FREE_COLOR,
    LOST_COLOR,
    OBJECT_COLOR,
    contact_marker,
    floor,
    rigid_object,
    trail,
)
from render.raycast_backend import MipMaps
from render.scene import Scene, VertexNormals

CUBE = np.array(trimesh.creation.box((2.0, 2.0, 2.0)).vertices)
CUBE_FACES = np.array(trimesh.creation.box().faces)


def test_the_floor_encloses_the_motion_and_fades_into_the_background() -> None:
    ground = floor(np.array([-1.2, 0.4]), np.array([3.3, 5.0]))
    assert ground.vertices[:, 2].tolist() == [0, 0, 0, 0]
    assert (ground.vertices.min(axis=0)[:2] <= [-4.7, -3.1]).all()
    assert (ground.vertices.max(axis=0)[:2] >= [6.8, 8.5]).all()
    assert ground.texture is not None
    rim = np.concatenate([ground.texture[0], ground.texture[-1], ground.texture[:, 0]])
    assert np.abs(rim / 255.0 - Scene(()).background).max() < 0.01


def test_floor_lines_lie_on_whole_metres() -> None:
    ground = floor(np.zeros(2), np.array([4.0, 4.0]))
    assert ground.texture is not None
    low, high = ground.vertices[0, :2], ground.vertices[2, :2]

    def at(x: float, y: float) -> int:
        u, v = (np.array([x, y]) - low) / (high - low) * len(ground.texture)
        return int(ground.texture[int(v), int(u)].sum())

    assert at(2.0, 1.5) < at(1.6, 1.5) - 15
    assert at(1.5, 3.0) < at(1.5, 2.6) - 15
    assert at(1.5, 1.5) != at(2.5, 1.5)  # neighbouring tiles differ a little


def test_the_trail_grows_and_keeps_its_size() -> None:
    t = np.linspace(0, 6, 1500)
    path = np.stack([np.cos(t), np.sin(t), 0.2 * t], axis=1)
    path[300:400] = path[300]  # a pause
    actor = trail(path, radius=0.01)
    assert actor.vertices is not None
    for frame in (0, 1, 350, 700, 1499):
        vertices = actor.vertices(frame)
        assert vertices.shape == actor.drawable.vertices.shape
        nearest = np.linalg.norm(vertices[:, None] - path[None, : frame + 1 : 2], axis=-1).min(1)
        assert nearest.max() < 0.02
        assert np.linalg.norm(vertices - path[frame], axis=1).min() < 0.011
    normals = VertexNormals(actor.drawable.faces, len(actor.drawable.vertices))
    assert np.isfinite(normals(actor.vertices(0))).all()
    assert trail(path[:1]).vertices is not None


def test_markers_turn_green_with_contact() -> None:
    marker = contact_marker("left palm", np.zeros((3, 3)), np.array([0.0, 0.5, 1.0]))
    assert marker.color is not None
    assert np.allclose(marker.color[[0, 2]], [FREE_COLOR, CONTACT_COLOR])


def test_edges_of_an_object_stay_sharp() -> None:
    mesh = ObjectMesh(CUBE, CUBE_FACES, "cube")
    actor = rigid_object(ObjectMotion(mesh, np.tile(np.eye(4), (2, 1, 1)), np.array([True, False])))
    assert actor.color is not None
    assert np.allclose(actor.color, [OBJECT_COLOR, LOST_COLOR])
    drawable = actor.drawable
    normals = VertexNormals(drawable.faces, len(drawable.vertices))(drawable.vertices)
    assert np.allclose(np.abs(normals).max(axis=1), 1.0, atol=1e-6)
    corners = drawable.vertices[drawable.faces]
    outward = np.einsum("fx,fx->f", normals[drawable.faces[:, 0]], corners.mean(axis=1))
    assert (outward > 0).all()


def test_smooth_normals_of_a_ball_point_outward() -> None:
    ball = contact_marker("ball", np.zeros((1, 3)), np.zeros(1), radius=1.0).drawable
    normals = VertexNormals(ball.faces, len(ball.vertices))(ball.vertices)
    inner = np.abs(ball.vertices[:, 2]) < 0.95
    assert np.einsum("vx,vx->v", normals, ball.vertices)[inner].min() > 0.97


def test_mipmaps_return_texels_and_means() -> None:
    texture = np.random.default_rng(0).integers(0, 255, (8, 16, 3)).astype(np.uint8)
    maps = MipMaps(texture)
    uv = np.array([[(5 + 0.5) / 16, (2 + 0.5) / 8], [(5 + 0.5) / 16 + 3, (2 + 0.5) / 8 - 1]])
    near = maps.sample(uv, np.ones(2))
    assert near == pytest.approx(np.tile(texture[2, 5] / 255.0, (2, 1)), abs=1e-4)
    assert maps.sample(uv[:1], np.array([8.0]))[0] == pytest.approx(
        texture[:, 4:12].mean((0, 1)) / 255.0, abs=0.25
    )


def test_captions_write_on_a_copy() -> None:
    blank = np.full((270, 480, 3), 235, np.uint8)
    written = caption(blank, label="mop", seconds=75.04)
    assert (blank == 235).all()
    assert (written[:60, :120] < 150).any()
    assert (written[-40:, :120] < 150).any()
    assert [time_code(s) for s in (0.0, 0.3, 75.04, 600.0)] == [
        "0:00.0",
        "0:00.3",
        "1:15.0",
        "10:00.0",
    ]
