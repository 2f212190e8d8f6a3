"""Samples are there to differ: in the heading they look from, and in how upright they stay."""

import contextlib

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.model import load_body
from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning, Pose
from omomo_core.generation.generation_config import RECORDED, ChunkSizes
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.sampling import sample_body as stage_2
from omomo_core.generation.sampling import sample_hands as stage_1
from omomo_core.generation.sampling.sample_body import WindowConditions, sample_take
from omomo_core.generation.stream import stream
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.stage import WINDOW, Stage, Stages
from omomo_core.stages.stage_config import HAND_STAGE

BODY = load_body()
FRAMES = 240


def _motion(metres: float = 5.0, frames: int = FRAMES) -> ObjectMotion:
    solid = trimesh.creation.box((0.4, 0.3, 0.3))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = np.linspace(0, metres, frames), 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return ObjectMotion(mesh, T, np.ones(frames, bool))


class Enough(Exception):
    """What the samplers are given has been seen."""


class Seen:
    """What the samplers are given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.headings: list[torch.Tensor] = []
        """Of each guess of the palms, in the middle of its first window; radians."""
        self.told: list[WindowConditions] = []

        def hands(
            stage: Stage, noise: torch.Tensor, told: WindowConditions, *args: object, **more: object
        ):
            x_axis = told.axes.unflatten(0, (len(noise), -1))[:, 0, WINDOW // 2, :, 0]
            self.headings.append(torch.atan2(x_axis[:, 1], x_axis[:, 0]))
            return sample_take(stage, noise, told, *args, **more)  # type: ignore[arg-type]

        def body(
            stage: Stage, noise: torch.Tensor, told: WindowConditions, *args: object, **more: object
        ):
            self.told.append(told)
            return sample_take(stage, noise, told, *args, **more)  # type: ignore[arg-type]

        monkeypatch.setattr(stage_1, "sample_take", hands)
        monkeypatch.setattr(stage_2, "sample_take", body)

    def run(
        self,
        samples: int,
        known: Conditioning = UNCONDITIONED,
        sampler: str = "dpm++",
        motion: ObjectMotion | None = None,
        sizes: ChunkSizes = RECORDED,
        until: str = "solve",
    ) -> None:
        """Generate as far as this step; what becomes of the samples then is not looked at here."""
        torch.manual_seed(0)
        stages = Stages(
            Stage(hand_stage.CONFIG).eval(), Stage(body_stage.CONFIG).eval(), BODY.height
        )
        options = GenerationOptions(samples, 3, sampler=sampler, steps=2)  # type: ignore[arg-type]
        given = motion or _motion()

        def stop(name: str, done: float) -> None:
            if name == until:
                raise Enough

        with contextlib.suppress(Enough):
            list(
                stream(
                    given.mesh, given.T_world_object, BODY, stages, options, stop, known,
                    chunk_sizes=sizes,
                )
            )  # fmt: skip


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    return Seen(monkeypatch)


@pytest.mark.parametrize("samples", [4, 8, pytest.param(20, marks=pytest.mark.slow)])
def test_guesses_look_as_in_training_mostly_along_the_travel(seen: Seen, samples: int):
    seen.run(samples)
    guesses = seen.headings[0]
    near = guesses[torch.arange(len(guesses)) % 4 < 3]
    assert len(near) == 0.75 * len(guesses)
    assert near.std().item() == pytest.approx(HAND_STAGE.heading_spread, rel=0.3)
    assert near.mean().abs() < 0.15
    others = guesses[3::4].sort().values
    gaps = torch.diff(others, append=others[:1] + 2 * torch.pi)
    assert gaps.max() < 2.7 * 2 * torch.pi / len(others)


def test_guesses_look_at_what_stays_from_all_around(seen: Seen):
    seen.run(4, motion=_motion(metres=0.0))
    around = seen.headings[0].sort().values
    gaps = torch.diff(around, append=around[:1] + 2 * torch.pi)
    assert gaps.max() < 2.7 * 2 * torch.pi / len(around)


def test_guesses_look_from_their_own_headings_where_only_the_first_pose_is_known(seen: Seen):
    pose = Pose(np.array([0.5, 0, 0.9]), np.tile(np.eye(3), (22, 1, 1)))
    seen.run(3)
    seen.run(3, Conditioning(start_pose=pose))
    torch.testing.assert_close(seen.headings[0], seen.headings[1])


def test_what_has_begun_is_gone_on_with_as_it_travels(seen: Seen):
    """The second chunk of a take."""
    seen.run(3, sizes=ChunkSizes(length=150, context=30, margin=20, spare=0), until="never")
    assert len(seen.headings) == 2
    torch.testing.assert_close(seen.headings[1], torch.zeros(3))


def test_each_sample_has_its_habit_throughout_a_take(seen: Seen):
    """The last number that stage 2 is told, in all windows of all stretches: sample by sample."""
    seen.run(3)
    wanted = 2 * stage_2.posture_levels(3, 3) - 1
    for told in seen.told:
        habit = told.condition[..., -1].unflatten(0, (3, -1))
        np.testing.assert_allclose(habit, wanted[:, None, None].expand_as(habit), atol=1e-6)
    assert len(set(wanted.tolist())) == 3
