"""Somebody whose first pose is known: guesses that begin like it, from whatever side."""

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.conditioning import Conditioning, start_constraint
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.selection.plausibility import stands_in_front
from omomo_core.generation.selection.selection_config import START
from omomo_core.generation.selection.start_constraint import (
    StartPose,
    StartPosition,
    impose_start,
    select_by_start,
    standing_position,
)
from omomo_core.motion import ObjectMesh

FRAMES = 90


def _guess(side: float, takes: int, apart: float = 0.4) -> torch.Tensor:
    """Somebody who comes along x from that side of a box, and holds it from a frame on."""
    x = side * torch.cat([torch.linspace(1.2, 0.2, takes), torch.full((FRAMES - takes,), 0.2)])
    y = torch.full((FRAMES,), side * apart / 2)
    z = torch.zeros(FRAMES)
    contact = torch.where(torch.arange(FRAMES) < takes, -1.0, 1.0)
    return torch.stack([x, -y, z, x, y, z, contact, contact], dim=-1)


def _distance(samples: torch.Tensor, place: torch.Tensor) -> float:
    """How far from a place on the floor the only sample begins, metres."""
    return float((standing_position(samples[:, 0]) - place).norm())


def _box() -> ObjectClip:
    solid = trimesh.creation.box((0.4, 0.4, 0.4))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 2, 3] = 0.2
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return ObjectModel(mesh, 1.0).clip(T)


@given(
    start=st.lists(st.floats(-2, 2), min_size=6, max_size=6),
    takes=st.integers(0, FRAMES - 1),
    side=st.sampled_from([-1.0, 1.0]),
)
@settings(max_examples=50)
def test_palms_go_from_the_known_start_to_what_they_hold(
    start: list[float], takes: int, side: float
):
    guess = _guess(side, max(takes, 2))[None]
    wanted = torch.tensor([*start, -1.0, -1.0])
    x = impose_start(guess, wanted)
    torch.testing.assert_close(x[0, 0], wanted)
    there = min(max(takes, 2, START.shortest_blend), START.longest_blend)
    torch.testing.assert_close(x[0, there:], guess[0, there:])
    # No jump on the way: the way that is added is spread over all of its frames.
    added = (x - guess)[0, :, :6].diff(dim=0).abs().max(dim=0).values
    longest = (wanted - guess[0, 0])[:6].abs()
    assert (added <= 1.6 * longest / START.shortest_blend + 1e-5).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("samples", [1, 6])
def test_guesses_that_begin_at_the_known_start_are_kept(side: float, samples: int):
    """Guesses stand on either side, and the known start tells which of them count."""
    torch.manual_seed(0)
    guesses = torch.stack([_guess((-1.0) ** k, 40 + k) for k in range(18)])
    guesses[..., :6] += 0.01 * torch.randn(18, FRAMES, 6)
    start = _guess(side, 45)[0]
    x = select_by_start(guesses, StartPose(start, torch.tensor([1.5 * side, 0.0])), _box(), samples)
    assert x.shape == (samples, FRAMES, 8)
    torch.testing.assert_close(x[:, 0], start.expand(samples, 8))
    on_the_way = x[:, 30, :6].unflatten(-1, (2, 3))
    assert (side * on_the_way[..., 0] > 0.25).all()
    # The left hand is on the left of who faces the box.
    left, right = on_the_way.unbind(dim=-2)
    assert (torch.linalg.cross(left, right)[..., 2] > 0).all()


@pytest.mark.parametrize("holds", [True, False])
def test_palms_of_a_known_pose_select_guesses_only_where_they_hold(holds: bool):
    torch.manual_seed(0)
    low = _guess(1.0, 0).repeat(8, 1, 1)
    low[..., :6] += 0.01 * torch.randn(8, FRAMES, 6)
    high = low.clone()
    high[..., 2:6:3] += 0.15
    start = low[0, 0].clone()
    start[6:] = 1.0 if holds else -1.0
    pose = StartPose(start, torch.tensor([1.2, 0.0]))
    heights = select_by_start(torch.cat([low, high]), pose, _box(), 4)[:, -1, 2]
    assert bool((heights < 0.1).all()) == holds


def test_palms_that_a_pose_leaves_no_time_for_are_taken_only_where_all_are_so():
    torch.manual_seed(0)
    late, soon = (_guess(1.0, takes).repeat(6, 1, 1) for takes in (50, 12))
    for guesses in (late, soon):
        guesses[..., :6] += 0.01 * torch.randn(6, FRAMES, 6)
    start = late[0, 0].clone()
    start[[1, 4]] += 0.9  # so far aside
    pose = StartPose(start, torch.tensor([1.3, 0.0]))
    holding = select_by_start(torch.cat([soon, late]), pose, _box(), 4)[:, 30, 6:] > 0
    assert not holding.any()
    assert (select_by_start(soon, pose, _box(), 4)[:, 30, 6:] > 0).all()


