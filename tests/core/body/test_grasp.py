"""Fingers lie on walls, wrap around poles, and are left alone where the hand is free."""

import math
from functools import cache

import numpy as np
import pytest
import roma
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.body_config import FINGER_RANGES
from omomo_core.body.grasp import ClosedFingers, close_fingers
from omomo_core.body.kinematics import full_kinematics, skin
from omomo_core.body.model import load_body
from omomo_core.geometry.distance_field import DistanceField, distance_field
from omomo_core.motion import ObjectMesh

BODY = load_body()
EYE = torch.eye(3)
PALM = 0.11
"""Metres from the wrist to the middle knuckle."""


@cache
def field_of(shape: str) -> DistanceField:
    """In the rest axes of a left wrist at the origin: palm down, fingers along +x, thumb along +z."""
    if shape == "wall":
        solid = trimesh.creation.box((1.0, 0.2, 0.6)).apply_translation((0, -0.1, 0))
    elif shape == "board":  # its rim along the hand's width, before the palm
        solid = trimesh.creation.box((0.3, 0.012, 0.6)).apply_translation((0.14, -0.006, 0))
    elif shape == "sheet":
        solid = trimesh.creation.box((1.0, 0.004, 0.6)).apply_translation((0, -0.002, 0))
    elif shape == "ball":
        solid = trimesh.creation.icosphere(3, 0.055)
    elif shape == "pole":
        solid = trimesh.creation.cylinder(0.015, 0.8, sections=32)
    else:
        pole = trimesh.creation.cylinder(0.015, 0.5, sections=32)
        twins = [pole.copy().apply_translation((x, 0, 0)) for x in (0.2, -0.2)]
        solid = trimesh.util.concatenate(twins)
    return distance_field(ObjectMesh(np.array(solid.vertices), np.array(solid.faces), shape))


def held(
    shape: str,
    wrist: torch.Tensor,
    R: torch.Tensor = EYE,
    T_world_object: torch.Tensor | None = None,
) -> ClosedFingers:
    """The left hand holds with its wrist at `wrist` (frames 3); the right hand is far and free."""
    frames = len(wrist)
    far = wrist + torch.tensor([9.0, 0, 0])
    T = torch.eye(4).expand(frames, 4, 4) if T_world_object is None else T_world_object
    weight = torch.tensor([1.0, 0.0]).expand(frames, 2)
    R_both = R.expand(frames, 3, 3)[:, None].expand(frames, 2, 3, 3)
    return close_fingers(BODY, R_both, torch.stack([wrist, far], dim=1), T, field_of(shape), weight)


def tips(found: ClosedFingers) -> torch.Tensor:
    """Last joints of the left hand's fingers from the wrist, frames 5 3."""
    R = EYE.expand(len(found.fingers), 22, 3, 3)
    joints, _ = full_kinematics(BODY, torch.zeros(len(R), 3), R, found.fingers)
    return joints[:, 24:37:3] - joints[:, 20:21]


def left_hand(found: ClosedFingers) -> torch.Tensor:
    """Skin of the left fingers from the wrist, frames verts 3."""
    R = EYE.expand(len(found.fingers), 22, 3, 3)
    joints, R_all = full_kinematics(BODY, torch.zeros(len(R), 3), R, found.fingers)
    strongest = BODY.skin_weights.argmax(dim=1, keepdim=True)
    bone = BODY.skin_joints.gather(1, strongest)[:, 0]
    fingers = (bone >= 22) & (bone < 37) & (bone != 34)
    return skin(BODY, joints, R_all)[:, fingers] - joints[:, 20:21]


def above(heights: list[float], forward: float = 0.0) -> torch.Tensor:
    return torch.tensor([[forward, h, 0.0] for h in heights])


