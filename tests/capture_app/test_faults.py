"""What could not be satisfied is told with its time, the longest stretches first."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.motion_faults import cause_of_leaps, held_grips, unsatisfied
from omomo_core.body.grip import GRIPS
from omomo_core.generation.person import FingerFit, Person
from omomo_core.motion import HumanMotion


def calm(person: Person) -> Person:
    """The same person, upright, without a movement."""
    human = person.human
    rest = {name: np.repeat(getattr(human, name)[:1], 40, axis=0) for name in vars(human)}
    joints = np.tile(np.arange(24)[:, None] * [0.0, 0.0, 10.0], (40, 1, 1))
    return replace(person, human=HumanMotion(**{**rest, "joints": joints}))


def test_the_longest_stretches_are_told_in_the_order_of_time(people: tuple[Person, ...]) -> None:
    miss, depth = np.zeros((40, 2)), np.zeros(40)
    miss[3:6, 0], miss[20:30, 1], miss[35:37, 1] = 0.04, 0.08, 0.5
    depth[8:15], depth[16:20] = 0.06, 0.02
    assert unsatisfied(replace(calm(people[0]), miss=miss, depth=depth)) == (
        "From 0.10 to 0.20 s the left palm is up to 4 cm off its place on the object.",
        "From 0.27 to 0.50 s the body without hands is up to 6 cm inside the object.",
        "From 0.67 to 1.00 s the right palm is up to 8 cm off its place on the object.",
    )


def test_how_hands_hold_is_told_with_its_time(people: tuple[Person, ...]) -> None:
    grip = np.zeros((40, 2), int)
    grip[3:30, 1], grip[10:20, 0] = GRIPS.index("power grip"), GRIPS.index("flat press")
    person = replace(people[0], finger_fit=FingerFit(np.zeros((40, 2)), np.zeros((40, 2)), grip))
    assert held_grips(person) == (
        "From 0.10 to 1.00 s the right hand holds: power grip.",
        "From 0.33 to 0.67 s the left hand holds: flat press.",
    )
    assert held_grips(replace(person, finger_fit=None)) == ()


def test_nothing_is_told_of_a_motion_without_faults(people: tuple[Person, ...]) -> None:
    assert unsatisfied(replace(calm(people[0]), miss=np.zeros((40, 2)), depth=np.zeros(40))) == ()


def test_a_leap_is_told_with_its_time_its_limb_and_what_people_reach(
    people: tuple[Person, ...],
) -> None:
    miss = np.zeros((40, 2))
    miss[10:14, 0] = 0.05
    person = replace(calm(people[0]), miss=miss, depth=np.zeros(40))
    joints = person.human.joints
    joints[21:, 7, 1] += 6.3 / 30
    joints[22:, 7, 1] += 6.0 / 30
    joints[5:, 23, 2] += 0.15
    assert unsatisfied(person) == (
        "From 0.33 to 0.47 s the left palm is up to 5 cm off its place on the object.",
        "From 0.67 to 0.73 s the left foot moves at 6.3 m/s; people reach 4.9.",
    )
    joints[30:, 15, 0] += 0.5
    turned = Rotation.from_euler("z", 30, degrees=True).as_matrix()
    person.human.rotations[31:, 0] = turned @ person.human.rotations[31:, 0]
    assert unsatisfied(person)[2:] == (
        "From 0.97 to 1.00 s the head moves at 15.0 m/s; people reach 2.4.",
    )
    person.human.rotations[31:, 0] = turned @ person.human.rotations[31:, 0]
    assert unsatisfied(person)[2:] == (
        "From 0.93 to 1.10 s the pelvis turns at 600 degrees a second; people reach 340.",
        "From 0.97 to 1.00 s the head moves at 15.0 m/s; people reach 2.4.",
    )


def test_a_person_who_leaps_is_a_reason_to_look_at_mesh_and_mount(
    people: tuple[Person, ...],
) -> None:
    person = calm(people[0])
    assert list(cause_of_leaps(person, Path("lamp.glb"))) == []
    person.human.joints[21:, 7, 1] += 0.5
    told = " ".join(cause_of_leaps(person, Path("lamp.glb")))
    assert "check that lamp.glb is the object, in metres" in told
    assert list(cause_of_leaps(person, None)) == []


def test_the_worst_leaps_are_told(people: tuple[Person, ...]) -> None:
    person = replace(calm(people[0]), miss=np.zeros((40, 2)), depth=np.zeros(40))
    joints = person.human.joints
    for k, frame in enumerate(range(2, 38, 6)):
        joints[frame:, 22:, 2] += (8 + k) / 30
    told = unsatisfied(person)
    assert len(told) == 5
    assert "13.0 m/s" in told[-1]
