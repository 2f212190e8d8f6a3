"""What is faster than people are is a leap of a limb, with its time; what they do is none."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omomo_core.generation.person import Person
from omomo_core.generation.selection.ranking import choose, score
from omomo_core.generation.selection.selection_config import HUMAN_LIMITS, SCORE, SpeedLimits
from omomo_core.generation.selection.speed_limits import (
    PARTS,
    TURNING,
    find_leaps,
    measure_speeds,
    speed_excess,
)
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import joint

FRAMES = 40
POINTS = {
    "pelvis": (0,),
    "head": (joint("head"),),
    "palm": (22, 23),
    "ankle": (joint("left_ankle"), joint("right_ankle")),
    "toe": (joint("left_foot"), joint("right_foot")),
}
BONES = {
    "thigh": ("hip", "knee"),
    "shin": ("knee", "ankle"),
    "upper_arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
}
ELBOW_ROOM = SpeedLimits(**dict.fromkeys(asdict(HUMAN_LIMITS), 1e6))


def still(frames: int = FRAMES) -> HumanMotion:
    """Joints a decimetre apart, along the vertical."""
    joints = np.zeros((frames, 24, 3))
    joints[..., 2] = 0.1 * np.arange(24)
    return HumanMotion(
        root=joints[:, 0],
        rotations=np.tile(np.eye(3), (frames, 22, 1, 1)),
        fingers=np.tile(np.eye(3), (frames, 30, 1, 1)),
        joints=joints,
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.zeros((frames, 4)),
    )


def going(at: int, speed: float, first: int = 20, last: int = 21) -> HumanMotion:
    """One joint goes at m/s from frame `first` to frame `last`."""
    human = still()
    steps = (np.arange(FRAMES) - first).clip(0, last - first)
    human.joints[:, at, 0] += speed / FPS * steps
    return human


def swinging(a: int, b: int, degrees: float) -> HumanMotion:
    """The line from joint a to b turns by degrees a second from frame 20 to 22."""
    human = still()
    angle = np.radians(degrees) / FPS * (np.arange(FRAMES) - 20).clip(0, 2)
    length = human.joints[0, b, 2] - human.joints[0, a, 2]
    human.joints[:, b, 0] = length * np.sin(angle)
    human.joints[:, b, 2] = human.joints[0, a, 2] + length * np.cos(angle)
    return human


def turning(
    at: int, degrees: float, frames: int = SCORE.turn_frames, about: str = "z"
) -> HumanMotion:
    """A joint turns by degrees a second from frame 20 on, over so many frames."""
    human = still()
    angle = degrees / FPS * (np.arange(FRAMES) - 20).clip(0, frames)
    human.rotations[:, at] = Rotation.from_euler(about, angle[:, None], degrees=True).as_matrix()
    return human


def only(quantity: str) -> SpeedLimits:
    return replace(ELBOW_ROOM, **{quantity: getattr(HUMAN_LIMITS, quantity)})


def found(human: HumanMotion, limits: SpeedLimits) -> list[tuple[str, int, int, float]]:
    return [(x.part.name, x.start, x.stop, round(x.speed, 3)) for x in find_leaps(human, limits)]


@pytest.mark.parametrize(
    ("quantity", "column"), [(q, k) for q, at in POINTS.items() for k in range(len(at))]
)
def test_a_joint_leaps_beyond_its_limit_and_not_before(quantity: str, column: int):
    limit, name = getattr(HUMAN_LIMITS, quantity), PARTS[quantity][column].name
    at = POINTS[quantity][column]
    assert found(going(at, 0.99 * limit), only(quantity)) == []
    fast = 1.01 * limit
    assert found(going(at, fast), only(quantity)) == [(name, 20, 21, round(fast, 3))]
    assert found(going(at, fast, 5, 9), only(quantity)) == [(name, 5, 9, round(fast, 3))]


@pytest.mark.parametrize("quantity", BONES)
@pytest.mark.parametrize("column", [0, 1])
def test_a_limb_that_swings_beyond_its_limit_leaps_and_not_before(quantity: str, column: int):
    limit, part = getattr(HUMAN_LIMITS, quantity), PARTS[quantity][column]
    a, b = (joint(f"{('left', 'right')[column]}_{end}") for end in BONES[quantity])
    assert found(swinging(a, b, 0.99 * limit), only(quantity)) == []
    fast = 1.01 * limit
    assert found(swinging(a, b, fast), only(quantity)) == [(part.name, 20, 22, round(fast, 3))]


@pytest.mark.parametrize(
    ("quantity", "people", "nobody"),
    [
        ("pelvis", 2.1, 2.3),
        ("head", 2.3, 2.5),
        ("palm", 4.9, 5.1),
        ("ankle", 4.8, 5.0),
        ("toe", 5.7, 5.9),
        ("thigh", 540, 560),
        ("shin", 520, 540),
        ("upper_arm", 410, 430),
        ("forearm", 580, 600),
        ("turn", 330, 350),
    ],
)
def test_recorded_people_reach_so_much_and_no_more(quantity: str, people: float, nobody: float):
    """The 99.9th percentile of people who do not run, jump or play; `docs/generation.md` has the table."""

    def moved(speed: float) -> HumanMotion:
        if quantity == "turn":
            return turning(TURNING[0], speed)
        if quantity in BONES:
            return swinging(*(joint(f"left_{end}") for end in BONES[quantity]), speed)
        return going(POINTS[quantity][0], speed)

    assert find_leaps(moved(people), only(quantity)) == ()
    assert len(find_leaps(moved(nobody), only(quantity))) == 1


@pytest.mark.parametrize("column", [0, 1])
def test_a_turn_of_the_trunk_about_the_vertical_is_measured_over_three_frames(column: int):
    name, at, limit = PARTS["turn"][column].name, TURNING[column], HUMAN_LIMITS.turn
    assert found(turning(at, 0.99 * limit), only("turn")) == []
    fast = 1.01 * limit
    # Only the three steps of the turn themselves are beyond the limit.
    assert found(turning(at, fast), only("turn")) == [(name, 20, 23, round(fast, 3))]
    # Twice as fast for one frame is no more than the limit over three.
    assert found(turning(at, 2 * limit, frames=1), only("turn")) == []
    assert found(turning(at, 1800.0, about="x"), only("turn")) == []
    assert found(turning(at, -1790.0), only("turn"))[0][3] == 1790.0


def test_a_limb_is_told_once_at_a_time_for_its_part_that_is_farthest_beyond():
    foot, toes = joint("left_ankle"), joint("left_foot")
    human = going(foot, 1.5 * HUMAN_LIMITS.ankle)
    human.joints[:, toes] += (
        going(toes, 1.2 * HUMAN_LIMITS.toe).joints[:, toes] - human.joints[:, toes]
    )
    limits = replace(only("ankle"), toe=HUMAN_LIMITS.toe)
    (leap,) = find_leaps(human, limits)
    assert (leap.part.limb, leap.quantity) == ("left leg", "ankle")
    # What turns is told where nothing moves too fast, however much too fast it turns.
    swung = replace(limits, shin=1.0)
    assert find_leaps(human, swung)[0].quantity == "ankle"
    assert find_leaps(going(foot, 0.9 * HUMAN_LIMITS.ankle), swung)[0].quantity == "shin"
    both = replace(human, joints=human.joints.copy())
    both.joints[:, 23] = going(23, 2 * HUMAN_LIMITS.palm, 3, 4).joints[:, 23]
    told = find_leaps(both, replace(limits, palm=HUMAN_LIMITS.palm))
    assert [leap.part.limb for leap in told] == ["right arm", "left leg"]


def test_a_person_who_leaps_is_worse_by_how_far_and_how_long():
    assert speed_excess(still()) == 0.0
    one = going(22, 3 * HUMAN_LIMITS.palm)
    assert speed_excess(one) == pytest.approx(2.0)
    assert speed_excess(going(22, 3 * HUMAN_LIMITS.palm, 10, 14)) == pytest.approx(8.0)
    assert speed_excess(going(22, 0.99 * HUMAN_LIMITS.palm, 10, 30)) == 0.0
    held = np.zeros(FRAMES, bool)
    assert score(_person(one), held)["leaping"] == speed_excess(one)


def _person(human: HumanMotion) -> Person:
    return Person(human, (), np.zeros((FRAMES, 2)), np.zeros(FRAMES))


def test_a_few_frames_are_measured_too():
    for frames in (1, 2, SCORE.turn_frames):
        speeds = measure_speeds(still(frames).joints, still(frames).rotations[:, TURNING])
        assert all(values.shape[0] == frames - 1 for values in speeds.values())
        assert find_leaps(still(frames)) == ()
    four = still(SCORE.turn_frames + 1)
    four.rotations[-1, 0] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    assert [(x.start, x.stop, round(x.speed)) for x in find_leaps(four)] == [
        (0, SCORE.turn_frames, 900)
    ]


def test_who_leaps_is_not_shown_while_somebody_does_not():
    people = [still() for _ in range(4)]
    for k, person in enumerate(people):
        person.joints[..., 0] += (0.0, 0.1, 0.2, 5.0)[k]
    calm = [{"total": t, "leaping": 0.0, "inside_cm": 0.0} for t in (1.0, 0.5, 2.0, 9.0)]
    assert choose(people, calm) == 1
    wild = [dict(s, leaping=0.01) for s in calm]
    assert choose(people, [calm[0], wild[1], calm[2], calm[3]]) == 0
    assert choose(people, [wild[0], wild[1], wild[2], calm[3]]) == 3
    assert choose(people, wild) == 1


def test_who_is_deep_in_the_object_is_not_shown_while_somebody_is_not():
    people = [still() for _ in range(3)]
    for k, person in enumerate(people):
        person.joints[..., 0] += (0.0, 0.1, 5.0)[k]
    depths = (3.0, 4.0, 0.5)
    deep = [{"total": d, "leaping": 0.0, "inside_cm": d} for d in depths]
    assert choose(people[:2], deep[:2]) == 0
    assert choose(people, deep) == 2
    assert choose(people, [*deep[:2], dict(deep[2], leaping=0.01)]) == 0
