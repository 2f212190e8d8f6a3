"""What stands on an edge is lighter to hold up the farther from that edge it is held."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.contact.static_stability import TippingLever, must_be_held, tipping_lever
from omomo_core.geometry.object_features import object_features
from omomo_core.motion import ObjectMesh, ObjectMotion

LONG, DEEP, HIGH = 1.2, 0.8, 0.3
FRAMES = 60


def _tipped(tilt: float, yaw: float = 0.0, frames: int = FRAMES) -> TippingLever | None:
    """A box that stands on its edge towards -x (in its own frame), raised at +x."""
    solid = trimesh.creation.box((LONG, DEEP, HIGH))
    c, s = np.cos(tilt), np.sin(tilt)
    raised = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    cy, sy = np.cos(yaw), np.sin(yaw)
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, :3] = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ raised
    T[:, 2, 3] = -(np.asarray(solid.vertices) @ T[0, 2, :3]).min()
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    take = object_features(ObjectMotion(mesh, T, np.ones(frames, bool)))
    return tipping_lever(take, must_be_held(take))


def _effort(found: TippingLever, x: float, z: float, held: bool = True) -> float:
    """Of two hands beside each other at a place in the box's frame."""
    place = np.array([[x, 0.2, z], [x, -0.2, z]])
    palms = np.broadcast_to(place, (1, len(found.frames), 2, 3))
    return float(found.effort(palms, np.full(palms.shape[:3], held))[0])


@given(tilt=st.floats(0.15, 0.6), yaw=st.floats(-3, 3))
@settings(max_examples=50)
def test_an_edge_is_raised_by_half_the_weight_from_the_other_edge(tilt: float, yaw: float):
    found = _tipped(tilt, yaw)
    assert found is not None
    assert len(found.frames) == FRAMES
    # Over the edge it stands on, the far lower corner is twice as far as the middle of the floor of
    # the box; its middle leans back by its height. The sole's 2 cm count as standing.
    out, back = LONG * np.cos(tilt), HIGH / 2 * np.sin(tilt)
    sole = 0.02 / np.tan(tilt)
    expected = (out / 2 - back - sole) / (out - sole)
    assert _effort(found, LONG / 2, -HIGH / 2) == pytest.approx(expected, abs=0.03)


@given(
    tilt=st.floats(0.1, 0.4),
    places=st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)).map(sorted),
)
@settings(max_examples=50)
def test_farther_out_is_never_heavier(tilt: float, places: list[float]):
    found = _tipped(tilt)
    assert found is not None
    near, far = (_effort(found, x, -HIGH / 2) for x in places)
    assert far <= near + 1e-9


def test_over_the_edge_it_stands_on_only_friction_helps():
    found = _tipped(0.3)
    assert found is not None
    top = HIGH * np.cos(0.3)
    at_the_edge = _effort(found, -LONG / 2, HIGH / 2)
    assert at_the_edge == pytest.approx(float(found.overhang.metres[0]) / (0.4 * top), rel=0.02)
    assert at_the_edge > 3 * _effort(found, LONG / 2, HIGH / 2)


def test_without_a_hand_there_is_no_effort():
    found = _tipped(0.3)
    assert found is not None
    assert np.isnan(_effort(found, 0.5, 0.0, held=False))


@pytest.mark.parametrize(("tilt", "frames"), [(0.0, FRAMES), (0.3, 10)])
def test_what_stands_flat_or_tips_for_a_moment_tells_nothing(tilt: float, frames: int):
    assert _tipped(tilt, frames=frames) is None


@pytest.mark.parametrize(("frames", "tells"), [(14, False), (15, True)])
def test_what_is_tipped_for_half_a_second_tells(frames: int, tells: bool):
    assert (_tipped(0.3, frames=frames) is not None) == tells
    found = _tipped(0.3)
    assert found is not None
    palms = np.zeros((1, FRAMES, 2, 3))
    held = np.broadcast_to((np.arange(FRAMES) < frames)[None, :, None], (1, FRAMES, 2))
    assert np.isfinite(found.effort(palms, held)[0]) == tells


def test_a_lever_is_two_centimetres_long_at_least():
    found = _tipped(0.3)
    assert found is not None
    below = found.overhang.edge[0] - 0.5
    place = below * found.overhang.direction[0] + found.overhang.floor[0] * found.overhang.up[0]
    palms = np.broadcast_to(place, (1, FRAMES, 2, 3))
    effort = found.effort(palms, np.ones((1, FRAMES, 2), bool))[0]
    assert effort == pytest.approx(found.overhang.metres[0] / 0.02, rel=1e-6)


def test_the_hand_with_the_longer_lever_counts():
    found = _tipped(0.3)
    assert found is not None
    far, near = (np.array([x, 0.0, -HIGH / 2]) for x in (0.5, 0.0))
    palms = np.broadcast_to(np.stack([near, far]), (1, FRAMES, 2, 3))
    both = found.effort(palms, np.ones((1, FRAMES, 2), bool))[0]
    one = np.broadcast_to([True, False], (1, FRAMES, 2))
    assert both == pytest.approx(_effort(found, 0.5, -HIGH / 2))
    assert found.effort(palms, one)[0] == pytest.approx(_effort(found, 0.0, -HIGH / 2))


def test_frames_without_a_hand_count_for_nothing():
    """The mean is over the frames in which somebody holds."""
    found = _tipped(0.3)
    assert found is not None
    place = np.array([[LONG / 2, 0.2, -HIGH / 2], [LONG / 2, -0.2, -HIGH / 2]])
    palms = np.broadcast_to(place, (1, len(found.frames), 2, 3))
    held = np.full(palms.shape[:3], True)
    always = found.effort(palms, held)[0]
    held[:, : FRAMES // 2] = False
    assert found.effort(palms, held)[0] == pytest.approx(always, rel=1e-6)
