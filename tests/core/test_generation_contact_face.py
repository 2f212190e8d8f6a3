"""Hands whose arms would go through a board go over to its other face, and no others do."""

from collections.abc import Sequence

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.contact.contact_config import ANCHOR
from omomo_core.contact.segment import ContactSegment, ContactSpan, anchor_spans, follow_anchors
from omomo_core.generation.collision.approach import choose_contact_faces, lifts_from_top
from omomo_core.generation.decoding import face_palms
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.motion import HandMotion, ObjectMesh
from tests.core.standing_people import BODY, FRAMES, at, standing

TOP = 0.95


def board(thickness: float) -> ObjectModel:
    solid = trimesh.creation.box(bounds=[(0.15, -0.6, TOP - thickness), (0.9, 0.6, TOP)])
    return ObjectModel(ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "board"), 1.0)


def chosen(
    object_model: ObjectModel, held: Sequence[ContactSegment], prefix: int = 0
) -> tuple[ContactSegment, ...]:
    root, R = standing()
    still = HandMotion(np.zeros((FRAMES, 2, 3)), np.zeros((FRAMES, 2)))

    def targets_for(segments: Sequence[tuple[ContactSegment, ...]]) -> InteractionTargets:
        hands = follow_anchors(segments[0], still, at(), object_model.surface)
        return InteractionTargets(
            palms=torch.from_numpy(hands.palms).float()[None],
            hold=torch.from_numpy(hands.contact).float()[None],
            R_world_wrist=face_palms(R[0][:, WRISTS], segments[0], object_model.surface, at())[
                None
            ],
            T_world_object=at(),
            obstacle=object_model.obstacle,
            balance=np.ones(FRAMES),
        )

    return choose_contact_faces(BODY, root, R, [tuple(held)], object_model, targets_for, prefix)[0]


def hold(object_model: ObjectModel, hand: int, height: float) -> ContactSegment:
    """A hand in front of its shoulder, for all frames."""
    palms = np.tile([[0.35, 0.22, height], [0.35, -0.22, height]], (FRAMES, 1, 1))
    guess = HandMotion(palms, np.ones((FRAMES, 2)))
    return anchor_spans([ContactSpan(hand, 0, FRAMES)], guess, object_model.surface, at())[0]


@pytest.mark.parametrize("thickness", [0.02, 0.04, 0.06])
def test_a_hand_beneath_a_table_top_that_its_arm_would_cross_goes_on_top(thickness: float):
    object_model = board(thickness)
    beneath = hold(object_model, 0, TOP - thickness - ANCHOR.palm_thickness)
    above = hold(object_model, 1, TOP + ANCHOR.palm_thickness)
    left, right = chosen(object_model, [beneath, above])
    assert left.anchor == pytest.approx(
        [*beneath.anchor[:2], TOP + ANCHOR.palm_thickness], abs=1e-3
    )
    assert (left.hand, left.start, left.stop) == (0, 0, FRAMES)
    assert right is above


def test_what_is_decided_and_what_is_thick_stay():
    thin, thick = board(0.04), board(0.3)
    held = [hold(thin, 0, TOP - 0.04 - ANCHOR.palm_thickness)]
    assert chosen(thin, held, prefix=10)[0] is held[0]
    held = [hold(thick, 0, TOP - 0.3 - ANCHOR.palm_thickness)]
    assert chosen(thick, held)[0] is held[0]


@pytest.mark.parametrize(
    ("way", "height", "on_top"),
    [
        (0.4, TOP + ANCHOR.palm_thickness, True),
        (0.4, TOP - 0.04 - ANCHOR.palm_thickness, False),
        (0.05, TOP + ANCHOR.palm_thickness, False),
        (-0.4, TOP + ANCHOR.palm_thickness, False),
    ],
)
def test_a_flat_hand_on_top_does_not_lift(way: float, height: float, on_top: bool):
    """It may lie on what stays or goes down."""
    object_model = board(0.04)
    T = at()
    T[:, 2, 3] += np.linspace(0.0, way, FRAMES)
    assert lifts_from_top(hold(object_model, 0, height), object_model.surface, T) == on_top
