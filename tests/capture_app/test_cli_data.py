"""`omocap data synthesise` and `omocap data inspect` as a user calls them."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

from capture_app.cli.app import invoke
from omomo_core.body.model import load_body
from omomo_core.learning.recordings import dataset
from omomo_core.learning.recordings.clips import Clip, load_clips, save_clips
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.synthesis import synthesis_engine
from omomo_core.motion import ObjectMesh, ObjectMotion
from tests.core.rig_files import rig_name, write_bvh
from tests.video_frames import read_frames

UPRIGHT = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])


def clip(k: int, *, with_object: bool = True, frames: int = 12) -> Clip:
    """Somebody in the T-pose and a box on the floor, which slides away by itself when k is 1."""
    solid = trimesh.creation.box((0.3, 0.3, 0.4))
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, 3] = [1.0, 0.0, 0.2]
    T[:, 0, 3] += np.arange(frames) * 0.05 * (k == 1)
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    return Clip(
        name=f"sub1_box_0_{k:05d} carry",
        source="test",
        licence="CC0",
        root=np.tile([0.0, 0.0, 0.95], (frames, 1)),
        rotations=np.tile(UPRIGHT, (frames, 22, 1, 1)),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.ones((frames, 4)),
        object_motion=ObjectMotion(mesh, T, np.ones(frames, bool)) if with_object else None,
    )


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    save_clips(tmp_path / "recorded.npz", [clip(9, with_object=False)])
    return tmp_path / "recorded.npz"


@pytest.fixture
def stubbed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clips that cost nothing, in files of two."""

    def make(_clips, _body, _count, _seed, progress, *, workers, rejected, indices, roster):
        def clips():
            for done, index in enumerate(indices, start=1):
                rejected["palm-off"] += 1
                progress(done, len(indices))
                yield clip(index)

        return clips()

    monkeypatch.setattr(synthesis_engine, "synthesise", make)
    monkeypatch.setattr(dataset, "SHARD", 2)


