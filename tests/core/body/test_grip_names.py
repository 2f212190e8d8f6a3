"""Grips are called after what is within a hand's span."""

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.body_config import GRIP_NAMING
from omomo_core.body.grip import GRIPS, HandPoses, name_grips
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import load_body
from omomo_core.contact.contact_config import ANCHOR
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import ObjectMesh
from omomo_core.skeleton import PALM_JOINTS

BODY = load_body()
THICK = GRIP_NAMING.palm_thickness


def test_anchors_and_names_of_grips_know_the_same_palm():
    assert ANCHOR.palm_thickness == THICK


def named(
    size: tuple[float, float, float],
    ahead: float,
    beside: float,
    side: int = 0,
    up: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> str:
    """The grip of a palm that looks down on a box.

    Args:
        size: of the box along the fingers, downwards, and across the hand, metres.
        ahead: from the palm to the edge before the fingers, metres.
        beside: from the palm to the edge on the thumb's side, metres.
        side: of the hand.
        up: world's vertical in the axes of the hand.
    """
    box, sign = trimesh.creation.box(size), 1 - 2 * side
    x = sign * (ahead - size[0] / 2)
    box.apply_translation((x, -size[1] / 2, beside - size[2] / 2))
    field = distance_field(ObjectMesh(np.array(box.vertices), np.array(box.faces), "box"))
    rest = BODY.rest_joints.float()
    palm = rest[PALM_JOINTS[side]] - rest[WRISTS[side]]
    wrist = torch.tensor([[0.0, THICK, 0.0]]) - palm
    poses = HandPoses(torch.eye(3)[None], wrist, torch.tensor([side]))
    return GRIPS[int(name_grips(BODY, poses, torch.tensor([up]), field)[0])]


@pytest.mark.parametrize("side", [0, 1])
def test_a_grip_is_called_after_thickness_edges_and_the_way_up(side: int):
    assert named((0.6, 0.4, 0.6), 0.3, 0.3, side) == "flat press"
    assert named((0.6, 0.4, 0.6), 0.3, 0.3, side, up=(0.0, 1.0, 0.0)) == "weight on a top"
    assert named((0.6, 0.4, 0.6), 0.06, 0.3, side) == "hooked edge"
    assert named((0.6, 0.4, 0.6), 0.06, 0.04, side) == "cupped corner"
    assert named((0.6, 0.02, 0.6), 0.06, 0.3, side) == "pinched board"
    assert named((0.03, 0.03, 0.8), 0.015, 0.4, side) == "power grip"
    assert named((0.8, 0.03, 0.03), 0.4, 0.015, side) == "power grip"


def test_no_contact_has_no_name():
    nobody = HandPoses(torch.zeros(0, 3, 3), torch.zeros(0, 3), torch.zeros(0, dtype=torch.long))
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    field = distance_field(ObjectMesh(np.array(box.vertices), np.array(box.faces), "box"))
    assert len(name_grips(BODY, nobody, torch.zeros(0, 3), field)) == 0
