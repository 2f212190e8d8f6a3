"""`omocap data`, `omocap train` and `omocap simulate` as a user calls them."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_app.cli.app import invoke
from ingest.formats.detect import read_session
from ingest.mount.file import load_mount
from omomo_core.data.clips import Clip, save_clips
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.stage import load_stage
from tests.core.rig_files import write_bvh

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


def test_train_writes_weights_and_goes_on_where_it_stopped(clips: Path, tmp_path: Path):
    out = tmp_path / "run"
    words = ["train", str(clips), "-o", str(out), "--batch", "2"]
    assert invoke([*words, "--steps", "1"]) == 0
    first = (out / "body.safetensors").read_bytes()
    assert invoke([*words, "--steps", "2"]) == 0
    assert load_stage(out / "hands.safetensors").config.configuration == "capture"
    assert (out / "body.safetensors").read_bytes() != first


def test_train_takes_recordings_and_counts_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    mocap, out = tmp_path / "mocap", tmp_path / "run"
    mocap.mkdir()
    rig = {"pelvis": "Hips", "head": "Head", "neck": "Neck"}
    sides = {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "foot": "ToeBase", "collar": "Shoulder",
             "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand"}  # fmt: skip
    rig |= {f"{s}_{k}": f"{s.title()}{v}" for s in ("left", "right") for k, v in sides.items()}
    write_bvh(mocap / "walk.bvh", lambda name: rig.get(name, name))
    (mocap / "broken.bvh").write_text("HIERARCHY")
    words = ["train", str(mocap), "-o", str(out), "--batch", "2", "--stage", "body"]
    words += ["--config", "paper", "--synthetic", "0"]
    assert invoke([*words, "--steps", "1"]) == 0
    assert "1 x bvh-syntax" in capsys.readouterr().out
    told = json.loads((out / "data.json").read_text())
    assert told["left_out"] == {"bvh-syntax": 1}
    assert "broken.bvh" in told["problems"][0]
    before = (out / "recorded.npz").stat().st_mtime_ns
    assert invoke([*words, "--steps", "2"]) == 0
    assert "1 x bvh-syntax" in capsys.readouterr().out
    assert (out / "recorded.npz").stat().st_mtime_ns == before
    (mocap / "walk.bvh").unlink()
    assert invoke([*words, "--steps", "3"]) == 2
    assert "run-differs" in capsys.readouterr().err
    assert invoke([*words[:3], str(tmp_path / "other")]) == 2
    assert "mocap-unusable" in capsys.readouterr().err


def test_training_refuses_what_it_cannot_use(
    clips: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    for words, code in (
        (["train", str(tmp_path / "none.npz"), "-o", str(tmp_path / "x")], "no-training-data"),
        (["train", str(clips), "-o", str(tmp_path / "x"), "--stage", "legs"], "unknown-stage"),
        (["data", "build", str(tmp_path / "no"), "-o", str(tmp_path / "c.npz")], "mocap-folder"),
        (["data", "build", str(tmp_path), "-o", str(tmp_path / "no" / "c.npz")], "output-not-writ"),
    ):
        assert invoke(words) == 2
        assert code in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_simulate_records_a_session_that_can_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    folder = tmp_path / "take"
    assert invoke(["simulate", "-o", str(folder), "--no-video"]) == 0
    assert len(read_session(folder / "session").times) > 600
    assert load_mount(folder / "mount.json").method == "drawing"
    assert invoke(["simulate", "-o", str(folder), "--no-video"]) == 2
    assert "output-exists" in capsys.readouterr().err