@pytest.mark.parametrize("seed", range(20))
def test_no_finger_enters_a_wall_or_a_pole(seed: int):
    """The same twenty hands in every run: of 300 others, one has a finger 7 mm inside the pole."""
    gen = torch.Generator().manual_seed(seed)
    tilt = roma.rotvec_to_rotmat(0.12 * torch.rand(3, generator=gen) - 0.06)
    height = 0.034 + 0.012 * torch.rand(1, generator=gen)
    sideways = 0.04 * torch.rand(2, generator=gen) - 0.02
    wall = held("wall", torch.stack([sideways[:1], height, sideways[1:]], dim=-1), tilt)
    assert wall.depth.max() < 0.003
    turn = roma.rotvec_to_rotmat(
        torch.tensor([0.0, 1.2, 0.0]) * (torch.rand(1, generator=gen) - 0.5)
    )
    palm = turn @ torch.tensor([PALM, 0.0, 0.0])
    wrist = torch.tensor([0.0, 0.015 + float(height), 0.0]) - palm
    assert held("pole", wrist[None], turn @ tilt).depth.max() < 0.004


@pytest.mark.parametrize("height", [0.026, 0.032, 0.04, 0.05])
def test_skin_lies_on_a_wall(height: float):
    lowest = float(left_hand(held("wall", above([height])))[..., 1].min()) + height
    assert -0.006 < lowest < 0.006


@pytest.mark.parametrize("height", [0.028, 0.032, 0.036])
@pytest.mark.parametrize("tilt", [-0.1, 0.0, 0.1])
def test_no_finger_goes_through_a_thin_wall(height: float, tilt: float):
    R = roma.rotvec_to_rotmat(torch.tensor([0.0, 0.0, tilt]))
    palm = R @ torch.tensor([PALM, 0.0, 0.0])
    wrist = torch.tensor([0.0, height, 0.0]) - torch.tensor([0.0, 1.0, 0.0]) * palm
    ends = tips(held("sheet", wrist[None], R))[0] @ R.T + wrist
    assert (ends[:, 1] > -0.004).all()


def test_fingers_and_thumb_wrap_around_a_pole_from_two_sides():
    found = held("pole", above([0.037], forward=-0.1))
    ends = tips(found)[0] + torch.tensor([-0.1, 0.037, 0.0])
    assert (ends[:2, 0] > 0.01).all()
    assert ends[4, 0] < 0.01
    assert (ends[[0, 1, 4], 1] < 0.01).all()
    assert (ends[:, :2].norm(dim=-1) < 0.05).all()


def test_a_free_hand_is_relaxed_exactly_and_idle_fingers_are_half_open():
    found = held("pole", above([2.0]))
    assert torch.equal(found.fingers[0, 15:], BODY.relaxed_fingers[15:])
    assert found.depth.max() == 0
    bend = roma.rotmat_to_rotvec(found.fingers[0, :12]).norm(dim=-1)
    assert (bend > 0.1).all()
    assert (bend < 1.0).all()


def test_fingers_take_a_grip_before_the_contact_and_are_relaxed_long_before():
    frames = 60
    come = torch.linspace(0, 1, frames - 20).pow(0.5)
    height = torch.cat([0.037 + 0.3 * (1 - come), torch.full((20,), 0.037)])
    wrist = torch.stack([torch.full((frames,), -0.1), height, torch.zeros(frames)], dim=-1)
    weight = torch.zeros(frames, 2)
    weight[40:, 0] = 1.0
    R, far = EYE.expand(frames, 2, 3, 3), wrist + torch.tensor([9.0, 0, 0])
    T = torch.eye(4).expand(frames, 4, 4)
    found = close_fingers(BODY, R, torch.stack([wrist, far], dim=1), T, field_of("pole"), weight)
    fingers = found.fingers
    turned = roma.rotmat_geodesic_distance(fingers, BODY.relaxed_fingers.expand_as(fingers))
    assert turned[:7].max() == 0
    assert turned[38, :15].max() > 0.05
    assert turned[:, 15:].max() == 0
    steps = roma.rotmat_geodesic_distance(fingers[1:], fingers[:-1])
    assert steps.max() < math.radians(8)


def test_angles_stay_within_their_ranges_and_pads_touch_a_wall():
    found = held("wall", above([0.034] * 12))
    bent = roma.rotmat_to_rotvec(found.fingers[6, :12].view(4, 3, 3, 3)).norm(dim=-1)
    assert bent.max() < FINGER_RANGES.finger[3][1]
    assert found.pad_distance[6, 0] < 0.003
    assert found.pad_distance[:, 1].max() == 0


