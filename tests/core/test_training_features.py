"""What the networks are shown: exact mirrors, exact round trips, the same wherever the scene is."""

from dataclasses import replace

import numpy as np
import pytest
import roma
import torch
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.geometry.object_features import object_features
from omomo_core.geometry.rotations import rotate, rotmat_from_6d, turn, yaw_matrix
from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.denoising import make_example
from omomo_core.motion import ObjectMotion
from omomo_core.stages import body_capture, body_paper
from omomo_core.stages import hands_capture as hand_capture
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.stage import WINDOW
from tests.core.training_clips import BODY, CLIPS, clip


@pytest.fixture(scope="module")
def corpus() -> Corpus:
    return Corpus(CLIPS, BODY, synthesis_share=0.7)


def test_windows_are_padded_and_mirrored_bodies_obey_kinematics(corpus: Corpus):
    torch.manual_seed(0)
    w = corpus.draw(64, 16)
    assert not w.object.valid.all(dim=1).all()
    joints = forward_kinematics(BODY, w.human.joints[:, :, 0], rotmat_from_6d(w.human.rotations_6d))
    assert (joints - w.human.joints).abs().max() < 1e-4
    mirrored = w.human.hand_contact[:, 0, 1] == 1
    assert 0.2 < mirrored.float().mean() < 0.8
    # A mirrored walk along +x goes along -x, and its spin and shape follow.
    way = w.human.joints[:, 30, 0, 0] - w.human.joints[:, 0, 0, 0]
    assert ((way < 0) == mirrored).all()


def test_capture_features_unpack_to_what_was_packed(corpus: Corpus):
    torch.manual_seed(1)
    w = corpus.draw(8, 16)
    yaw = torch.randn(8)
    x = turn(body_capture.pack(w.human), -yaw, body_capture.LAYOUT)
    x = turn(x, yaw, body_capture.LAYOUT)
    root, joints, six, feet = body_capture.unpack(x, w.human.reference)
    assert torch.allclose(root, w.human.joints[:, :, 0], atol=1e-5)
    assert torch.allclose(joints, w.human.joints, atol=1e-5)
    assert torch.allclose(six, w.human.rotations_6d, atol=1e-5)
    assert torch.allclose(feet, w.human.foot_contact)
    hands = hand_capture.pack(w.human.joints[:, :, 22:], w.human.hand_contact, w.object)
    palms, contact = hand_capture.unpack(hands, w.object.centre)
    assert torch.allclose(palms, w.human.joints[:, :, 22:], atol=1e-5)
    assert torch.allclose(contact, w.human.hand_contact)


def test_paper_features_unpack_to_what_was_packed(corpus: Corpus):
    w = corpus.draw(4, 16)
    origin, yaw = torch.randn(4, 3), torch.randn(4)
    R = rotmat_from_6d(w.human.rotations_6d)
    joints, found = body_paper.unpack(body_paper.pack(w.human.joints, R, origin, yaw), origin, yaw)
    assert torch.allclose(joints, w.human.joints, atol=1e-5)
    assert torch.allclose(found, R, atol=1e-5)
    palms = w.human.joints[:, :, 22:]
    packed = hand_paper.pack(palms, origin, yaw)
    assert torch.allclose(hand_paper.unpack(packed, origin, yaw), palms, atol=1e-5)


def test_a_scene_elsewhere_gives_the_same_features(corpus: Corpus):
    """The capture features see no world origin: a walk may be anywhere, of any length."""
    torch.manual_seed(2)
    w = corpus.draw(4, 16, objects_only=True)
    yaw = hand_capture.canonical_yaw(w.object)
    axes = hand_capture.object_axes(w.object, yaw)
    start = torch.tensor([0.3, -0.6, 1.0]).expand(4, 3)
    a = hand_capture.condition(w.object, yaw, axes, start)
    moved = {k: getattr(w.object, k) for k in w.object.__dataclass_fields__}
    moved["centre"] = w.object.centre + torch.tensor([40.0, -70.0, 0.0])
    b = hand_capture.condition(type(w.object)(**moved), yaw, axes, start)
    assert torch.allclose(a, b, atol=1e-3)


