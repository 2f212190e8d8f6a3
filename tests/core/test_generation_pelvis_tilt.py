"""The pelvis tilts by a part of what the chest does, over hips that stay."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.generation.decoding import pitch, tilt_pelvis
from omomo_core.generation.generation_config import BODY_DECODING
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.skeleton import joint
from tests.core.standing_people import FACING_X

BODY = load_body()
CHEST = joint("spine3")


def stooping(degrees: float, yaw: float, side: float = 0.0) -> torch.Tensor:
    """Everybody's trunk is a rod that leans forward, and a little to the side."""
    lean = torch.from_numpy(Rotation.from_euler("xz", [degrees, side], degrees=True).as_matrix())
    R = FACING_X.double().expand(22, 3, 3).clone()
    trunk = [joint(name) for name in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")]
    R[trunk] = R[trunk] @ lean
    return yaw_matrix(torch.tensor(yaw, dtype=torch.float64)) @ R


@given(st.floats(-40, 130), st.floats(-3, 3), st.floats(-20, 20))
def test_hips_and_legs_stay_and_the_pelvis_tilts_less(degrees: float, yaw: float, side: float):
    root, R = torch.tensor([0.3, -1.0, 0.9], dtype=torch.float64), stooping(degrees, yaw, side)
    moved, turned = tilt_pelvis(BODY, root, R)
    before, after = (forward_kinematics(BODY, *pose) for pose in ((root, R), (moved, turned)))
    legs = [joint(f"{s}_{part}") for s in ("left", "right") for part in ("hip", "knee", "ankle")]
    torch.testing.assert_close(after[legs], before[legs], atol=1e-6, rtol=0)
    torch.testing.assert_close(turned[1:], R[1:])
    wanted = BODY_DECODING.pelvis_tilt * np.degrees(float(pitch(R, CHEST)))
    assert abs(np.degrees(float(pitch(turned, 0))) - wanted) < 2 + abs(side) / 2


@given(st.floats(-30, 120), st.floats(-3, 3))
def test_whoever_bends_so_already_is_left_alone(degrees: float, yaw: float):
    root, R = torch.zeros(3, dtype=torch.float64), stooping(degrees, yaw)
    once = tilt_pelvis(BODY, root, R)
    for a, b in zip(tilt_pelvis(BODY, *once), once, strict=True):
        torch.testing.assert_close(a, b, atol=1e-6, rtol=0)


def test_pitch_is_forward_as_the_pelvis_faces():
    np.testing.assert_allclose(np.degrees(float(pitch(stooping(70, 2.0), CHEST))), 70, atol=1e-4)
    np.testing.assert_allclose(np.degrees(float(pitch(stooping(120, -1.0), 0))), 120, atol=1e-4)


def test_pitches_of_many_are_those_of_each():
    people = torch.stack([stooping(70, 2.0), stooping(20, -1.0), stooping(-10, 0.3)])
    torch.testing.assert_close(pitch(people, CHEST), torch.stack([pitch(R, CHEST) for R in people]))
