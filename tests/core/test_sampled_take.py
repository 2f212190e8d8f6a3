"""People of a take that are sampled first and solved later, one by one."""

import numpy as np
import pytest
import roma
import torch

from omomo_core.generation.conditioning import Conditioning, Pose
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate, sample_take
from omomo_core.generation.person import Person
from omomo_core.generation.sampled_file import load_sampled
from omomo_core.generation.selection.ranking import is_good, order_as_sampled
from omomo_core.motion import HandMotion
from omomo_core.skeleton import joint
from omomo_core.weights.load import load_stages
from tests.core.test_generation import carried, untrained
from tests.core.test_generation_stream import BODY

ARMS = [
    joint(f"{side}_{name}") for side in ("left", "right") for name in ("shoulder", "elbow", "wrist")
]
FRAMES = 900
"""More than a chunk has."""


@pytest.fixture(scope="module")
def made():
    """A generation of three people, of whom only what is shown is solved, and its sampled take."""
    asked = carried(FRAMES), BODY, untrained(), GenerationOptions(3, steps=2, solve="shown")
    return generate(*asked), sample_take(*asked)


def _same(a: Person, b: Person) -> bool:
    names = ("root", "rotations", "fingers", "joints", "hand_contact", "foot_contact")
    return all(np.array_equal(getattr(a.human, n), getattr(b.human, n)) for n in names)


def test_what_is_shown_is_solved_and_the_others_are_as_sampled(made):
    generation, take = made
    assert len(take.chunks) == 2
    assert generation.chosen not in generation.unsolved
    assert generation.people[generation.chosen].finger_fit is not None
    for k in generation.unsolved:
        assert _same(generation.people[k], take.as_sampled(k))
        assert len(generation.people[k].miss) == FRAMES


def test_a_person_is_the_same_whenever_and_by_however_many_threads_they_are_solved(made):
    generation, take = made
    before = torch.get_num_threads()
    torch.set_num_threads(3 - min(before, 2))
    again = take.solve(generation.chosen)
    torch.set_num_threads(before)
    assert _same(again, generation.people[generation.chosen])


def test_solving_one_moves_them_as_solving_all_does():
    asked = carried(100), BODY, untrained(), GenerationOptions(samples=2, steps=2, seed=4)
    whole, take = generate(*asked), sample_take(*asked)
    for k in range(2):
        apart = take.solve(k).human.joints - whole.people[k].human.joints
        assert np.linalg.norm(apart, axis=-1).mean() < 0.002


def test_of_a_long_take_two_are_solved_at_most(made):
    generation, take = made
    assert len(generation.unsolved) >= take.samples - 2
    solved = set(range(take.samples)) - generation.unsolved
    totals = {k: generation.scores[k]["total"] for k in solved}
    assert generation.chosen == min(totals, key=lambda k: totals[k]) or len(solved) == 1


def test_joints_of_arms_do_not_snap_where_chunks_meet():
    options = GenerationOptions(1, steps=4, solve="shown")
    take = sample_take(carried(FRAMES), BODY, load_stages(), options)
    first, second = (sample.chunk for sample in take.chunks)
    person = take.solve(0)
    seam = second.first + second.prefix_frames
    assert seam == first.stop
    assert person.human.hand_contact[seam].max() == 1.0
    R = torch.from_numpy(person.human.rotations)
    turned = torch.rad2deg(roma.rotmat_geodesic_distance(R[1:], R[:-1]))[seam - 2 : seam + 25, ARMS]
    assert turned.max() < 6


def test_progress_of_solving_ends_at_one(made):
    _, take = made
    told: list[float] = []
    take.solve(0, told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_the_order_is_by_distance_and_lasting_faults(made):
    _, take = made
    people = [take.as_sampled(k) for k in range(3)]
    order, scores = order_as_sampled(people, take.must_hold)
    assert sorted(order) == [0, 1, 2]
    assert all(scores[k]["total"] >= 0 for k in order)


@pytest.mark.parametrize(
    ("leaping", "inside_cm", "total", "frames", "good"),
    [
        (0.0, 0.1, 1.0, 300, True),
        (0.4, 0.1, 1.0, 300, False),
        (0.0, 9.0, 1.0, 300, False),
        (0.0, 0.1, 9.0, 300, False),
        (0.4, 0.1, 4.4, 2700, True),
        (0.8, 0.1, 1.0, 2700, False),
    ],
)
def test_who_leaps_is_deep_or_has_many_faults_is_not_shown_without_a_look_at_others(
    leaping: float, inside_cm: float, total: float, frames: int, good: bool
):
    scores = {"leaping": leaping, "inside_cm": inside_cm, "total": total}
    assert is_good(scores, frames) == good


def test_a_take_in_files_gives_the_same_people_and_can_be_read_again(made, tmp_path):
    in_memory, take = made
    asked = carried(FRAMES), BODY, untrained(), GenerationOptions(3, steps=2, solve="shown")
    in_files = generate(*asked, sampled_file=tmp_path / "sampled.npz")
    assert in_files.chosen == in_memory.chosen
    assert in_files.scores == in_memory.scores
    for one, other in zip(in_files.people, in_memory.people, strict=True):
        assert _same(one, other)
        assert not one.human.joints.flags.owndata
    assert [path.name for path in tmp_path.iterdir()] == ["sampled.npz"]
    read = load_sampled(tmp_path / "sampled.npz", BODY)
    assert _same(read.as_sampled(1), take.as_sampled(1))
    assert np.array_equal(read.must_hold, take.must_hold)


def test_palms_and_a_pose_that_are_given_are_kept_in_the_file(made, tmp_path):
    generation, _ = made
    first, motion = generation.people[0].human, carried(60)
    hands = HandMotion(first.joints[:60, 22:], first.hand_contact[:60])
    given = Conditioning(hands=hands, start_pose=Pose(first.root[0], first.rotations[0]))
    asked = motion, BODY, untrained(), GenerationOptions(2, steps=2)
    kept = sample_take(*asked, conditioning=given, sampled_file=tmp_path / "sampled.npz")
    assert _same(kept.solve(1), sample_take(*asked, conditioning=given).solve(1))
