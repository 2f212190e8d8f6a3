"""Samples are there to differ: in the noise they begin with, and in how upright they stay."""

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.load import load_body
from omomo_core.body_stage import capture as body_stage
from omomo_core.generation import body as stage_2
from omomo_core.generation import hands as stage_1
from omomo_core.generation.generator import generate
from omomo_core.generation.known import NOTHING, Known, Pose
from omomo_core.generation.overlap import Told, sample_take
from omomo_core.generation.result import GenerationOptions, Stages
from omomo_core.hand_stage import capture as hand_stage
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.stage import Stage

BODY = load_body()
FRAMES = 400


def _motion() -> ObjectMotion:
    solid = trimesh.creation.box((0.4, 0.3, 0.3))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = np.linspace(0, 5, FRAMES), 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return ObjectMotion(mesh, T, np.ones(FRAMES, bool))


class Seen:
    """What the samplers are given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.noise: list[torch.Tensor] = []
        self.told: list[Told] = []

        def hands(stage: Stage, noise: torch.Tensor, *args: object, **more: object):
            self.noise.append(noise)
            return sample_take(stage, noise, *args, **more)  # type: ignore[arg-type]

        def body(stage: Stage, noise: torch.Tensor, told: Told, *args: object, **more: object):
            self.told.append(told)
            return sample_take(stage, noise, told, *args, **more)  # type: ignore[arg-type]

        monkeypatch.setattr(stage_1, "sample_take", hands)
        monkeypatch.setattr(stage_2, "sample_take", body)

    def run(self, samples: int, known: Known = NOTHING, sampler: str = "dpm++") -> None:
        torch.manual_seed(0)
        stages = Stages(
            Stage(hand_stage.CONFIG).eval(), Stage(body_stage.CONFIG).eval(), BODY.height
        )
        options = GenerationOptions(samples, 3, sampler=sampler, steps=2)  # type: ignore[arg-type]
        generate(_motion(), BODY, stages, options, lambda name, done: None, known)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    return Seen(monkeypatch)


def test_of_several_samples_the_later_guesses_are_bolder(seen: Seen):
    seen.run(4)
    strength = seen.noise[0].std(dim=(1, 2))
    assert strength[0] == pytest.approx(1.0, abs=0.1)
    assert strength[-1] == pytest.approx(stage_1.WIDEST, abs=0.2)


@pytest.mark.parametrize(
    ("samples", "known"),
    [
        (1, NOTHING),
        (3, Known(first_frame=Pose(np.array([0.5, 0, 0.9]), np.tile(np.eye(3), (22, 1, 1))))),
    ],
)
def test_one_alone_and_those_who_are_begun_are_plain(seen: Seen, samples: int, known: Known):
    seen.run(samples, known)
    for noise in seen.noise:
        np.testing.assert_allclose(noise.std(dim=(1, 2)), 1.0, atol=0.1)


def test_each_sample_has_its_habit_throughout_a_take(seen: Seen):
    """The last number that stage 2 is told, in all windows of all stretches: sample by sample."""
    seen.run(3)
    wanted = 2 * stage_2.habits(3, 3) - 1
    for told in seen.told:
        habit = told.condition[..., -1].unflatten(0, (3, -1))
        np.testing.assert_allclose(habit, wanted[:, None, None].expand_as(habit), atol=1e-6)
    assert len(set(wanted.tolist())) == 3
