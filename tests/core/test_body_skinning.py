import roma
import torch

from omomo_core.body.kinematics import full_kinematics, skin, vertex_normals
from omomo_core.body.model import load_body

BODY = load_body()
EYE = torch.eye(3)


def test_the_rest_pose_gives_the_rest_vertices():
    joints, R = full_kinematics(
        BODY, BODY.rest_joints[0], EYE.expand(22, 3, 3), EYE.expand(30, 3, 3)
    )
    torch.testing.assert_close(skin(BODY, joints, R), BODY.vertices, atol=1e-6, rtol=0)


def test_skin_follows_a_rigid_motion():
    turn = roma.rotvec_to_rotmat(torch.tensor([0.3, -1.2, 0.7]))
    shift = torch.tensor([1.0, -2.0, 0.5])
    joints, R = full_kinematics(
        BODY, BODY.rest_joints[0] @ turn.T + shift, turn.expand(22, 3, 3), EYE.expand(30, 3, 3)
    )
    expected = BODY.vertices @ turn.T + shift
    torch.testing.assert_close(skin(BODY, joints, R), expected, atol=1e-5, rtol=0)


def test_many_frames_equal_one_by_one():
    gen = torch.Generator().manual_seed(0)
    rotations = roma.rotvec_to_rotmat(0.3 * torch.randn(3, 15, 22, 3, generator=gen))
    fingers = BODY.relaxed_fingers.expand(3, 15, 30, 3, 3)
    joints, R = full_kinematics(BODY, torch.zeros(3, 15, 3), rotations, fingers)
    together = skin(BODY, joints, R)
    assert together.shape == (3, 15, len(BODY.vertices), 3)
    torch.testing.assert_close(together[2, 7], skin(BODY, joints[2, 7], R[2, 7]))


def test_normals_are_unit_and_point_outward():
    normals = vertex_normals(BODY.vertices, BODY.faces)
    torch.testing.assert_close(normals.norm(dim=-1), torch.ones(len(normals)))
    out = BODY.vertices + 0.001 * normals
    assert _volume(out) > _volume(BODY.vertices) > 0.04


def test_normals_of_a_batch_turn_with_the_body():
    turn = roma.rotvec_to_rotmat(torch.tensor([0.0, 0.0, 1.0]))
    both = torch.stack([BODY.vertices, BODY.vertices @ turn.T])
    normals = vertex_normals(both, BODY.faces)
    torch.testing.assert_close(normals[1], normals[0] @ turn.T, atol=1e-4, rtol=0)


def _volume(vertices: torch.Tensor) -> float:
    a, b, c = vertices[BODY.faces].unbind(1)
    return float((torch.linalg.cross(a, b) * c).sum() / 6)
