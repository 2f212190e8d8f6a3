"""Corpus, examples and the loop: mirroring is exact, learning happens, resuming is exact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
import trimesh

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
from omomo_core.stage import Stage, StageConfig, load_stage, save_stage
from omomo_core.training.checkpoint import resume_run, save_run
from omomo_core.training.corpus import Corpus
from omomo_core.training.examples import make_example
from omomo_core.training.loop import TrainOptions, TrainState, start, train
from omomo_core.windows import WINDOW

BODY = load_body()
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
CPU = torch.device("cpu")


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


def small(stage: str) -> StageConfig:
    base = hand_capture if stage == "hands" else body_capture
    d = base.CONFIG.denoiser
    sizes = DenoiserConfig(
        channels=d.channels, condition=d.condition, shape=d.shape, shape_hidden=32, shape_width=16,
        width=64, layers=1, heads=2, head_width=16, feedforward=64, patch=4, mask_keys=True,
    )  # fmt: skip
    return StageConfig(stage, "capture", sizes)  # type: ignore[arg-type]


@pytest.mark.parametrize("stage", ["hands", "body"])
def test_training_learns(corpus: Corpus, stage: str):
    options = TrainOptions(steps=60, batch=16, rate=3e-3, warmup=5)
    state = start(small(stage), corpus, options)
    losses: list[float] = []
    train(state, corpus, options, lambda s: losses.append(s.loss) or True, CPU)
    assert losses[-1] < 0.8 * losses[0]
    assert np.isfinite(losses).all()


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


def test_an_interrupted_run_resumes_to_the_same_weights(corpus: Corpus, tmp_path: Path):
    options = TrainOptions(steps=8, batch=4, warmup=2)

    def run(state: TrainState, until: int) -> TrainState:
        train(state, corpus, options, lambda s: s.step < until, CPU)
        return state

    whole = run(start(small("hands"), corpus, options), 99)
    save_run(run(start(small("hands"), corpus, options), 4), tmp_path, options, {})
    resumed = resume_run(small("hands"), tmp_path, options)
    assert resumed is not None
    assert resumed.step == 4
    run(resumed, 99)
    for a, b in zip(whole.average.parameters(), resumed.average.parameters(), strict=True):
        assert torch.equal(a, b)


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
