"""The generator with untrained networks: what must hold whatever the networks say."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body, with_height
from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets, penetration_depth
from omomo_core.errors import InputError
from omomo_core.generation.conditioning import Conditioning, Pose
from omomo_core.generation.decoding import despike
from omomo_core.generation.generation_options import Generation, GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.selection.ranking import choose
from omomo_core.generation.selection.selection_config import SCORE
from omomo_core.generation.solving.bodies import SolvedBodies, solve_bodies
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import HandMotion, ObjectMesh, ObjectMotion
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages import body_paper
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.stage import Stage, Stages

BODY = load_body()
UPRIGHT = torch.tensor([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def untrained(configuration: str = "capture") -> Stages:
    torch.manual_seed(0)
    if configuration == "paper":
        return Stages(Stage(hand_paper.CONFIG).eval(), Stage(body_paper.CONFIG).eval(), BODY.height)
    stages = Stages(Stage(hand_stage.CONFIG).eval(), Stage(body_stage.CONFIG).eval(), BODY.height)
    for stage in (stages.hands, stages.body):
        # New networks predict the mean whatever they see; these shall differ.
        torch.nn.init.normal_(stage.denoiser.out.weight, std=0.05)
    return stages


def carried(frames: int) -> ObjectMotion:
    solid = trimesh.creation.box((0.4, 0.3, 0.3))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = np.linspace(0, frames / 40, frames), 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return ObjectMotion(mesh, T, np.ones(frames, bool))


def run(motion: ObjectMotion, **options: object) -> Generation:
    settings = {"samples": 2, "steps": 3, **options}
    return generate(
        motion, BODY, untrained(), GenerationOptions(**settings), lambda name, done: None
    )  # type: ignore[arg-type]


@pytest.mark.parametrize("frames", [1, 37, 120, 121, 400])
def test_takes_of_any_length(frames: int):
    made = run(carried(frames))
    assert len(made.motions) == 2
    assert made.motions[0].joints.shape == (frames, 24, 3)
    assert np.isfinite(made.motions[0].joints).all()
    # Both are as central; one that is much deeper in the object or leaps much more is not shown.
    deepest, wildest = (
        min(s[name] for s in made.scores) + more
        for name, more in (("inside_cm", 100 * SCORE.extra_depth), ("leaping", SCORE.more_leaping))
    )
    shown = (s for s in made.scores if s["inside_cm"] <= deepest and s["leaping"] <= wildest)
    assert made.scores[made.chosen]["total"] == min(s["total"] for s in shown)


def test_the_same_seed_gives_the_same_people_and_another_seed_others():
    a, b, c = run(carried(60)), run(carried(60)), run(carried(60), seed=1)
    np.testing.assert_array_equal(a.motions[1].joints, b.motions[1].joints)
    assert np.abs(a.motions[1].joints - c.motions[1].joints).max() > 0.01
    assert np.abs(a.motions[0].joints - a.motions[1].joints).max() > 0.01


def test_joints_are_the_kinematics_of_the_rotations():
    human = run(carried(60)).motions[0]
    joints = forward_kinematics(
        BODY, torch.from_numpy(human.root), torch.from_numpy(human.rotations)
    )
    np.testing.assert_allclose(human.joints, joints.numpy(), atol=1e-5)
    R = human.rotations
    np.testing.assert_allclose(
        R @ R.swapaxes(-1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-4
    )


def test_where_the_walk_takes_place_changes_nothing():
    here, there = carried(125), carried(125)
    there.T_world_object[:, 0, 3] += 60.0
    a, b = run(here).motions[0].joints, run(there).motions[0].joints
    # An untrained person leaps about; where one does it just so fast, a rounding decides what is calmed.
    off = np.abs(a - b + [60.0, 0, 0])
    assert np.median(off) < 5e-4


def test_a_taller_person_is_the_scene_scaled():
    motion = carried(90)
    small = ObjectMotion(
        ObjectMesh(motion.mesh.vertices / 1.1, motion.mesh.faces, "box"),
        motion.T_world_object.copy(),
        motion.valid,
    )
    small.T_world_object[:, :3, 3] /= 1.1
    options = GenerationOptions(samples=1, steps=3)
    tall = with_height(BODY, 1.1 * BODY.height)
    a = generate(motion, tall, untrained(), options, lambda name, done: None).motions[0]
    b = generate(small, BODY, untrained(), options, lambda name, done: None).motions[0]
    # The palm's thickness and the floor's are not scaled: hence centimetres.
    assert np.median(np.abs(a.root / 1.1 - b.root)) < 0.1


def standing(frames: int) -> tuple[torch.Tensor, torch.Tensor]:
    root = torch.tensor([0.0, 0.0, float(BODY.rest_joints[0, 1])]).expand(frames, 3).clone()
    return root, UPRIGHT.expand(frames, 22, 3, 3).clone()


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> MeshObstacle:
    solid = trimesh.creation.box(bounds=[low, high])
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "block")
    return MeshObstacle(distance_field(mesh), torch.zeros(3))


FAR = block((50.0, 50.0, 50.0), (51.0, 51.0, 51.0))


def solve(
    root: torch.Tensor,
    R: torch.Tensor,
    palms: torch.Tensor,
    hold: torch.Tensor,
    obstacle: MeshObstacle = FAR,
) -> tuple[torch.Tensor, torch.Tensor, SolvedBodies]:
    """One sample whose feet are all said to stand: its joints, its rotations, and all."""
    frames = len(root)
    targets = InteractionTargets(
        palms[None], hold[None], R[None][:, :, (20, 21)], np.tile(np.eye(4), (frames, 1, 1)),
        obstacle, np.zeros(frames),
    )  # fmt: skip
    out = solve_bodies(BODY, root[None], R[None], torch.ones(1, frames, 4), targets)
    return forward_kinematics(BODY, out.root, out.rotations)[0], out.rotations[0], out


def test_holding_palms_reach_their_places_and_free_ones_stay():
    root, R = standing(40)
    start = forward_kinematics(BODY, root, R)
    palms = start[:, 22:].clone()
    palms[:, 0] = torch.tensor([0.15, -0.4, 1.1])
    hold = torch.tensor([1.0, 0.0]).expand(40, 2).clone()
    joints, turned, out = solve(root, R, palms, hold)
    assert (joints[:, 22] - palms[:, 0]).norm(dim=-1).max() < 5e-4
    assert out.miss.max() < 5e-4
    # The free arm goes with the trunk.
    assert (turned[:, 9].mT @ turned[:, 17] - R[:, 9].mT @ R[:, 17]).abs().max() < 0.3


def test_a_planted_foot_that_slides_is_stopped_and_never_sinks():
    root, R = standing(60)
    root[:, 1] += torch.linspace(0, 0.12, 60)
    root[:, 2] -= 0.05
    palms, hold = torch.zeros(60, 2, 3), torch.zeros(60, 2)
    joints, _, _ = solve(root, R, palms, hold)
    assert joints[:, 7].diff(dim=0).norm(dim=-1).max() < 1e-4
    assert joints[:, 10:12, 2].min() > float(BODY.rest_joints[10, 1]) - 1e-3


@pytest.mark.parametrize("pace", [0.4, 0.9, 1.4])
def test_a_body_that_glides_is_given_steps(pace: float):
    root, R = standing(150)
    root[:, 1] -= torch.arange(150) * pace / 30
    palms, hold = torch.zeros(150, 2, 3), torch.zeros(150, 2)
    joints, _, out = solve(root, R, palms, hold)
    speed = 30 * joints[:, (7, 8), :2].diff(dim=0).norm(dim=-1)
    # Somebody always stands, the feet keep up with the body, and take turns.
    assert speed.min(dim=1).values.quantile(0.95) < 0.1
    assert (joints[:, (7, 8), 1] - root[:, None, 1]).abs().max() < 0.75
    left_swings = (speed[:, 0] > 0.3) & (speed[:, 1] < 0.1)
    right_swings = (speed[:, 1] > 0.3) & (speed[:, 0] < 0.1)
    assert left_swings.sum() > 20
    assert right_swings.sum() > 20
    assert out.standing.any(axis=-1).all()
    lengths = (joints[:, 4] - joints[:, 1]).norm(dim=-1)
    assert lengths.std() < 1e-5


def test_out_of_reach_is_reported_not_hidden():
    root, R = standing(20)
    palms = torch.tensor([3.0, 3.0, 3.0]).expand(20, 2, 3).clone()
    _, _, out = solve(root, R, palms, torch.ones(20, 2))
    assert out.miss.min() > 0.5


def test_the_published_model_makes_one_window_and_refuses_more():
    options = GenerationOptions(samples=2, steps=2, contact="paper")
    made = generate(carried(90), BODY, untrained("paper"), options, lambda name, done: None)
    assert made.motions[0].joints.shape == (90, 24, 3)
    full = generate(carried(120), BODY, untrained("paper"), options, lambda name, done: None)
    assert full.motions[0].joints.shape == (120, 24, 3)
    with pytest.raises(InputError, match="paper-too-long"):
        generate(carried(121), BODY, untrained("paper"), options, lambda name, done: None)


def test_a_generator_says_of_each_stage_how_far_it_is():
    told: dict[str, list[float]] = {}
    options = GenerationOptions(samples=3, steps=2)
    generate(
        carried(40),
        BODY,
        untrained(),
        options,
        lambda name, done: told.setdefault(name, []).append(done),
    )
    assert list(told) == ["object", "hands", "contact", "body", "solve"]
    for done in told.values():
        assert done == sorted(done)
        assert done[0] >= 0
        assert done[-1] == pytest.approx(1)


def test_by_the_published_rule_a_palm_that_comes_near_is_held_to_the_end():
    motion = carried(60)
    # Wherever a palm is, there is something within 3 cm.
    grid = np.stack(np.meshgrid(*[np.arange(-0.7, 0.7, 0.033)] * 3), axis=-1).reshape(-1, 3)
    mesh = ObjectMesh(grid, np.arange(300).reshape(-1, 3), "cloud")
    made = run(replace(motion, mesh=mesh), contact="paper", samples=1)
    for human in made.motions:
        assert human.hand_contact.any()
        assert (np.diff(human.hand_contact, axis=0) >= 0).all()


def pose_of(motion: Generation, k: int, frame: int) -> Pose:
    return Pose(motion.motions[k].root[frame], motion.motions[k].rotations[frame])


def test_a_take_starts_from_the_given_pose_and_does_not_jump_away_from_it():
    motion, options = carried(70), GenerationOptions(samples=2, steps=3)
    start = pose_of(run(motion, seed=5), 1, 20)
    known = Conditioning(start_pose=start)
    made = generate(motion, BODY, untrained(), options, lambda name, done: None, known)
    for person in made.motions:
        np.testing.assert_allclose(person.root[0], start.root, atol=1e-6)
        np.testing.assert_allclose(person.rotations[0], start.rotations, atol=1e-5)
        step = np.linalg.norm(np.diff(person.joints, axis=0), axis=-1)[:10].max()
        assert step < 0.5  # people of an untrained network are anywhere


def test_known_palms_are_followed_in_every_frame():
    motion = carried(130)
    motion.T_world_object[:, 2, 3] = 0.4
    palms = np.stack([motion.T_world_object[:, :3, 3] + [0, s * 0.2, 0] for s in (-1, 1)], axis=1)
    known = Conditioning(hands=HandMotion(palms, np.zeros((130, 2))))
    options, stages = GenerationOptions(samples=2, steps=3), untrained()
    # A network that puts the body where the palms are, whatever the noise.
    torch.nn.init.zeros_(stages.body.denoiser.out.weight)
    made = generate(motion, BODY, stages, options, lambda name, done: None, known)
    for person in made.motions:
        off = np.linalg.norm(person.joints[:, 22:] - palms, axis=-1)
        # Where the arms are long enough, though nothing is said to be in contact.
        assert (off < 1e-3).mean() > 0.5
        assert not person.hand_contact.any()


def test_the_sample_that_is_shown_is_amid_the_others_and_the_better_of_two_alike():
    person = run(carried(5)).motions[0]
    places = [0.0, 1.0, 1.2, 1.2, 9.0]
    people = [replace(person, joints=person.joints + at) for at in places]
    faults = [{"total": f, "leaping": 0.0, "inside_cm": 0.0} for f in (0.0, 5.0, 4.0, 3.0, 0.0)]
    assert choose(people, faults) == 3
    assert choose(people[:1], faults[1:2]) == 0
    assert choose(people[:2], faults[2:4]) == 1


def test_some_on_the_other_side_do_not_draw_the_choice_to_them():
    person = run(carried(5)).motions[0]
    places = [0.0, 0.3, 0.4, 0.5, 0.9, 1.0, 1.1, 5.0, 6.0]
    people = [replace(person, joints=person.joints + at) for at in places]
    assert choose(people, [{"total": 1.0, "leaping": 0.0, "inside_cm": 0.0}] * len(places)) == 3


def test_flesh_leaves_an_object_that_it_may_not_be_in():
    root, R = standing(60)
    box = block((-0.5, -0.6, 1.1), (0.5, -0.03, 1.8))
    palms, hold = torch.zeros(60, 2, 3), torch.zeros(60, 2)
    T = torch.eye(4).expand(60, 4, 4)
    before = penetration_depth(BODY, root, R, T, box)
    _, turned, out = solve(root, R, palms, hold, box)
    after = penetration_depth(BODY, out.root[0], turned, T, box)
    assert before.min() > 0.05
    assert after[5:-5].max() < 0.5 * before.min()


def test_a_leap_is_spread_over_time_and_other_frames_are_left_alone():
    x = np.zeros((120, 7))
    x[:, 0] = 0.01 * np.arange(120)
    np.testing.assert_array_equal(despike(x, 2), x)
    leap = x.copy()
    leap[60:, 1] += 0.5
    calm = despike(leap, 2)
    assert np.linalg.norm(np.diff(calm[:, :3], axis=0), axis=1).max() < 0.12
    np.testing.assert_array_equal(calm[:20], leap[:20])
    np.testing.assert_array_equal(calm[-20:], leap[-20:])
