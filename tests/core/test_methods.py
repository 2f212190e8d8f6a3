"""The methods of the tables: what each may know, and what it must answer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.errors import AssetError
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.geometry.surface import sample_surface
from omomo_core.learning.baselines.goal import Goal, GoalConfig, ObjectFrames, spread_out
from omomo_core.learning.evaluation.evaluated_methods import LOADERS, EvaluatedMethod, Omomo
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.trainable_methods import single_stage_config
from omomo_core.motion import HumanMotion
from omomo_core.stages import body_capture, body_paper
from omomo_core.stages import hands_capture as hand_capture
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.network_file import save_network
from omomo_core.stages.stage import Stage, StageConfig
from tests.core.movers import mover

FRAMES = 40
CLIP = mover("walk", FRAMES)
QUICK = GenerationOptions(steps=2)
LEARNT = tuple(name for name in LOADERS if name != "capture")


def stage(config: StageConfig) -> Stage:
    torch.manual_seed(1)
    less = replace(config.denoiser, shape_hidden=16, width=32, layers=1, heads=2, head_width=16)
    return Stage(replace(config, denoiser=less))


def goal() -> Goal:
    torch.manual_seed(2)
    network = Goal(GoalConfig(widths=(32, 16, 16, 32), hidden=16))
    network.feelers.copy_(torch.from_numpy(spread_out(CLIP.body)))
    # Untrained offsets are no motion.
    torch.nn.init.normal_(network.out.weight, std=1e-3)
    return network


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("weights")
    for config, name in (
        (hand_paper.config("laptop"), "hands"),
        (body_paper.config("laptop"), "body"),
        (single_stage_config("laptop"), "single"),
    ):
        network = stage(config)
        save_network(network, network.config, folder / f"{name}.safetensors", {})
    goals = goal()
    save_network(goals, goals.config, folder / "goal.safetensors", {})
    return folder


@pytest.fixture(params=LEARNT)
def method(request: pytest.FixtureRequest, weights: Path) -> EvaluatedMethod:
    return LOADERS[request.param](weights, QUICK)


def same(a: HumanMotion, b: HumanMotion, atol: float = 0.0) -> bool:
    return np.allclose(a.root, b.root, atol=atol, rtol=0) and np.allclose(
        a.rotations, b.rotations, atol=atol, rtol=0
    )


def forged(clip: RealClip, first: int) -> RealClip:
    """The same object and another truth from frame `first` on."""
    other = mover("other", len(clip.root), seed=9)
    changed = {}
    for key in ("root", "rotations", "joints"):
        changed[key] = getattr(clip, key).copy()
        changed[key][first:] = getattr(other, key)[first:] + (key == "root")
    return replace(clip, **changed)


@pytest.mark.parametrize("first_frame", [True, False])
def test_people_stand_on_the_clips_bones_and_follow_the_seed(
    method: EvaluatedMethod, first_frame: bool
):
    people = method.sample(CLIP, 3, 5, first_frame=first_frame)
    assert len(people) == 3
    for person in people:
        assert person.root.shape == (FRAMES, 3)
        joints = joints_of(CLIP.body, person.root, person.rotations)
        np.testing.assert_allclose(person.joints, joints, atol=1e-5)
    again = method.sample(CLIP, 3, 5, first_frame=first_frame)
    assert all(same(a, b) for a, b in zip(people, again, strict=True))


@pytest.mark.parametrize("first_frame", [True, False])
def test_of_the_truth_a_method_knows_what_its_name_says(method: EvaluatedMethod, first_frame: bool):
    a = method.sample(CLIP, 2, 0, first_frame=first_frame)
    b = method.sample(forged(CLIP, int(first_frame)), 2, 0, first_frame=first_frame)
    knows_palms = isinstance(method, Omomo) and method.palms == "true"
    assert all(same(x, y) != knows_palms for x, y in zip(a, b, strict=True))


def test_with_the_first_frame_a_scene_elsewhere_gives_the_same_people_elsewhere(
    method: EvaluatedMethod,
):
    turn, shift = Rotation.from_euler("z", 0.8).as_matrix(), np.array([3.0, -2.0, 0.0])
    T = CLIP.motion.T_world_object.copy()
    T[:, :3, :3], T[:, :3, 3] = turn @ T[:, :3, :3], T[:, :3, 3] @ turn.T + shift
    moved = replace(
        CLIP,
        motion=replace(CLIP.motion, T_world_object=T),
        root=CLIP.root @ turn.T + shift,
        rotations=turn @ CLIP.rotations,
        joints=CLIP.joints @ turn.T + shift,
    )
    here = method.sample(CLIP, 2, 0, first_frame=True)
    there = method.sample(moved, 2, 0, first_frame=True)
    for a, b in zip(here, there, strict=True):
        expected = replace(a, root=a.root @ turn.T + shift, rotations=turn @ a.rotations)
        assert same(expected, b, atol=1e-3)


def test_without_the_first_frame_people_try_places_around_the_object(method: EvaluatedMethod):
    people = method.sample(CLIP, 4, 0, first_frame=False)
    starts = np.array([person.root[0, :2] for person in people])
    assert np.linalg.norm(np.diff(starts, axis=0), axis=1).min() > 0.1


def test_the_constraint_holds_from_the_first_touch_to_the_end_and_the_others_say_no_contact(
    weights: Path,
):
    free, constrained, true = (
        LOADERS[name](weights, QUICK) for name in ("no-constraints", "omomo", "gt-hands")
    )
    for method in (free, true):
        assert not method.sample(CLIP, 1, 0, first_frame=True)[0].hand_contact.any()
    contact = constrained.sample(CLIP, 8, 0, first_frame=True)
    assert all((np.diff(person.hand_contact, axis=0) >= 0).all() for person in contact)


def test_goal_sets_out_from_the_true_pose_and_has_one_answer(weights: Path):
    people = LOADERS["goal"](weights, QUICK).sample(CLIP, 3, 0, first_frame=True)
    np.testing.assert_allclose(people[0].root[0], CLIP.root[0], atol=1e-6)
    np.testing.assert_allclose(people[0].rotations[0], CLIP.rotations[0], atol=1e-6)
    assert np.linalg.norm(people[0].root[-1] - CLIP.root[0]) > 1e-3
    assert all(same(people[0], person) for person in people)


def test_goal_without_a_first_frame_stands_on_the_floor_before_the_object(weights: Path):
    people = LOADERS["goal"](weights, QUICK).sample(CLIP, 3, 0, first_frame=False)
    centre = CLIP.motion.T_world_object[0, :2, 3]
    for person in people:
        ankles, palms = person.joints[0, [7, 8]], person.joints[0, 22:]
        assert (abs(ankles[:, 2] - 0.08) < 0.05).all()
        # Left of them is left as they face the object, and the arms hang.
        to_object = centre - person.root[0, :2]
        left = palms[0, :2] - palms[1, :2]
        assert to_object[0] * left[1] - to_object[1] * left[0] > 0.1
        assert (palms[:, 2] < person.root[0, 2]).all()


def test_the_nearest_surface_is_the_nearest():
    random = np.random.default_rng(3)
    surface = sample_surface(CLIP.motion.mesh, 300).points
    R = Rotation.random(2, random_state=0).as_matrix()
    centre, points = random.normal(size=(2, 3)), random.normal(size=(2, 7, 3))
    things = ObjectFrames(*(torch.from_numpy(x)[None] for x in (surface, centre, R)))
    found = things.nearest(torch.from_numpy(points)[None])[0].numpy()
    for k in range(2):
        world = surface @ R[k].T + centre[k]
        np.testing.assert_allclose(
            points[k] + found[k], world[KDTree(world).query(points[k])[1]], atol=1e-9
        )


def test_our_generator_answers_too_and_missing_networks_are_named(tmp_path: Path):
    for name, config in (("hands", hand_capture.CONFIG), ("body", body_capture.CONFIG)):
        less = replace(config, denoiser=replace(config.denoiser, layers=1))
        save_network(Stage(less), less, tmp_path / f"{name}.safetensors", {})
    method = LOADERS["capture"](tmp_path, QUICK)
    for first_frame in (True, False):
        a = method.sample(CLIP, 1, 0, first_frame=first_frame)[0]
        b = method.sample(forged(CLIP, int(first_frame)), 1, 0, first_frame=first_frame)[0]
        assert same(a, b)
        assert np.allclose(a.root[0], CLIP.root[0], atol=0.01) == first_frame
    for name in ("goal", "single-stage"):
        with pytest.raises(AssetError, match="weights-missing"):
            LOADERS[name](tmp_path, QUICK)
