"""`omocap data`, `omocap train` and `omocap simulate` as a user calls them."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from capture_app.cli.app import invoke
from capture_app.tables.table_files import caption
from ingest.formats.registry import read_session
from ingest.mount_file import load_mount
from omomo_core.learning.evaluation.evaluation_runner import FigureOrigin
from omomo_core.learning.recordings.clips import Clip, load_clips, save_clips
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.stages.network_file import read_header
from omomo_core.stages.stage import load_stage
from omomo_core.weights.load import SHIPPED
from tests.core.rig_files import rig_name, write_bvh

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


@pytest.fixture
def clips(tmp_path: Path) -> Path:
    frames = 130
    solid = trimesh.creation.box((0.3, 0.4, 0.5))
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    motion = ObjectMotion(mesh, np.tile(np.eye(4), (frames, 1, 1)), np.ones(frames, bool))
    clip = Clip(
        name="still",
        source="test",
        licence="CC0",
        root=np.tile([0.0, 0.0, 0.95], (frames, 1)),
        rotations=np.tile(UPRIGHT, (frames, 22, 1, 1)),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.ones((frames, 4)),
        object_motion=motion,
    )
    save_clips(tmp_path / "clips.npz", [clip])
    return tmp_path / "clips.npz"


@pytest.mark.runs("train")
def test_train_writes_weights_and_goes_on_where_it_stopped(clips: Path, tmp_path: Path):
    out = tmp_path / "run"
    words = ["train", "capture", str(clips), "-o", str(out), "--batch", "2"]
    assert invoke([*words, "--steps", "1"]) == 0
    first = (out / "body.safetensors").read_bytes()
    assert invoke([*words, "--steps", "2"]) == 0
    assert load_stage(out / "hands.safetensors").config.configuration == "capture"
    assert (out / "body.safetensors").read_bytes() != first


def test_training_goes_on_from_weights(clips: Path, tmp_path: Path):
    words = ["train", "capture", str(clips), "--batch", "2", "--steps", "1", "--stage", "body"]
    assert invoke([*words, "-o", str(tmp_path / "fresh")]) == 0
    assert invoke([*words, "-o", str(tmp_path / "run"), "--start-from", "shipped"]) == 0
    fresh, run = (tmp_path / name / "body.safetensors" for name in ("fresh", "run"))
    assert read_header(run).notes["started_from"] == "shipped"
    assert "started_from" not in read_header(fresh).notes
    shipped = load_stage(SHIPPED / "capture" / "body.safetensors")
    # One step at a rate that warms up changes next to nothing.
    assert torch.equal(load_stage(run).x_mean, shipped.x_mean)
    near, far = (load_stage(path).denoiser.embed.weight for path in (run, fresh))
    assert torch.allclose(near, shipped.denoiser.embed.weight, atol=1e-3)
    assert not torch.allclose(far, shipped.denoiser.embed.weight, atol=1e-2)


def test_train_takes_recordings_and_counts_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    mocap, out = tmp_path / "mocap", tmp_path / "run"
    mocap.mkdir()
    write_bvh(mocap / "walk.bvh", rig_name)
    (mocap / "broken.bvh").write_text("HIERARCHY")
    words = ["train", "capture", str(mocap), "-o", str(out), "--batch", "2", "--stage", "body"]
    words += ["--synthetic", "0"]
    assert invoke([*words, "--steps", "1"]) == 0
    assert "1 x bvh-syntax" in capsys.readouterr().out
    told = json.loads((out / "data.json").read_text())
    assert told["left_out"] == {"bvh-syntax": 1}
    assert "broken.bvh" in told["problems"][0]
    before = (out / "recorded.npz").stat().st_mtime_ns
    assert invoke([*words, "--steps", "2"]) == 0
    assert "1 x bvh-syntax" in capsys.readouterr().out
    assert (out / "recorded.npz").stat().st_mtime_ns == before
    assert invoke([*words, "--stage", "both"]) == 2
    assert "no-objects" in capsys.readouterr().err
    (mocap / "walk.bvh").unlink()
    assert invoke([*words, "--steps", "3"]) == 2
    assert "run-differs" in capsys.readouterr().err
    assert invoke([*words[:4], str(tmp_path / "other")]) == 2
    assert "mocap-unusable" in capsys.readouterr().err


def test_train_reads_several_sources_and_follows_links(clips: Path, tmp_path: Path):
    kept, mocap, out = tmp_path / "kept", tmp_path / "mocap", tmp_path / "run"
    for folder, name in ((kept, "walk"), (mocap, "run")):
        folder.mkdir()
        write_bvh(folder / f"{name}.bvh", rig_name)
    (mocap / "linked").symlink_to(kept, target_is_directory=True)
    (mocap / "round").symlink_to(mocap, target_is_directory=True)
    single = tmp_path / "jump.bvh"
    write_bvh(single, rig_name)
    words = ["train", "capture", str(mocap), str(single), str(clips), "-o", str(out)]
    words += ["--batch", "2", "--stage", "body", "--synthetic", "0", "--steps", "1"]
    assert invoke(words) == 0
    names = {clip.name for clip in load_clips(out / "recorded.npz")}
    assert names == {"walk", "run", "jump"}
    assert read_header(out / "body.safetensors").notes["data"] == "mocap, jump.bvh, clips.npz"


@pytest.mark.parametrize(
    ("method", "networks"),
    [("omomo", ["body", "hands"]), ("single-stage", ["single"]), ("goal", ["goal"])],
)
def test_every_method_trains_and_says_how(
    clips: Path, tmp_path: Path, method: str, networks: list[str]
):
    out = tmp_path / "run"
    words = ["train", method, str(clips), "-o", str(out), "--size", "laptop", "--batch", "2"]
    assert invoke([*words, "--steps", "1", "--seed", "5"]) == 0
    assert sorted(file.stem for file in out.glob("*.safetensors")) == networks
    for name in networks:
        told = read_header(out / f"{name}.safetensors").notes
        assert told["method"] == method
        assert (told["size"], told["steps_done"], told["batch"]) == ("laptop", "1", "2")
        assert (told["seed"], told["windows_seen"], told["data"]) == ("5", "2", "clips.npz")
        assert told["licences"] == "CC0"


def test_training_on_held_out_people_is_told(
    clips: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (clip,) = load_clips(clips)
    names = ("sub3_mop_001", "sub16_mop_002", "sub17_monitor_003")
    save_clips(clips, [replace(clip, name=name) for name in names])
    words = ["train", "goal", str(clips), "-o", str(tmp_path / "run"), "--size", "laptop"]
    assert invoke([*words, "--batch", "2", "--steps", "1"]) == 0
    assert "note: 2 of the clips are of people that the paper holds out" in capsys.readouterr().out
    header = read_header(tmp_path / "run" / "goal.safetensors")
    settings = {"samples": 1, "seed": 0, "sampler": "ddim", "steps": 1, "split": ""}
    made = FigureOrigin([], [], settings, {"goal": [header]}, {}, {})
    assert "trained on 2 clips of held-out people" in " ".join(caption(made))
    header.notes["started_from"] = "shipped"
    assert "from the weights shipped" in " ".join(caption(made))


def test_training_refuses_what_it_cannot_use(
    clips: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    new = ["-o", str(tmp_path / "x")]
    for words, code in (
        (["train", "capture", str(tmp_path / "none.npz"), *new], "no-training-data"),
        (["train", "capture", str(clips), *new, "--stage", "legs"], "unknown-stage"),
        (["train", "goal", str(clips), *new, "--stage", "hands"], "unknown-stage"),
        (["train", "omomo", str(clips), *new, "--size", "huge"], "--size"),
        (["train", str(clips), str(clips), *new], "'single-stage'"),
        (["train", "omomo", str(clips), *new, "--start-from", "shipped"], "other-network"),
        (["train", "goal", str(clips), *new, "--start-from", str(tmp_path)], "weights-missing"),
        (["train", "capture", *new], "Missing argument"),
        (["data", "build", str(tmp_path / "no"), "-o", str(tmp_path / "c.npz")], "mocap-folder"),
        (["data", "build", str(tmp_path), "-o", str(tmp_path / "no" / "c.npz")], "output-not-writ"),
    ):
        assert invoke(words) == 2
        assert code in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_two_processes_train_one_network(clips: Path, tmp_path: Path):
    alone, shared = tmp_path / "alone", tmp_path / "shared"
    words = ["train", "capture", str(clips), "--stage", "hands", "--steps", "3", "--batch", "8"]
    assert invoke([*words, "-o", str(alone)]) == 0
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--nproc-per-node", "2"]
    omocap = str(Path(sys.executable).with_name("omocap"))
    done = subprocess.run(
        [*torchrun, "--no-python", omocap, *words, "-o", str(shared)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("1 clips of test") == 1
    file = "hands.safetensors"
    assert read_header(shared / file).notes["processes"] == "2"
    # Compared as they are used: a file holds whole steps, which differ where a row is next to nothing.
    ours, theirs = (load_stage(folder / file).state_dict() for folder in (alone, shared))
    assert max(float((ours[k].float() - theirs[k].float()).abs().max()) for k in ours) < 2e-3
    bad = subprocess.run(
        [*torchrun, "--no-python", omocap, *words[:-1], "7", "-o", str(tmp_path / "odd")],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert bad.returncode != 0
    assert "batch-not-shared" in bad.stderr
    assert not (tmp_path / "odd").exists()


@pytest.mark.runs("simulate")
def test_simulate_records_a_session_that_can_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    folder = tmp_path / "take"
    assert invoke(["simulate", "-o", str(folder), "--no-video"]) == 0
    assert len(read_session(folder / "session").times) > 600
    assert load_mount(folder / "mount.json").method == "drawing"
    assert invoke(["simulate", "-o", str(folder), "--no-video"]) == 2
    assert "output-exists" in capsys.readouterr().err