@given(
    side=st.sampled_from([-1.0, 1.0]),
    x=st.floats(-2.5, 2.5),
    y=st.floats(-2.5, 2.5),
    takes=st.integers(2, FRAMES - 1),
)
@settings(max_examples=50)
def test_somebody_comes_from_where_they_stood_no_faster_than_people_walk(
    side: float, x: float, y: float, takes: int
):
    guess, place = _guess(side, takes)[None], torch.tensor([x, y])
    start = StartPosition(place)
    came = start.impose(guess)
    assert _distance(came, place) <= _distance(guess, place) + 1e-4
    added = (came - guess)[0, :, :6].unflatten(-1, (2, 3))
    assert (
        added.diff(dim=0).norm(dim=-1).max() * 30
        <= START.fastest_blend * max(1, START.shortest_blend / takes) + 0.05
    )
    near = torch.tensor([side * (1.2 + START.idle_reach), 0.0])
    if (place - near).norm() < START.fastest_blend / 1.5 * min(takes, START.longest_blend) / 30:
        assert _distance(came, place) == pytest.approx(0.0, abs=1e-4)


def test_who_holds_the_object_at_once_does_not_come_from_elsewhere():
    guess = _guess(1.0, 2)[None, 2:]
    torch.testing.assert_close(StartPosition(torch.tensor([-1.0, 2.0])).impose(guess), guess)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_side_on_which_somebody_stood_is_the_side_they_come_from(side: float):
    guesses = torch.stack([_guess((-1.0) ** k, 40 + k) for k in range(12)])
    x = select_by_start(guesses, StartPosition(torch.tensor([side * 1.5, 0.2])), _box(), 4)
    assert (side * x[:, :30, 0] > 0.25).all()


def test_who_would_have_to_run_around_the_object_comes_only_where_all_would():
    """Nearest to the place begin some who hold the box from its other side a second later."""
    torch.manual_seed(0)
    here, there = _guess(1.0, 30), _guess(-1.0, 30)
    round_it = torch.where(torch.arange(FRAMES)[:, None] < 20, here, there)
    place = torch.tensor([1.2 + START.idle_reach, 0.0])
    late = round_it + torch.cat([0.01 * torch.randn(8, 1, 6), torch.zeros(8, 1, 2)], dim=-1)
    calm = here.repeat(6, 1, 1)
    calm[..., 1:6:3] += 0.1
    x = select_by_start(torch.cat([late, calm]), StartPosition(place), _box(), 4)
    assert (x[:, 40:, 0] > 0).all()
    assert (select_by_start(late, StartPosition(place), _box(), 4)[:, 40:, 0] < 0).any()


@pytest.mark.parametrize("height", [1.5, 1.9])
def test_a_place_is_meant_in_the_world_of_whoever_stood_there(height: float):
    """The same guesses, at the networks' size, for people of other statures."""
    solid = trimesh.creation.box((0.4, 0.4, 0.4))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, 3] = [3.0, -2.0, 0.2]
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    clip = ObjectModel(mesh, 1.7 / height).clip(T)
    start = start_constraint(
        Conditioning(start_position=np.array([3.0, -2.0 + height])), None, clip
    )
    assert isinstance(start, StartPosition)
    # The centre is that of points on the surface.
    torch.testing.assert_close(start.position, torch.tensor([0.0, 1.7]), atol=5e-3, rtol=0)
    assert start_constraint(Conditioning(), None, clip) is None


@pytest.mark.parametrize(
    ("way", "lift", "front"),
    [((0.0, 1.0), 0.0, True), ((0.0, 1.0, 0.0), 0.0, False), ((0.0, 1.0), 0.3, False)],
)
def test_nobody_is_in_front_of_what_slides_flat(way: tuple[float, ...], lift: float, front: bool):
    """What is carried, and what goes to and fro, says nothing of the side."""
    T = np.tile(np.eye(4), (90, 1, 1))
    T[:, 0, 3] = np.interp(np.arange(90), np.linspace(10, 80, len(way)), way)
    T[:, 2, 3] = 0.15 + lift * np.interp(np.arange(90), [10, 20, 70, 80], [0, 1, 1, 0])
    solid = trimesh.creation.box((0.3, 0.3, 0.3))
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    clip = ObjectModel(mesh, 1.0).clip(T)
    # Left palm, right palm, both hold: before the box, facing back, and behind it, facing on.
    ahead = [0.2, -0.2, 0.0, 0.2, 0.2, 0.0, 1.0, 1.0]
    behind = [-0.2, 0.2, 0.0, -0.2, -0.2, 0.0, 1.0, 1.0]
    features = torch.tensor([ahead, behind])[:, None].expand(2, 90, 8)
    assert stands_in_front(features, clip).tolist() == [front, False]
