"""Hands whose arms would go through a board go over to its other face, and no others do."""

from collections.abc import Sequence

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.kinematics import WRISTS
from omomo_core.contact.anchor import PALM_THICKNESS, anchored
from omomo_core.contact.segment import Segment, Span, follow
from omomo_core.generation.collision.contact_face import other_faces
from omomo_core.generation.object_clip import Thing
from omomo_core.generation.solving.wrists import facing
from omomo_core.generation.wish import Wish
from omomo_core.motion import HandMotion, ObjectMesh
from tests.core.standing_people import BODY, FRAMES, at, standing

TOP = 0.95


def board(thickness: float) -> Thing:
    solid = trimesh.creation.box(bounds=[(0.15, -0.6, TOP - thickness), (0.9, 0.6, TOP)])
    return Thing(ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "board"), 1.0)


def chosen(thing: Thing, held: Sequence[Segment], decided: int = 0) -> tuple[Segment, ...]:
    root, R = standing()
    still = HandMotion(np.zeros((FRAMES, 2, 3)), np.zeros((FRAMES, 2)))

    def wished(segments: Sequence[tuple[Segment, ...]]) -> Wish:
        hands = follow(segments[0], still, at())
        return Wish(
            palms=torch.from_numpy(hands.palms).float()[None],
            hold=torch.from_numpy(hands.contact).float()[None],
            R_world_wrist=facing(R[0][:, WRISTS], segments[0], thing.surface, at())[None],
            T_world_object=at(),
            barrier=thing.barrier,
            balance=np.ones(FRAMES),
        )

    return other_faces(BODY, root, R, [tuple(held)], thing, wished, decided)[0]


def hold(thing: Thing, hand: int, height: float) -> Segment:
    """A hand in front of its shoulder, for all frames."""
    palms = np.tile([[0.35, 0.22, height], [0.35, -0.22, height]], (FRAMES, 1, 1))
    guess = HandMotion(palms, np.ones((FRAMES, 2)))
    return anchored([Span(hand, 0, FRAMES)], guess, thing.surface, at())[0]


@pytest.mark.parametrize("thickness", [0.02, 0.04, 0.06])
def test_a_hand_beneath_a_table_top_that_its_arm_would_cross_goes_on_top(thickness: float):
    thing = board(thickness)
    beneath = hold(thing, 0, TOP - thickness - PALM_THICKNESS)
    above = hold(thing, 1, TOP + PALM_THICKNESS)
    left, right = chosen(thing, [beneath, above])
    assert left.anchor == pytest.approx([*beneath.anchor[:2], TOP + PALM_THICKNESS], abs=1e-3)
    assert (left.hand, left.start, left.stop) == (0, 0, FRAMES)
    assert right is above


def test_what_is_decided_and_what_is_thick_stay():
    thin, thick = board(0.04), board(0.3)
    held = [hold(thin, 0, TOP - 0.04 - PALM_THICKNESS)]
    assert chosen(thin, held, decided=10)[0] is held[0]
    held = [hold(thick, 0, TOP - 0.3 - PALM_THICKNESS)]
    assert chosen(thick, held)[0] is held[0]
