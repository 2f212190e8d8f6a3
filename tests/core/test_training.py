"""Corpus, examples and the loop: mirroring is exact, learning happens, resuming is exact."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
import trimesh

from omomo_core.baselines import single_stage
from omomo_core.baselines.goal.network import GoalConfig
from omomo_core.baselines.goal.training import Following
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.load import load_body
from omomo_core.body_stage import capture as body_capture
from omomo_core.body_stage import paper as body_paper
from omomo_core.data.clips import Clip, load_clips, save_clips
from omomo_core.diffusion.blocks import DenoiserConfig
from omomo_core.errors import AssetError, InputError
from omomo_core.geometry.canonical import rotate, turn
from omomo_core.geometry.rotations import rotmat_from_6d, yaw_matrix
from omomo_core.hand_stage import capture as hand_capture
from omomo_core.hand_stage import paper as hand_paper
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.network_file import notes_of
from omomo_core.stage import Stage, StageConfig, StageName, load_stage, save_stage
from omomo_core.training.checkpoint import resume_run, save_run
from omomo_core.training.corpus import Corpus
from omomo_core.training.denoising import Denoising
from omomo_core.training.examples import make_example
from omomo_core.training.loop import TrainState, start, train
from omomo_core.training.methods import METHODS, MethodName, networks
from omomo_core.training.team import Team
from omomo_core.training.trainee import Make, Trainee, TrainOptions, joined
from omomo_core.windows import WINDOW

BODY = load_body()
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
ALONE = Team(torch.device("cpu"))


def clip(k: int, frames: int, *, with_object: bool) -> Clip:
    """A stiff person who glides along x with waving rotations, and perhaps a box."""
    rng = np.random.default_rng(k)
    solid = trimesh.creation.box((0.3, 0.4, 0.5))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 0, 3], T[:, 2, 3] = np.linspace(0, 2, frames), 1.0
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), f"box{k}")
    turns = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    rotations = np.tile(UPRIGHT, (frames, 22, 1, 1))
    rotations[:, 18] = turns
    root = np.zeros((frames, 3))
    root[:, 0], root[:, 2] = np.linspace(0, 2, frames), 0.95
    return Clip(
        name=f"clip{k}",
        source="test",
        licence="CC0",
        root=root,
        rotations=rotations,
        hand_contact=np.tile([1.0, 0.0], (frames, 1)),
        foot_contact=np.tile([1.0, 0.0, 1.0, 0.0], (frames, 1)),
        object_motion=ObjectMotion(mesh, T, np.ones(frames, bool)) if with_object else None,
    )


CLIPS = [clip(k, 100 + 30 * k, with_object=k % 2 == 1) for k in range(4)]


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


def test_windows_are_padded_and_mirrored_bodies_obey_kinematics(corpus: Corpus):
    torch.manual_seed(0)
    w = corpus.draw(64, 16)
    assert not w.object.valid.all(dim=1).all()
    joints = forward_kinematics(BODY, w.human.joints[:, :, 0], rotmat_from_6d(w.human.six))
    assert (joints - w.human.joints).abs().max() < 1e-4
    mirrored = w.human.hand_contact[:, 0, 1] == 1
    assert 0.2 < mirrored.float().mean() < 0.8
    # A mirrored walk along +x goes along -x, and its spin and shape follow.
    way = w.human.joints[:, 30, 0, 0] - w.human.joints[:, 0, 0, 0]
    assert ((way < 0) == mirrored).all()


def test_capture_features_unpack_to_what_was_packed(corpus: Corpus):
    torch.manual_seed(1)
    w = corpus.draw(8, 16)
    yaw = torch.randn(8)
    x = turn(body_capture.pack(w.human), -yaw, body_capture.LAYOUT)
    x = turn(x, yaw, body_capture.LAYOUT)
    root, joints, six, feet = body_capture.unpack(x, w.human.reference)
    assert torch.allclose(root, w.human.joints[:, :, 0], atol=1e-5)
    assert torch.allclose(joints, w.human.joints, atol=1e-5)
    assert torch.allclose(six, w.human.six, atol=1e-5)
    assert torch.allclose(feet, w.human.foot_contact)
    hands = hand_capture.pack(w.human.joints[:, :, 22:], w.human.hand_contact, w.object)
    palms, contact = hand_capture.unpack(hands, w.object.centre)
    assert torch.allclose(palms, w.human.joints[:, :, 22:], atol=1e-5)
    assert torch.allclose(contact, w.human.hand_contact)


def test_paper_features_unpack_to_what_was_packed(corpus: Corpus):
    w = corpus.draw(4, 16)
    origin, yaw = torch.randn(4, 3), torch.randn(4)
    R = rotmat_from_6d(w.human.six)
    joints, found = body_paper.unpack(body_paper.pack(w.human.joints, R, origin, yaw), origin, yaw)
    assert torch.allclose(joints, w.human.joints, atol=1e-5)
    assert torch.allclose(found, R, atol=1e-5)
    palms = w.human.joints[:, :, 22:]
    packed = hand_paper.pack(palms, origin, yaw)
    assert torch.allclose(hand_paper.unpack(packed, origin, yaw), palms, atol=1e-5)


def test_a_scene_elsewhere_gives_the_same_features(corpus: Corpus):
    """The capture features see no world origin: a walk may be anywhere, of any length."""
    torch.manual_seed(2)
    w = corpus.draw(4, 16, objects_only=True)
    yaw = hand_capture.canonical_yaw(w.object)
    axes = hand_capture.object_axes(w.object, yaw)
    a = hand_capture.condition(w.object, yaw, axes)
    moved = {k: getattr(w.object, k) for k in w.object.__dataclass_fields__}
    moved["centre"] = w.object.centre + torch.tensor([40.0, -70.0, 0.0])
    b = hand_capture.condition(type(w.object)(**moved), yaw, axes)
    assert torch.allclose(a, b, atol=1e-3)


def test_a_palm_that_holds_stands_still_in_the_axes_of_the_object(corpus: Corpus):
    torch.manual_seed(4)
    w = corpus.draw(8, 16, objects_only=True)
    R = roma.random_rotmat(8 * WINDOW).unflatten(0, (8, WINDOW))
    moved = replace(w.object, R_world_object=R)
    yaw = torch.randn(8)
    axes = hand_capture.object_axes(moved, yaw)
    held = R @ torch.tensor([0.1, -0.2, 0.3]) + moved.centre
    palms = torch.stack([held, held], dim=2)
    x = hand_capture.pack(palms, torch.ones(8, WINDOW, 2), moved)
    seen = rotate(x, axes.transpose(-1, -2), hand_capture.LAYOUT)
    assert (seen - seen[:, :1]).abs().max() < 1e-4
    assert torch.allclose(rotate(seen, axes, hand_capture.LAYOUT), x, atol=1e-5)
    middle = moved.valid.sum(dim=1) // 2
    upright = axes[torch.arange(8), middle]
    assert torch.allclose(upright, yaw_matrix(yaw), atol=1e-5)


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
    "single stage": partial(Denoising, little(single_stage.config("laptop"))),
    "goal": partial(Following, GoalConfig(widths=(64, 32, 32, 64), hidden=32, dropout=0.0)),
}


@pytest.mark.parametrize("which", MAKES)
def test_training_learns(corpus: Corpus, which: str):
    # An odd batch is drawn at once.
    options = TrainOptions(steps=20, batch=5, rate=3e-3, warmup=2)
    state = start(MAKES[which], corpus, options, ALONE)
    before = loss_of(state.trainee, corpus)
    train(state, corpus, options, lambda s: True, ALONE)
    assert loss_of(state.trainee, corpus) < 0.8 * before
    assert np.isfinite(state.loss)
    assert state.seconds > 0


def loss_of(trainee: Trainee, corpus: Corpus) -> float:
    """On the same windows each time."""
    torch.manual_seed(7)
    example = joined([trainee.draw(corpus, 16)], ALONE.device)
    with torch.no_grad():
        loss = trainee.loss(trainee.network.train(), example, TrainOptions(1), ALONE.mean)
    return float(loss)


@pytest.mark.parametrize("method", METHODS)
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


def test_paper_examples_have_the_published_shapes(corpus: Corpus):
    w = corpus.draw(2, 1024)
    hands, body = make_example(hand_paper.CONFIG, w), make_example(body_paper.CONFIG, w)
    assert hands.x0.shape == (2, 120, 6)
    assert hands.shape is not None
    assert hands.shape.shape == (2, 120, 3072)
    assert body.x0.shape == (2, 120, 204)
    # The person stands at the origin and faces -y in the first frame: left hip at +x.
    assert body.x0[:, 0, :2].abs().max() < 1e-5
    assert (body.x0[:, 0, 3] > 0.03).all()


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
    larger = partial(Following, GoalConfig(widths=(64, 64, 64, 64), hidden=32))
    with pytest.raises(InputError, match="run-differs"):
        resume_run(larger, tmp_path, options, ALONE)


def test_weights_tell_how_they_were_trained(corpus: Corpus, tmp_path: Path):
    options = TrainOptions(steps=2, batch=8, seed=3)
    state = start(MAKES["goal"], corpus, options, ALONE)
    train(state, corpus, options, lambda s: True, ALONE)
    save_run(state, tmp_path, options, {"method": "goal"})
    told = notes_of(tmp_path / "goal.safetensors")
    assert {"method": "goal", "steps_done": "2", "windows_seen": "16", "seed": "3"}.items() <= (
        told.items()
    )
    assert float(told["cpu_seconds"]) == pytest.approx(state.seconds, abs=0.1)


def test_weights_round_trip_and_damage_is_named(tmp_path: Path):
    torch.manual_seed(0)
    stage = Stage(small("body"))
    save_stage(stage, tmp_path / "a.safetensors", {"note": "x"})
    loaded = load_stage(tmp_path / "a.safetensors")
    assert loaded.config == stage.config
    for a, b in zip(stage.parameters(), loaded.parameters(), strict=True):
        assert torch.allclose(a, b, atol=1e-2)
    (tmp_path / "b.safetensors").write_bytes((tmp_path / "a.safetensors").read_bytes()[:1000])
    with pytest.raises(AssetError, match="weights-damaged"):
        load_stage(tmp_path / "b.safetensors")
    with pytest.raises(AssetError, match="weights-missing"):
        load_stage(tmp_path / "none.safetensors")
