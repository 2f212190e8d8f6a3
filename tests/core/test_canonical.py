"""Headings and frames: properties that let windows of one take be mixed."""

import math

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.sampling.sample_body import merge_windows
from omomo_core.geometry.rotations import (
    Layout,
    heading_of_palms,
    heading_of_travel,
    human_frame,
    into_frame,
    out_of_frame,
    rotmat_from_6d,
    rotmat_to_6d,
    turn,
    yaw_matrix,
)
from omomo_core.stages.stage import window_frames

angles = st.floats(-math.pi, math.pi)


@given(a=angles, b=angles)
def test_turns_add_up_and_leave_scalars_alone(a: float, b: float):
    x, layout = torch.randn(1, 5, 8, dtype=torch.float64), Layout(2, 2)
    ta, tb = torch.tensor([a]).double(), torch.tensor([b]).double()
    assert torch.allclose(turn(turn(x, ta, layout), tb, layout), turn(x, ta + tb, layout))
    assert torch.equal(turn(x, ta, layout)[..., 6:], x[..., 6:])


@given(yaw=angles)
def test_a_person_facing_a_heading_is_recognised_by_the_palms(yaw: float):
    # Facing +x: the left hand is at +y.
    palms = torch.tensor([[0.4, 0.3, 1.0], [0.4, -0.3, 1.0]]) @ yaw_matrix(torch.tensor(yaw)).T
    found = heading_of_palms(palms.expand(1, 10, 2, 3), torch.ones(1, 10, dtype=torch.bool))
    assert math.cos(float(found) - yaw) > 1 - 1e-5


def test_travel_ignores_padding_and_standing_still():
    centre = torch.zeros(2, 10, 3)
    centre[0, :, 1] = torch.linspace(0, 1, 10)
    centre[0, 6:] = 99.0
    valid = torch.ones(2, 10, dtype=torch.bool)
    valid[0, 6:] = False
    yaw, travels = heading_of_travel(centre, valid)
    assert travels.tolist() == [True, False]
    assert abs(float(yaw[0]) - math.pi / 2) < 1e-6


@given(seed=st.integers(0, 1000))
def test_six_numbers_hold_a_rotation(seed: int):
    g = torch.Generator().manual_seed(seed)
    q, _ = torch.linalg.qr(torch.randn(4, 3, 3, generator=g, dtype=torch.float64))
    R = q * torch.linalg.det(q)[:, None, None]
    assert torch.allclose(rotmat_from_6d(rotmat_to_6d(R) * 1.7), R, atol=1e-9)


@given(yaw=angles, x=st.floats(-50, 50))
def test_human_frame_puts_the_person_at_the_origin_facing_minus_y(yaw: float, x: float):
    upright = torch.tensor([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # y up -> z up, facing -y
    R = (yaw_matrix(torch.tensor(yaw)) @ upright)[None]
    root = torch.tensor([[x, 3.0, 0.9]])
    origin, found = human_frame(root, R)
    facing = R[0] @ torch.tensor([0.0, 0, 1])
    points = torch.stack([root[0], root[0] + facing])[None, None]
    inside = into_frame(points, origin, found)
    assert torch.allclose(inside[0, 0, 0], torch.tensor([0, 0, 0.9]), atol=1e-4)
    assert torch.allclose(inside[0, 0, 1], torch.tensor([0, -1, 0.9]), atol=1e-4)
    assert torch.allclose(out_of_frame(inside, origin, found), points, atol=1e-4)


@given(frames=st.integers(1, 700))
@settings(max_examples=40)
def test_windows_cover_a_take_and_merging_them_gives_it_back(frames: int):
    index = window_frames(frames)
    assert set(index.flatten().tolist()) == set(range(frames))
    take = torch.randn(2, frames, 3, dtype=torch.float64)
    assert torch.allclose(merge_windows(take[:, index], index, frames), take)
