"""Holding palms lie on what they hold, within the wrists' ranges, and land on it from outside."""

import numpy as np
import pytest
import roma
import torch
import trimesh

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.avoidance import ELBOWS
from omomo_core.generation.decoding import lay_palms
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.solving.bodies import SolvedBodies
from omomo_core.generation.solving.palm_plan import ARMS, beyond_range
from omomo_core.generation.solving.solving_config import PALM_PLAN
from omomo_core.motion import ObjectMesh
from tests.core.standing_people import BODY, FRAMES, at, block, standing

START, STOP = 24, 44
BLOCK = block((0.25, -0.2, 0.85), (0.75, 0.2, 1.2))
OUT = torch.tensor([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
ANCHORS = torch.tensor([[0.42, 0.229, 1.0], [0.42, -0.229, 1.0]])


def laid(
    start_at: torch.Tensor = ANCHORS, tilt: float = 0.5, free: torch.Tensor | None = None
) -> tuple[SolvedBodies, SolvedBodies]:
    """Both hands come from `start_at` and hold a block's sides: bodies as given, and with palms laid."""
    root, rotations = standing()
    come = torch.linspace(0, 1, START)[:, None, None]
    palms = ANCHORS.expand(1, FRAMES, 2, 3).clone()
    palms[0, :START] = start_at + come * (ANCHORS - start_at)
    rotations = rotations.clone()
    for side in range(2):
        bend = roma.rotvec_to_rotmat(torch.tensor([0.3, 0.1, (1 - 2 * side) * tilt]))
        for _ in range(3):
            rotations, _ = reach(BODY, root, rotations, ARMS[side], palms[..., side, :])
            rotations[:, :, WRISTS[side]] = rotations[:, :, ELBOWS[side]] @ bend
        rotations, _ = reach(BODY, root, rotations, ARMS[side], palms[..., side, :])
    hold = torch.zeros(1, FRAMES, 2)
    hold[:, START:STOP] = 1.0
    wrists = rotations[:, :, WRISTS]
    targets = InteractionTargets(palms, hold, wrists, at(), BLOCK, np.ones(FRAMES))
    segments = tuple(
        ContactSegment(side, START, STOP, ANCHORS[side].double().numpy()) for side in range(2)
    )
    given = SolvedBodies(root, rotations, np.ones((1, FRAMES, 2), bool), torch.zeros(1, FRAMES, 2))
    free = torch.ones(FRAMES) if free is None else free
    return given, lay_palms(BODY, given, targets, [segments], free)


@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.0])
def test_holding_palms_lie_flat_with_their_wrists_within_range(tilt: float):
    _, found = laid(tilt=tilt)
    R = found.rotations[0, START:STOP]
    facing = (R[:, WRISTS, :, 1] * OUT).sum(dim=-1)
    assert facing.min() > np.cos(0.35)
    for side in range(2):
        beyond = beyond_range(side, R[:, ELBOWS[side]], R[:, WRISTS[side]])
        assert beyond.max() < PALM_PLAN.spare
    assert found.miss.max() < 0.012


def test_hands_turn_slowly_and_keep_their_direction_long_before():
    given, found = laid(tilt=1.0)
    R = found.rotations[0][:, WRISTS]
    assert roma.rotmat_geodesic_distance(R[1:], R[:-1]).max() < 0.2
    far = slice(0, START - int(PALM_PLAN.ease))
    torch.testing.assert_close(R[far], given.rotations[0][far][:, WRISTS], atol=1e-5, rtol=0)


def test_a_hand_that_comes_through_the_object_is_raised_out_of_it():
    within = ANCHORS - 0.06 * OUT
    given, found = laid(within)

    def depth(people: SolvedBodies) -> torch.Tensor:
        palms = forward_kinematics(BODY, people.root, people.rotations)[0, 8:16, 22:]
        return BLOCK.field.at(palms)

    assert depth(given).min() < -0.005
    assert depth(found).min() > 0.0


def test_fixed_frames_stay_as_they_are():
    free = torch.ones(FRAMES)
    free[:30] = 0.0
    given, found = laid(free=free)
    assert torch.equal(found.rotations[:, :30], given.rotations[:, :30])
    assert not torch.equal(found.rotations[:, 40], given.rotations[:, 40])


def test_a_contact_on_a_face_within_the_object_goes_to_the_nearest_place_outside():
    boxes = [trimesh.creation.box((0.4, 0.4, 0.4)), trimesh.creation.box((0.1, 0.1, 0.1))]
    vertices = np.concatenate([np.array(x.vertices) for x in boxes])
    faces = np.concatenate([np.array(boxes[0].faces), np.array(boxes[1].faces) + 8])
    model = ObjectModel(ObjectMesh(vertices, faces, "box"), 1.0)
    inner = ContactSegment(0, 0, 9, np.array([0.05 + 0.029, 0.0, 0.0]))
    moved = model.with_anchor_outside(inner)
    assert model.obstacle.field.at(torch.from_numpy(moved.anchor).float()) > 0.02
    outer = ContactSegment(0, 0, 9, np.array([0.229, 0.0, 0.0]))
    assert model.with_anchor_outside(outer) is outer
