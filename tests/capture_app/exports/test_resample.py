"""Other frame rates: what stands, stands; what is held, is held; nothing is lost in time."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.exports.resample import Sampled, at_rate
from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel, load_body
from omomo_core.geometry.runs import runs
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion

RATES = (24.0, 25.0, 60.0)
FEET = (7, 8, 10, 11)


@pytest.fixture(scope="module")
def standing() -> tuple[BodyModel, HumanMotion, ObjectMotion]:
    """Knees bend while both feet stand, then the left foot rolls over its toes; a palm holds a box."""
    import torch

    body, frames = load_body(), 31
    rest = body.rest_joints.double().numpy()
    t = np.arange(frames) / 30
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    R = np.tile(upright, (frames, 22, 1, 1))
    root = np.stack(
        [0.1 * np.sin(4 * t), -0.05 * t, rest[0, 1] - 0.02 - 0.2 * np.sin(3 * t) ** 2], axis=1
    )
    pitch = np.where(t > 0.5, 1.2 * (t - 0.5), 0.0)
    R[:, 7] = upright @ Rotation.from_euler("x", pitch[:, None]).as_matrix()
    ankles = [upright @ (rest[7] - [rest[0, 0], 0, rest[0, 2]])] * frames
    ankles = np.array(ankles) + (upright - R[:, 7]) @ (rest[10] - rest[7])
    right = np.tile(upright @ (rest[8] - [rest[0, 0], 0, rest[0, 2]]), (frames, 1))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", 0.9 * np.sin(5 * t)[:, None]).as_matrix()
    T[:, :3, 3] = np.stack(
        [0.1 * np.sin(4 * t), 0 * t - 0.3, 1.1 - 0.2 * np.sin(3 * t) ** 2], axis=1
    )
    palm = T[:, :3, :3] @ np.array([0.2, 0.0, 0.0]) + T[:, :3, 3]
    turned = torch.from_numpy(R)
    for limb, goal in (("left_leg", ankles), ("right_leg", right), ("left_arm", palm)):
        turned, missed = reach(body, torch.from_numpy(root), turned, limb, torch.from_numpy(goal))
        assert missed.max() < 1e-6
    heel = (t <= 0.5).astype(np.float32)
    down = np.ones(frames, np.float32)
    human = HumanMotion(
        root=root.astype(np.float32),
        rotations=turned.numpy().astype(np.float32),
        fingers=np.tile(np.eye(3, dtype=np.float32), (frames, 30, 1, 1)),
        joints=joints_of(body, root, turned.numpy()).astype(np.float32),
        hand_contact=np.stack([down, 0 * down], axis=1),
        foot_contact=np.stack([heel, down, down, down], axis=1),
    )
    mesh = ObjectMesh(np.eye(3), np.array([[0, 1, 2]]), "box")
    return body, human, ObjectMotion(mesh, T, np.ones(frames, bool))


def slid(human: HumanMotion) -> float:
    """Farthest that a planted ankle or toe gets from where it was planted, metres."""
    farthest = 0.0
    for k, joint in enumerate(FEET):
        for start, stop in runs(human.foot_contact[:, k] > 0.5):
            way = human.joints[start:stop, joint] - human.joints[start, joint]
            farthest = max(farthest, float(np.linalg.norm(way, axis=1).max()))
    return farthest


def palm_on_object(human: HumanMotion, moved: ObjectMotion) -> np.ndarray:
    T = moved.T_world_object
    return np.einsum("tyx,ty->tx", T[:, :3, :3], human.joints[:, 22] - T[:, :3, 3])


@pytest.mark.parametrize("fps", RATES)
def test_planted_feet_slide_no_more_than_in_the_source(standing: Any, fps: float) -> None:
    body, human, moved = standing
    assert slid(at_rate(human, moved, body, fps).human) < slid(human) + 1e-4


@pytest.mark.parametrize("fps", RATES)
def test_a_hand_that_holds_keeps_its_place(standing: Any, fps: float) -> None:
    body, human, moved = standing
    sampled = at_rate(human, moved, body, fps)
    held = palm_on_object(sampled.human, sampled.object_motion)
    np.testing.assert_allclose(held, np.tile([0.2, 0, 0], (len(held), 1)), atol=1e-4)


@pytest.mark.parametrize("fps", RATES)
def test_between_frames_it_would_be_off_without_care(standing: Any, fps: float) -> None:
    """The two tests above can fail: plain interpolation of this motion does slide and lose hold."""
    from capture_app.exports import resample

    body, human, moved = standing
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(resample, "solved", lambda body, root, R, *rest: R)
        plain = at_rate(human, moved, body, fps)
    held = palm_on_object(plain.human, plain.object_motion)
    assert max(slid(plain.human), np.abs(held - [0.2, 0, 0]).max()) > 2e-4


def test_frames_that_both_rates_have_are_the_same(small_motion: Any, shipped: BodyModel) -> None:
    human, moved = small_motion(3)
    double = at_rate(human, moved, shipped, 60.0)
    assert len(double.human.root) == 2 * len(human.root) - 1
    np.testing.assert_allclose(double.human.joints[::2], human.joints, atol=2e-5)
    np.testing.assert_allclose(
        double.object_motion.T_world_object[::2], moved.T_world_object, atol=1e-9
    )


def test_the_clock_is_kept(small_motion: Any, shipped: BodyModel) -> None:
    """A palm's way through the world is the same function of time at every rate."""
    human, moved = small_motion(5)
    times = np.arange(len(human.root)) / 30
    for fps in RATES:
        sampled = at_rate(human, moved, shipped, fps)
        when = np.arange(len(sampled.human.root)) / fps
        assert times[-1] - 1 / fps < when[-1] <= times[-1] + 1e-9
        for axis in range(3):
            straight = np.interp(when, times, human.root[:, axis])
            np.testing.assert_allclose(sampled.human.root[:, axis], straight, atol=0.02)


def test_one_frame_stays_one(small_motion: Any, shipped: BodyModel) -> None:
    from dataclasses import fields, replace

    human, moved = small_motion(1)
    one = HumanMotion(**{f.name: getattr(human, f.name)[:1] for f in fields(HumanMotion)})
    still = replace(moved, T_world_object=moved.T_world_object[:1], valid=moved.valid[:1])
    sampled: Sampled = at_rate(one, still, shipped, 24.0)
    np.testing.assert_array_equal(sampled.human.root, human.root[:1])