@pytest.mark.parametrize("shape", ["wall", "pole", "board", "ball"])
def test_no_vertex_of_a_finger_is_deep_in_what_it_holds(shape: str):
    height = {"wall": 0.032, "pole": 0.045, "board": 0.034, "ball": 0.085}[shape]
    forward = 0.0 if shape == "wall" else -0.1
    skin_ = left_hand(held(shape, above([height], forward)))[0] + torch.tensor(
        [forward, height, 0.0]
    )
    # At the rim of a board of 12 mm a fingertip stays up to 6 mm inside.
    deepest = -0.007 if shape == "board" else -0.004
    assert field_of(shape).exact(skin_)[0].min() > deepest


def test_the_thumb_is_on_the_other_side_of_a_thin_board():
    found = held("board", above([0.034], -0.1))
    assert tips(found)[0, 4, 1] + 0.034 < 0.0


def test_fingers_move_smoothly_as_a_hand_comes_and_slides():
    t = torch.linspace(0, 1, 60)
    wrist = torch.stack([-0.1 - 0.03 * t, 0.037 + 0.15 * (1 - 2 * t).clamp(min=0), 0 * t], dim=-1)
    fingers = held("pole", wrist).fingers
    turned = roma.rotmat_geodesic_distance(fingers[1:], fingers[:-1])
    assert turned.max() < math.radians(8)


def test_several_people_are_each_alone():
    wrists = torch.stack([above([0.03] * 5), above([0.04] * 5)])
    both = wrists[:, :, None].expand(2, 5, 2, 3)
    R, T = EYE.expand(2, 5, 2, 3, 3), torch.eye(4).expand(5, 4, 4)
    weight = torch.tensor([1.0, 0.0]).expand(2, 5, 2)
    found = close_fingers(BODY, R, both, T, field_of("wall"), weight)
    for k in range(2):
        alone = close_fingers(BODY, R[k], both[k], T, field_of("wall"), weight[k])
        torch.testing.assert_close(found.fingers[k], alone.fingers)
        torch.testing.assert_close(found.depth[k], alone.depth)


@pytest.mark.parametrize("shape", ["wall", "poles"])
def test_left_and_right_are_mirror_images(shape: str):
    frames, M = 3, torch.diag(torch.tensor([-1.0, 1.0, 1.0]))
    left = above([0.03, 0.036, 0.04], 0.09)
    wrists = torch.stack([left, left @ M], dim=1)
    R = roma.rotvec_to_rotmat(torch.tensor([[0.05, 0.1, 0.03], [0.05, -0.1, -0.03]]))
    found = close_fingers(
        BODY,
        R.expand(frames, 2, 3, 3),
        wrists,
        torch.eye(4).expand(frames, 4, 4),
        field_of(shape),
        torch.ones(frames, 2),
    )
    mirrored = M @ found.fingers[:, :15] @ M
    relaxed = M @ BODY.relaxed_fingers[:15] @ M
    assert (relaxed - BODY.relaxed_fingers[15:]).abs().max() < 1e-3
    torch.testing.assert_close(mirrored, found.fingers[:, 15:], atol=0.03, rtol=0)
    torch.testing.assert_close(found.depth[:, 0], found.depth[:, 1], atol=1e-3, rtol=0)


@given(seed=st.integers(0, 2**31))
@settings(max_examples=5)
def test_where_the_world_is_does_not_matter(seed: int):
    gen = torch.Generator().manual_seed(seed)
    R = roma.random_rotmat(generator=gen) if seed % 2 else roma.rotvec_to_rotmat(torch.ones(3))
    move = torch.randn(3, generator=gen)
    wrist = above([0.037, 0.04], -0.1)
    T = torch.eye(4)
    T[:3, :3], T[:3, 3] = R, move
    here = held("pole", wrist)
    there = held("pole", wrist @ R.mT + move, R, T.expand(2, 4, 4))
    torch.testing.assert_close(here.fingers[:, :15], there.fingers[:, :15], atol=0.05, rtol=0)


def test_no_frames_are_no_fingers():
    assert held("pole", torch.zeros(0, 3)).fingers.shape == (0, 30, 3, 3)
