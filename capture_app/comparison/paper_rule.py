"""A sample with its contacts by the paper's rule: a hand that once touches holds to the end."""

from dataclasses import replace

import numpy as np

from capture_app.result import Result, body_of
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.resolve import changed, resolve
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.evaluation.touch import POINTS
from omomo_core.stages.hands.contact_rule import constrain


def by_the_paper(result: Result, sample: int) -> Person:
    """Solve a sample again with the contacts that the paper's rule gives its palms.

    The rule measures to the mesh's vertices; points on its faces are added, lest a box of eight
    vertices is never touched. A sample whose hands never come near enough, or that obeys the rule
    already, is returned as it is.

    Args:
        result: with `segments` contacts or any other.
        sample: its index.
    """
    person, moved = result.people[sample], result.object_motion
    T, palms = moved.T_world_object, person.human.joints[:, 22:].astype(np.float64)
    points = [moved.mesh.vertices, sample_surface(moved.mesh, POINTS).points]
    ruled = constrain(palms, np.concatenate(points), T)
    places = to_local(T, palms)
    segments = tuple(
        ContactSegment(hand, start, stop, places[start, hand])
        for hand in range(2)
        for start, stop in runs(ruled.contact[:, hand] > 0.5)
    )
    if not changed(person.segments, segments):
        return person
    thing = ObjectModel(moved.mesh, scale=1.0)
    solved = resolve(person, segments, thing.clip(T), thing, body_of(result))
    return replace(solved, human=replace(solved.human, hand_contact=ruled.contact))