@pytest.mark.usefixtures("stubbed")
@pytest.mark.runs("data synthesise")
def test_a_data_set_is_made_gone_on_with_and_told_about(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "set"
    assert invoke(["data", "synthesise", str(recorded), "-o", str(out), "--count", "3"]) == 0
    assert len(load_clips(out)) == 4
    # Its own recorded part serves as the mocap of the next run.
    assert invoke(["data", "synthesise", str(out), "-o", str(out), "--count", "4"]) == 0
    told = capsys.readouterr().out
    assert "palm-off" in told
    assert "carry" in told
    assert json.loads((out / "dataset.json").read_text())["clips"] == 4


@pytest.mark.usefixtures("stubbed")
def test_a_data_set_is_made_of_several_sources_and_linked_folders(recorded: Path, tmp_path: Path):
    kept, mocap, out = tmp_path / "kept", tmp_path / "mocap", tmp_path / "set"
    for folder in (kept, mocap):
        folder.mkdir()
    write_bvh(kept / "walk.bvh", rig_name)
    (mocap / "linked").symlink_to(kept, target_is_directory=True)
    words = ["data", "synthesise", str(recorded), str(mocap), "-o", str(out), "--count", "2"]
    assert invoke(words) == 0
    assert [c.name for c in load_clips(out / dataset.RECORDED)] == [
        "sub1_box_0_00009 carry",
        "walk",
    ]


@pytest.mark.usefixtures("stubbed")
def test_a_data_set_of_another_seed_is_refused(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    words = ["data", "synthesise", str(recorded), "-o", str(tmp_path / "set"), "--count", "2"]
    assert invoke(words) == 0
    assert invoke([*words, "--seed", "5"]) == 2
    assert "seed 0, not 5" in capsys.readouterr().err


@pytest.mark.usefixtures("stubbed")
def test_people_and_objects_belong_to_the_data_set(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "set"
    words = ["data", "synthesise", str(recorded), "-o", str(out), "--count", "2"]
    for wrong, code in (("0-3", "people"), ("16-18", "people"), ("5-2", "people"), ("", "people")):
        assert invoke([*words, "--people", wrong]) == 2
        assert f"unknown-{code}" in capsys.readouterr().err
    assert invoke([*words, "--objects", "teapot"]) == 2
    assert "no class of objects 'teapot'" in capsys.readouterr().err
    assert not out.exists()
    chosen = ["--people", "17,1-15", "--objects", "mop,tripod"]
    assert invoke([*words, *chosen]) == 0
    assert invoke([*words, "--people", "1-15,17", "--objects", "tripod,mop"]) == 0
    recipe = json.loads((out / "dataset.json").read_text())["recipe"]
    assert (recipe["people"], recipe["objects"]) == ("1-15,17", "mop,tripod")
    assert invoke([*words, "--objects", "mop,tripod"]) == 2
    assert "people 1-15,17, not 1-17" in capsys.readouterr().err


@pytest.mark.usefixtures("stubbed")
def test_an_interrupted_run_keeps_its_whole_files(
    recorded: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):
    whole = synthesis_engine.synthesise

    def interrupted(*args, indices, **rest):
        yield from whole(*args, indices=indices[:3], **rest)
        raise KeyboardInterrupt

    monkeypatch.setattr(synthesis_engine, "synthesise", interrupted)
    out = tmp_path / "set"
    assert invoke(["data", "synthesise", str(recorded), "-o", str(out), "--count", "6"]) == 130
    assert f"2 of 6 clips are in {out}; the same command goes on" in capsys.readouterr().err
    assert [f.name for f in dataset.shards(out)] == ["clips_00000.npz"]


@pytest.mark.slow
def test_ctrl_c_leaves_whole_files_and_says_how_to_go_on(shared: Path, tmp_path: Path):
    mocap = build_mocap(shared / "data/mocap/cmu_bvh/02", load_body())
    save_clips(tmp_path / "mocap.npz", mocap)
    out = tmp_path / "set"
    script = (  # a shell that starts the tests in the background lets them ignore Ctrl-C
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import sys; from omomo_core.learning.recordings import dataset; dataset.SHARD = 1\n"
        "from capture_app.cli.app import invoke; raise SystemExit(invoke(sys.argv[1:]))"
    )
    words = ["data", "synthesise", str(tmp_path / "mocap.npz"), "-o", str(out), "--count", "500"]
    process = subprocess.Popen(
        [sys.executable, "-c", script, *words, "--workers", "2"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    end = time.monotonic() + 120
    while not dataset.shards(out) and time.monotonic() < end and process.poll() is None:
        time.sleep(0.2)
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130, said
    assert "the same command goes on" in said
    assert "Traceback" not in said
    kept = len(dataset.shards(out))
    assert 0 < kept < 500
    assert json.loads((out / "dataset.json").read_text())["clips"] == kept
    assert not list(out.glob(".*"))


@pytest.mark.runs("data inspect")
def test_inspect_draws_and_measures_what_it_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    save_clips(tmp_path / "clips.npz", [clip(k, with_object=k < 2, frames=6) for k in range(3)])
    words = ["data", "inspect", str(tmp_path / "clips.npz"), "-o", str(tmp_path / "look")]
    assert invoke([*words, "--backend", "raycast", "--videos", "1", "--name", "00001"]) == 0
    (quality,) = json.loads((tmp_path / "look/quality.json").read_text())
    assert quality["name"] == "sub1_box_0_00001 carry"
    assert "floats" in quality["flags"]
    assert "sub1_box_0_00001 carry: floats" in capsys.readouterr().out
    assert (tmp_path / "look/sheet_00.png").read_bytes().startswith(b"\x89PNG")
    assert len(read_frames(tmp_path / "look/clips.mp4", [0, 2])) == 2


def test_inspect_measures_a_random_choice_without_drawing(tmp_path: Path):
    save_clips(tmp_path / "clips.npz", [clip(k, frames=5) for k in range(6)])
    words = ["data", "inspect", str(tmp_path / "clips.npz"), "--clips", "3", "--measure-only"]
    for seed in "0", "0", "1":
        assert invoke([*words, "-o", str(tmp_path / seed), "--seed", seed]) == 0
    rows = json.loads((tmp_path / "0/quality.json").read_text())
    assert len({row["name"] for row in rows}) == 3
    assert [p.name for p in (tmp_path / "0").iterdir()] == ["quality.json"]


def test_inspect_refuses_what_has_nothing_to_show(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    for path, code in ((recorded, "no-such-clip"), (tmp_path / "none.npz", "clips-missing")):
        assert invoke(["data", "inspect", str(path), "-o", str(tmp_path / "look")]) == 2
        assert code in capsys.readouterr().err
