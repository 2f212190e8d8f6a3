"""Which guesses of the palms hold an object as somebody would."""

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.selection.plausibility import PalmHolds, select_by_coverage
from omomo_core.generation.selection.selection_config import PLAUSIBILITY
from omomo_core.motion import ObjectMesh

FRAMES = 60
SIDE = 0.6


def _scene(turn: float) -> ObjectClip:
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
    return ObjectModel(mesh, 1.0).clip(T)


def _held(clip: ObjectClip, at: float, about: np.ndarray) -> torch.Tensor:
    """Somebody whose left palm is so far to the left of the box's middle, and the right to the right, as seen
    from a heading (radians, in the box) in each frame."""
    left = at * np.stack([-np.sin(about), np.cos(about), 0 * about], axis=-1)
    turned = np.einsum("fij,fj->fi", clip.trained.motion.T_world_object[:, :3, :3], left)
    palms = np.concatenate([turned, -turned, np.ones((FRAMES, 2))], axis=-1)
    return torch.from_numpy(palms).float()[None]


@given(turn=st.floats(-3, 3), heading=st.sampled_from([0.0, np.pi / 2, np.pi]))
@settings(max_examples=20)
def test_palms_that_stay_on_their_faces_are_likely_however_the_object_turns(
    turn: float, heading: float
):
    clip = _scene(turn)
    assert PalmHolds.of(_held(clip, SIDE / 2, np.full(FRAMES, heading)), clip).plausible.all()


def test_palms_in_the_middle_of_a_box_or_far_from_it_hold_nothing():
    clip = _scene(1.0)
    for at in (0.02, SIDE / 2 + 1.5 * PLAUSIBILITY.grasp_distance):
        assert not PalmHolds.of(_held(clip, at, np.zeros(FRAMES)), clip).plausible.any()


@given(switch=st.integers(10, FRAMES - 10))
@settings(max_examples=10)
def test_who_changes_sides_while_holding_is_left_out_unless_all_do(switch: int):
    clip = _scene(0.5)
    about = np.where(np.arange(FRAMES) < switch, 0.0, np.pi)
    changing, steady = _held(clip, SIDE / 2, about), _held(clip, SIDE / 2, np.zeros(FRAMES))
    assert not PalmHolds.of(changing, clip).plausible.any()
    kept = select_by_coverage(
        torch.cat([changing.repeat(6, 1, 1), steady.repeat(2, 1, 1)]), clip, 2
    )
    torch.testing.assert_close(kept, steady.repeat(2, 1, 1))
    assert len(select_by_coverage(changing.repeat(4, 1, 1), clip, 2)) == 2


@pytest.mark.parametrize(("off", "likely"), [(0.14, True), (0.165, False)])
def test_palms_within_fifteen_centimetres_of_the_surface_hold_it(off: float, likely: bool):
    clip = _scene(0.4)
    found = PalmHolds.of(_held(clip, SIDE / 2 + off, np.zeros(FRAMES)), clip)
    assert found.plausible.all() == likely
    near = PalmHolds.of(_held(clip, SIDE / 2, np.zeros(FRAMES)), clip)
    assert found.as_good_as(near).all() == likely


@pytest.mark.parametrize(("degrees", "likely"), [(58, True), (62, False)])
def test_the_line_between_two_palms_turns_by_sixty_degrees_at_most(degrees: float, likely: bool):
    """A cylinder: all around it the surface is as near. Half of the turn lies on each side of the mean."""
    solid = trimesh.creation.cylinder(SIDE / 2, 0.3, sections=64)
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 2, 3] = 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "drum")
    clip = ObjectModel(mesh, 1.0).clip(T)
    about = np.where(np.arange(FRAMES) < FRAMES / 2, -1.0, 1.0) * np.radians(degrees)
    assert PalmHolds.of(_held(clip, SIDE / 2, about), clip).plausible.all() == likely


@pytest.mark.parametrize(("frames", "likely"), [(6, True), (7, False)])
def test_palms_are_astray_for_a_moment_only(frames: int, likely: bool):
    """Half a turn for so many of nine frames is sixty degrees and more in their mean."""
    solid = trimesh.creation.cylinder(SIDE / 2, 0.3, sections=64)
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 2, 3] = 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "drum")
    clip = ObjectModel(mesh, 1.0).clip(T)
    about = np.zeros(FRAMES)
    about[20 : 20 + frames] = np.radians(90)
    mean = np.degrees(np.arctan2(frames, FRAMES - frames))
    found = (frames * (90 - mean) + (9 - frames) * mean) / 9
    assert (found < 60) == likely
    assert PalmHolds.of(_held(clip, SIDE / 2, about), clip).plausible.all() == likely


def test_one_hand_alone_has_no_line_and_free_hands_are_nowhere():
    clip = _scene(0.5)
    about = np.where(np.arange(FRAMES) < 30, 0.0, np.pi)
    one = _held(clip, SIDE / 2, about)
    one[..., 7] = -1.0
    assert PalmHolds.of(one, clip).plausible.all()
    free = _held(clip, 3.0, about)
    free[..., 6:] = -1.0
    assert (PalmHolds.of(free, clip).from_surface == 0).all()
