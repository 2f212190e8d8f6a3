"""Which guesses of the palms hold an object as somebody would."""

import numpy as np
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.cover import of_many
from omomo_core.generation.holding import GRASP, Holding
from omomo_core.generation.scene import Scene, Thing
from omomo_core.motion import ObjectMesh

FRAMES = 60
SIDE = 0.6


def _scene(turn: float) -> Scene:
    """A box that turns about the upright line by so many radians in all, in the air."""
    solid = trimesh.creation.box((SIDE, SIDE, SIDE))
    T = np.stack(
        [
            trimesh.transformations.rotation_matrix(a, (0, 0, 1))
            for a in np.linspace(0, turn, FRAMES)
        ]
    )
    T[:, 2, 3] = 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return Thing(mesh, 1.0).scene(T)


def _held(scene: Scene, at: float, about: np.ndarray) -> torch.Tensor:
    """Somebody whose left palm is so far to the left of the box's middle, and the right to the right, as seen
    from a heading (radians, in the box) in each frame."""
    left = at * np.stack([-np.sin(about), np.cos(about), 0 * about], axis=-1)
    turned = np.einsum("fij,fj->fi", scene.trained.motion.T_world_object[:, :3, :3], left)
    palms = np.concatenate([turned, -turned, np.ones((FRAMES, 2))], axis=-1)
    return torch.from_numpy(palms).float()[None]


@given(turn=st.floats(-3, 3), heading=st.sampled_from([0.0, np.pi / 2, np.pi]))
@settings(max_examples=20, deadline=None)
def test_palms_that_stay_on_their_faces_are_likely_however_the_object_turns(
    turn: float, heading: float
):
    scene = _scene(turn)
    assert Holding.of(_held(scene, SIDE / 2, np.full(FRAMES, heading)), scene).likely.all()


def test_palms_in_the_middle_of_a_box_or_far_from_it_hold_nothing():
    scene = _scene(1.0)
    for at in (0.02, SIDE / 2 + 1.5 * GRASP):
        assert not Holding.of(_held(scene, at, np.zeros(FRAMES)), scene).likely.any()


@given(switch=st.integers(10, FRAMES - 10))
@settings(max_examples=10, deadline=None)
def test_who_changes_sides_while_holding_is_left_out_unless_all_do(switch: int):
    scene = _scene(0.5)
    about = np.where(np.arange(FRAMES) < switch, 0.0, np.pi)
    changing, steady = _held(scene, SIDE / 2, about), _held(scene, SIDE / 2, np.zeros(FRAMES))
    assert not Holding.of(changing, scene).likely.any()
    kept = of_many(torch.cat([changing.repeat(6, 1, 1), steady.repeat(2, 1, 1)]), scene, 2)
    torch.testing.assert_close(kept, steady.repeat(2, 1, 1))
    assert len(of_many(changing.repeat(4, 1, 1), scene, 2)) == 2
