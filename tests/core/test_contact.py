"""The paper's rule, and segments with anchors."""

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import inverse
from omomo_core.hand_stage.contact_rule import TOUCH, constrain
from omomo_core.hand_stage.segments import PALM_THICKNESS, hold
from omomo_core.motion import HandMotion, ObjectMesh

FRAMES = 90
BOX = trimesh.creation.box((0.4, 0.4, 0.4)).subdivide().subdivide().subdivide()
MESH = ObjectMesh(np.array(BOX.vertices), np.array(BOX.faces), "box")
SURFACE = sample_surface(MESH)


def moving_box(seed: int) -> np.ndarray:
    """A box that carries on along a smooth random path and turns."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, FRAMES)[:, None]
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, 3] = [0, 0, 1.0] + t * rng.normal(size=3) + 0.1 * np.sin(3 * t)
    T[:, :3, :3] = Rotation.from_rotvec(t * rng.normal(size=3)).as_matrix()
    return T


def in_object(palms: np.ndarray, T: np.ndarray) -> np.ndarray:
    T_object_world = inverse(T)
    return np.einsum("fij,fj->fi", T_object_world[:, :3, :3], palms) + T_object_world[:, :3, 3]


@given(seed=st.integers(0, 500), first=st.integers(1, FRAMES - 2))
@settings(max_examples=25, deadline=None)
def test_paper_rule_holds_from_the_first_touch_to_the_end(seed: int, first: int):
    T = moving_box(seed)
    palms = np.random.default_rng(seed).normal(size=(FRAMES, 2, 3)) + 5.0
    palms[first, 0] = T[first, :3, :3] @ (MESH.vertices[0] * 1.01) + T[first, :3, 3]
    out = constrain(palms, MESH.vertices, T)
    np.testing.assert_array_equal(out.palms[:first], palms[:first])
    np.testing.assert_array_equal(out.palms[:, 1], palms[:, 1])
    local = in_object(out.palms[:, 0], T)[first:]
    np.testing.assert_allclose(local, np.tile(local[0], (len(local), 1)), atol=1e-9)
    assert out.contact[:, 0].tolist() == [float(f >= first) for f in range(FRAMES)]
    assert TOUCH == 0.03


@given(seed=st.integers(0, 500))
@settings(max_examples=25, deadline=None)
def test_a_held_palm_rides_on_the_surface_and_is_free_again_afterwards(seed: int):
    T = moving_box(seed)
    side = np.array([0.25, 0.05, 0.0])
    palms = np.zeros((FRAMES, 2, 3))
    palms[:, 0] = T[:, :3, :3] @ side + T[:, :3, 3]
    palms[:, 1] = [3.0, 3.0, 1.0]
    contact = np.zeros((FRAMES, 2))
    contact[20:60, 0] = 1.0
    held, segments = hold(HandMotion(palms, contact), SURFACE, T, np.zeros(FRAMES, bool))
    assert [(s.hand, s.start, s.stop) for s in segments] == [(0, 20, 60)]
    local = in_object(held.palms[:, 0], T)[20:60]
    np.testing.assert_allclose(local, np.tile(segments[0].anchor, (40, 1)), atol=1e-9)
    assert abs(local[0, 0] - (0.2 + PALM_THICKNESS)) < 1e-3
    np.testing.assert_allclose(held.palms[75:, 0], palms[75:, 0])
    np.testing.assert_array_equal(held.palms[:, 1], palms[:, 1])


def test_a_flicker_is_bridged_and_a_touch_of_two_frames_is_not_a_hold():
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    palms = np.tile([0.25, 0.0, 0.0], (FRAMES, 2, 1))
    contact = np.zeros((FRAMES, 2))
    contact[10:50, 0] = 1.0
    contact[30:33, 0] = 0.0
    contact[70:72, 0] = 1.0
    _, segments = hold(HandMotion(palms, contact), SURFACE, T, np.zeros(FRAMES, bool))
    assert [(s.start, s.stop) for s in segments] == [(10, 50)]


def test_an_object_that_moves_is_held_by_the_likelier_hand():
    T = moving_box(3)
    palms = np.tile([0.25, 0.0, 0.0], (FRAMES, 2, 1)) + T[:, None, :3, 3]
    contact = np.tile([0.05, 0.3], (FRAMES, 1))
    held, segments = hold(HandMotion(palms, contact), SURFACE, T, np.ones(FRAMES, bool))
    assert {s.hand for s in segments} == {1}
    assert held.contact[:, 1].min() == 1.0
