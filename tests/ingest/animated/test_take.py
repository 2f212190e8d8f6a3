"""From an animation to the object's motion over our floor."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from ingest.animated.animated_take import AnimatedTake, to_animated_take
from ingest.animated.animation import Animation
from omomo_core.motion import ObjectMesh

FRAMES = 61


@pytest.fixture
def box_file(tmp_path: Path) -> Path:
    trimesh.creation.box((0.4, 0.2, 0.6)).export(tmp_path / "box.obj")
    return tmp_path / "box.obj"


def lifted(height: float = 0.3) -> Animation:
    """A box 0.6 m high whose middle starts at the height, goes up 1 m and turns; z up."""
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    s = np.linspace(0, 1, FRAMES)
    T[:, :3, 3] = np.stack([2 + s, 0 * s, height + s], axis=1)
    T[:, :3, :3] = Rotation.from_rotvec(np.outer(s, [0, 0, 1.0])).as_matrix()
    return Animation(Path("lift.json"), T, np.ones(FRAMES, bool), "z")


def corners(take: AnimatedTake) -> np.ndarray:
    T = take.motion.T_world_object
    found = take.motion.mesh.vertices @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    return np.stack([found.min(axis=1), found.max(axis=1)])


def test_an_animation_over_its_floor_stays_where_it_is(box_file):
    made = lifted()
    take = to_animated_take(made, box_file)
    np.testing.assert_allclose(take.motion.T_world_object, made.T_file_object, atol=1e-9)
    assert take.segments == ((0, FRAMES),)
    assert take.floor.source == "lowest"
    assert take.notes == ()


@pytest.mark.parametrize("height", [-4.0, 1.1])
def test_the_lowest_point_is_the_floor_and_that_is_said(box_file, height):
    take = to_animated_take(lifted(height), box_file)
    assert corners(take)[0, :, 2].min() == pytest.approx(0, abs=1e-9)
    assert take.floor.height == pytest.approx(height - 0.3)
    assert "‹floor›" in take.notes[0]
    given = to_animated_take(lifted(1.1), box_file, floor=0.5)
    assert corners(given)[0, :, 2].min() == pytest.approx(0.3)
    assert given.notes == ()


def test_a_floor_above_the_object_is_refused(box_file, refused):
    told = refused("floor-above-object", to_animated_take, lifted(), box_file, floor=0.5)
    assert "0.00 to 0.87 s" in told
    assert "0.50 m below" in told


def test_y_up_worlds_are_turned(box_file, tmp_path):
    """An OBJ keeps its axes, a GLB is turned as load_mesh does: both show the same motion."""
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 1, 3] = 0.1 + np.linspace(0, 1, FRAMES)
    T[:, 2, 3] = np.linspace(0, 0.5, FRAMES)
    made = Animation(Path("a.glb"), T, np.ones(FRAMES, bool), "y")
    mesh = trimesh.load_mesh(box_file)
    mesh.export(tmp_path / "box.glb")
    own = ObjectMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), "box")
    takes = [
        to_animated_take(made, box_file),
        to_animated_take(made, tmp_path / "box.glb"),
        to_animated_take(replace(made, mesh=own), None),
    ]
    for take in takes:
        low, high = corners(take)
        np.testing.assert_allclose(high[0] - low[0], [0.4, 0.6, 0.2], atol=1e-6)
        np.testing.assert_allclose(low[-1] - low[0], [0, -0.5, 1.0], atol=1e-6)
        assert low[:, 2].min() == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(takes[2].motion.T_world_object[:, :3, :3], T[:, :3, :3], atol=1e-9)


def test_scale_is_of_the_whole_file_where_the_mesh_is_in_it(refused):
    box = trimesh.creation.box((40, 20, 60))
    made = lifted()
    made.T_file_object[:, :3, 3] *= 100
    made = replace(made, mesh=ObjectMesh(np.asarray(box.vertices), np.asarray(box.faces), "box"))
    assert "‹mesh_scale›" in refused("mesh-units", to_animated_take, made, None)
    take = to_animated_take(made, None, scale=0.01)
    np.testing.assert_allclose(take.motion.T_world_object, lifted().T_file_object, atol=1e-9)


def test_an_object_is_needed(refused):
    assert "‹object›" in refused("object-needed", to_animated_take, lifted(), None)


def test_what_nobody_does_is_refused(box_file, refused):
    made = lifted()
    short = Animation(made.source, made.T_file_object[:20], made.valid[:20], "z")
    refused("animation-short", to_animated_take, short, box_file)
    holes = replace(made, valid=np.arange(FRAMES) % 20 > 2)
    refused("animation-short", to_animated_take, holes, box_file)
    still = replace(made, T_file_object=np.repeat(made.T_file_object[:1], FRAMES, axis=0))
    refused("animation-still", to_animated_take, still, box_file)

    jump = made.T_file_object.copy()
    jump[30:, 0, 3] += 100
    told = refused(
        "animation-too-fast", to_animated_take, replace(made, T_file_object=jump), box_file
    )
    assert "frames 29 to 30" in told
    assert "centimetres" not in told
    large = made.T_file_object.copy()
    large[:, :3, 3] *= 100
    told = refused(
        "animation-too-fast", to_animated_take, replace(made, T_file_object=large), box_file
    )
    assert "centimetres" in told
    spun = made.T_file_object.copy()
    spun[31:, :3, :3] = Rotation.from_rotvec([0, 3.0, 0]).as_matrix()
    told = refused(
        "animation-too-fast", to_animated_take, replace(made, T_file_object=spun), box_file
    )
    assert "frames 30 to 31" in told


def test_what_is_unusually_fast_is_noted(box_file):
    made = lifted()
    made.T_file_object[:, 0, 3] += 3 * np.clip(np.arange(FRAMES) - 20, 0, 10) / 10
    take = to_animated_take(made, box_file)
    assert any("frames 20 to 30" in note for note in take.notes)


def test_gaps_split_the_take(box_file):
    made = lifted()
    take = to_animated_take(replace(made, valid=np.arange(FRAMES) != 30), box_file)
    assert take.segments == ((0, 30), (31, 61))
