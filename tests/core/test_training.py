"""Corpus, examples and the loop: mirroring is exact, learning happens, resuming is exact."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import torch

from omomo_core.diffusion.denoiser import DenoiserConfig
from omomo_core.errors import AssetError, InputError
from omomo_core.learning.baselines.goal import GoalConfig, GoalTraining
from omomo_core.learning.recordings.clips import load_clips, save_clips
from omomo_core.learning.trainable_methods import MethodName, networks, single_stage_config
from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.denoising import Denoising
from omomo_core.learning.training.training_loop import (
    ProcessGroup,
    TrainState,
    resume_run,
    save_run,
    start,
    train,
)
from omomo_core.learning.training.training_task import Make, TrainingTask, TrainOptions, collate
from omomo_core.stages import body_capture, body_paper
from omomo_core.stages import hands_capture as hand_capture
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.network_file import read_header, save_network
from omomo_core.stages.stage import Stage, StageConfig, StageName, load_stage
from omomo_core.weights.load import load_stages
from tests.core.training_clips import BODY, CLIPS

ALONE = ProcessGroup(torch.device("cpu"))


@pytest.fixture(scope="module")
def corpus() -> Corpus:
    return Corpus(CLIPS, BODY, synthesis_share=0.7)


def test_clip_files_round_trip(tmp_path: Path):
    save_clips(tmp_path / "clips.npz", CLIPS)
    for a, b in zip(CLIPS, load_clips(tmp_path / "clips.npz"), strict=True):
        assert (a.name, a.source, a.licence) == (b.name, b.source, b.licence)
        np.testing.assert_allclose(a.rotations, b.rotations, atol=1e-6)
        assert (a.object_motion is None) == (b.object_motion is None)
        if a.object_motion and b.object_motion:
            np.testing.assert_array_equal(a.object_motion.mesh.faces, b.object_motion.mesh.faces)
            np.testing.assert_allclose(
                a.object_motion.T_world_object, b.object_motion.T_world_object, atol=1e-6
            )


def test_a_damaged_clip_file_is_named(tmp_path: Path):
    save_clips(tmp_path / "clips.npz", CLIPS)
    whole = (tmp_path / "clips.npz").read_bytes()
    for bad in (b"", b"no npz", whole[: len(whole) // 2]):
        (tmp_path / "bad.npz").write_bytes(bad)
        with pytest.raises(InputError, match="clips-damaged"):
            load_clips(tmp_path / "bad.npz")
    assert [p.name for p in tmp_path.glob("clips*")] == ["clips.npz"]


def small(stage: StageName) -> StageConfig:
    base = hand_capture if stage == "hands" else body_capture
    d = base.CONFIG.denoiser
    sizes = DenoiserConfig(
        channels=d.channels, condition=d.condition, shape=d.shape, shape_hidden=32, shape_width=16,
        width=64, layers=1, heads=2, head_width=16, feedforward=64, patch=4, mask_keys=True, dropout=0.0,
    )  # fmt: skip
    return StageConfig(stage, "capture", sizes)


def little(config: StageConfig) -> StageConfig:
    """A network of the paper with its inputs and outputs, and hardly anything between."""
    less = replace(config.denoiser, shape_hidden=16, width=32, layers=1, heads=2, head_width=16)
    return replace(config, denoiser=less)


MAKES: dict[str, Make] = {
    "hands of capture": partial(Denoising, small("hands")),
    "body of capture": partial(Denoising, small("body")),
    "hands of the paper": partial(Denoising, little(hand_paper.config("laptop"))),
    "body of the paper": partial(Denoising, little(body_paper.config("laptop"))),
    "single stage": partial(Denoising, little(single_stage_config("laptop"))),
    "goal": partial(GoalTraining, GoalConfig(widths=(64, 32, 32, 64), hidden=32, dropout=0.0)),
}


@pytest.mark.parametrize("which", MAKES)
def test_training_learns(corpus: Corpus, which: str):
    # An odd batch is drawn at once.
    options = TrainOptions(steps=20, batch=5, rate=3e-3, warmup=2)
    state = start(MAKES[which], corpus, options, ALONE)
    before = loss_of(state.task, corpus)
    train(state, corpus, options, lambda s: True, ALONE)
    assert loss_of(state.task, corpus) < 0.8 * before
    assert np.isfinite(state.loss)
    assert state.seconds > 0


def loss_of(task: TrainingTask, corpus: Corpus) -> float:
    """On the same windows each time."""
    torch.manual_seed(7)
    example = collate([task.draw(corpus, 16)], ALONE.device)
    with torch.no_grad():
        loss = task.loss(task.network.train(), example, TrainOptions(1), ALONE.mean)
    return float(loss)


@pytest.mark.parametrize("method", get_args(MethodName))
def test_the_laptops_networks_see_and_say_what_the_published_ones_do(method: MethodName):
    for name, plan in networks(method, "laptop").items():
        ours, published = plan.make(), networks(method, "published")[name].make()
        assert ours.name == published.name == name
        if isinstance(ours, Denoising) and isinstance(published, Denoising):
            a, b = (
                replace(each.config.denoiser, **dict.fromkeys(TRUNK, 0))
                for each in (ours, published)
            )
            assert a == b
        else:
            assert first_and_last(ours.network) == first_and_last(published.network)


TRUNK = ("shape_hidden", "shape_width", "width", "head_width", "feedforward", "patch")


def first_and_last(network: torch.nn.Module) -> tuple[int, int]:
    shapes = [p.shape for p in network.parameters()]
    return shapes[0][0], shapes[-1][0]


@pytest.mark.parametrize("which", ["hands of capture", "single stage", "goal"])
def test_an_interrupted_run_resumes_to_the_same_weights(corpus: Corpus, tmp_path: Path, which: str):
    options, make = TrainOptions(steps=8, batch=4, warmup=2), MAKES[which]

    def run(state: TrainState, until: int) -> TrainState:
        train(state, corpus, options, lambda s: s.step < until, ALONE)
        return state

    whole = run(start(make, corpus, options, ALONE), 99)
    save_run(run(start(make, corpus, options, ALONE), 4), tmp_path, options, {})
    resumed = resume_run(make, tmp_path, options, ALONE)
    assert resumed is not None
    assert resumed.step == 4
    run(resumed, 99)
    ours, theirs = whole.average.state_dict(), resumed.average.state_dict()
    assert all(torch.equal(ours[k], theirs[k]) for k in ours)


def test_a_run_of_another_size_is_not_resumed(corpus: Corpus, tmp_path: Path):
    options = TrainOptions(steps=1, batch=4)
    save_run(start(MAKES["goal"], corpus, options, ALONE), tmp_path, options, {})
    larger = partial(GoalTraining, GoalConfig(widths=(64, 64, 64, 64), hidden=32))
    with pytest.raises(InputError, match="run-differs"):
        resume_run(larger, tmp_path, options, ALONE)


def test_weights_tell_how_they_were_trained(corpus: Corpus, tmp_path: Path):
    options = TrainOptions(steps=2, batch=8, seed=3)
    state = start(MAKES["goal"], corpus, options, ALONE)
    train(state, corpus, options, lambda s: True, ALONE)
    save_run(state, tmp_path, options, {"method": "goal"})
    told = read_header(tmp_path / "goal.safetensors").notes
    assert {"method": "goal", "steps_done": "2", "windows_seen": "16", "seed": "3"}.items() <= (
        told.items()
    )
    assert float(told["cpu_seconds"]) == pytest.approx(state.seconds, abs=0.1)


def test_weights_round_trip_and_damage_is_named(tmp_path: Path):
    torch.manual_seed(0)
    stage = Stage(small("body"))
    save_network(stage, stage.config, tmp_path / "a.safetensors", {"note": "x"})
    loaded = load_stage(tmp_path / "a.safetensors")
    assert loaded.config == stage.config
    for a, b in zip(stage.parameters(), loaded.parameters(), strict=True):
        assert torch.allclose(a, b, atol=1e-2)
    (tmp_path / "b.safetensors").write_bytes((tmp_path / "a.safetensors").read_bytes()[:1000])
    with pytest.raises(AssetError, match="weights-damaged"):
        load_stage(tmp_path / "b.safetensors")
    with pytest.raises(AssetError, match="weights-missing"):
        load_stage(tmp_path / "none.safetensors")


def test_weights_of_an_earlier_version_are_named(tmp_path: Path):
    """A network that is told other things would give nonsense, or a traceback."""
    for config in (hand_capture.CONFIG, body_capture.CONFIG):
        told = config.denoiser.condition - (config.stage == "hands")
        older = replace(config, denoiser=replace(config.denoiser, layers=1, condition=told))
        save_network(Stage(older), older, tmp_path / f"{config.stage}.safetensors", {})
    with pytest.raises(AssetError, match=r"hands\.safetensors.*weights-outdated"):
        load_stages("capture", tmp_path)