def test_a_start_is_seen_from_the_heading_of_the_window(corpus: Corpus):
    w = corpus.draw(3, 16, objects_only=True)
    yaw = torch.tensor([0.0, torch.pi / 2, torch.pi])
    axes = hand_capture.object_axes(w.object, yaw)
    near = torch.tensor([0.5, 0.2, 1.0])
    start = torch.stack([near, near, hand_capture.UNKNOWN_START])
    seen = hand_capture.condition(w.object, yaw, axes, start)[..., -3:]
    aside = torch.tensor([0.2, -0.5, 1.0])
    ahead = torch.stack([near, aside, hand_capture.UNKNOWN_START])
    assert torch.allclose(seen, ahead[:, None].expand_as(seen), atol=1e-6)


def test_a_palm_that_holds_stands_still_in_the_axes_of_the_object(corpus: Corpus):
    torch.manual_seed(4)
    w = corpus.draw(8, 16, objects_only=True)
    R = roma.random_rotmat(8 * WINDOW).unflatten(0, (8, WINDOW))
    moved = replace(w.object, R_world_object=R)
    yaw = torch.randn(8)
    axes = hand_capture.object_axes(moved, yaw)
    held = R @ torch.tensor([0.1, -0.2, 0.3]) + moved.centre
    palms = torch.stack([held, held], dim=2)
    x = hand_capture.pack(palms, torch.ones(8, WINDOW, 2), moved)
    seen = rotate(x, axes.transpose(-1, -2), hand_capture.LAYOUT)
    assert (seen - seen[:, :1]).abs().max() < 1e-4
    assert torch.allclose(rotate(seen, axes, hand_capture.LAYOUT), x, atol=1e-5)
    middle = moved.valid.sum(dim=1) // 2
    upright = axes[torch.arange(8), middle]
    assert torch.allclose(upright, yaw_matrix(yaw), atol=1e-5)


def test_paper_examples_have_the_published_shapes(corpus: Corpus):
    w = corpus.draw(2, 1024)
    hands, body = make_example(hand_paper.CONFIG, w), make_example(body_paper.CONFIG, w)
    assert hands.x0.shape == (2, 120, 6)
    assert hands.shape is not None
    assert hands.shape.shape == (2, 120, 3072)
    assert body.x0.shape == (2, 120, 204)
    # The person stands at the origin and faces -y in the first frame: left hip at +x.
    assert body.x0[:, 0, :2].abs().max() < 1e-5
    assert (body.x0[:, 0, 3] > 0.03).all()


def test_training_sees_a_tilting_thing_as_generation_does():
    """Where it is, how it moves and turns; and their images where the window is mirrored."""
    like = clip(1, WINDOW, with_object=True)
    assert like.object_motion is not None
    mesh = like.object_motion.mesh
    corner = replace(mesh, vertices=mesh.vertices + 0.2 * (mesh.vertices > 0).all(axis=1)[:, None])
    T = like.object_motion.T_world_object.copy()
    ways = np.linspace(0.0, 1.0, WINDOW)[:, None] * [0.7, -0.4, 0.9]
    T[:, :3, :3] = Rotation.from_rotvec(ways).as_matrix()
    tilted = replace(like, object_motion=ObjectMotion(corner, T, np.ones(WINDOW, bool)))
    torch.manual_seed(5)
    seen = Corpus([tilted], BODY, synthesis_share=1.0).draw(12, 16).object
    take = object_features(tilted.object_motion)
    mirrored = seen.R_world_object[:, 60, 0, 1] * take.motion.T_world_object[60, 0, 1] < 0
    assert 0 < mirrored.sum() < 12
    S = torch.tensor([-1.0, 1.0, 1.0])
    # What turns the other way in a mirror turns about the mirrored axis, backward.
    for name, images in (("centre", (S, 1)), ("velocity", (S, 1)), ("spin", (S, -1))):
        theirs = torch.from_numpy(getattr(take, name)).float()
        for k in range(12):
            image = images[0] * images[1] if mirrored[k] else torch.ones(3)
            torch.testing.assert_close(getattr(seen, name)[k], theirs * image, atol=2e-3, rtol=0)
    lowest = torch.from_numpy(take.lowest).float().expand(12, -1)
    torch.testing.assert_close(seen.lowest, lowest, atol=1e-4, rtol=0)
