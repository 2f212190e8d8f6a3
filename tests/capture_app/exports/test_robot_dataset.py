"""Results become a data set in LeRobot's layout: its values, what is left out, and going on after a stop."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture_app.cli.app import invoke
from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.result import Result, body_of
from capture_app.robots.export_robot import sampled_person
from capture_app.robots.lerobot_files import RobotEpisode, write_lerobot
from capture_app.robots.robot_dataset import export_data_set
from capture_app.robots.robot_model import load_robot
from capture_app.robots.robot_solver import robot_motion
from omomo_core.errors import InputError

pytest.importorskip("mink")
parquet = pytest.importorskip("pyarrow.parquet")

LEROBOT = "lerobot==0.4.4"


@pytest.fixture(scope="module")
def motions(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a batch leaves it: two takes, one that is damaged, one put aside, and a file."""
    folder = tmp_path_factory.mktemp("batch") / "motions"
    for name in ("lift", "carry", "torn", "torn.damaged"):
        shutil.copytree(result.folder, folder / name)
    for name in ("torn", "torn.damaged"):
        (folder / name / "motion.npz").write_bytes(b"PK")
    (folder / "results.csv").touch()
    return folder


def request(motions: Path, humanoid: tuple[Path, Path], output: Path, **said: Any) -> ExportRequest:
    model, frames = humanoid
    return ExportRequest(
        result=motions,
        output=output,
        to=ExportFormat.lerobot,
        robot=model,
        frames=frames,
        fps=24,
        **said,
    )


@pytest.fixture(scope="module")
def data_set(motions: Path, humanoid: tuple[Path, Path], tmp_path_factory: Any) -> Path:
    folder = tmp_path_factory.mktemp("made") / "data_set"
    export_data_set(request(motions, humanoid, folder))
    return folder


def test_states_are_the_robots_joints(
    result: Result, humanoid: tuple[Path, Path], data_set: Path
) -> None:
    table = parquet.read_table(data_set / "data/chunk-000/file-000.parquet")
    state = np.array(table["observation.state"].to_pylist(), np.float32)
    action = np.array(table["action"].to_pylist(), np.float32)
    sampled = sampled_person(result, 0, 24.0)
    motion = robot_motion(load_robot(*humanoid), sampled, body_of(result))
    frames = len(motion.qpos)
    assert len(state) == 2 * frames
    for start in (0, frames):
        part = slice(start, start + frames)
        assert state[part] == pytest.approx(motion.qpos, abs=1e-6)
        assert (action[part][:-1] == state[part][1:]).all()
        assert (action[part][-1] == state[part][-1]).all()
    pose = np.array(table["observation.environment_state"].to_pylist())[:frames]
    assert pose[:, :3] == pytest.approx(sampled.object_motion.T_world_object[:, :3, 3], abs=1e-6)
    held = np.array(table["observation.hand_contact"].to_pylist())[:frames]
    assert (held == motion.targets.held).all()
    assert held.any()
    stands = np.array(table["observation.foot_contact"].to_pylist())[:frames]
    assert (stands == motion.targets.planted).all()
    assert table["timestamp"][frames - 1].as_py() == pytest.approx((frames - 1) / 24, abs=1e-5)
    assert table["index"].to_pylist() == list(range(2 * frames))
    assert set(table["episode_index"].to_pylist()[frames:]) == {1}


def test_meta_says_what_the_frames_are(humanoid: tuple[Path, Path], data_set: Path) -> None:
    info = json.loads((data_set / "meta/info.json").read_text())
    table = parquet.read_table(data_set / info["data_path"].format(chunk_index=0, file_index=0))
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", 24, "humanoid")
    assert (info["total_episodes"], info["total_frames"]) == (2, len(table))
    assert info["features"].keys() == set(table.column_names)
    for name, feature in info["features"].items():
        (shape,) = feature["shape"]
        value = table[name][0].as_py()
        assert shape == (len(value) if isinstance(value, list) else 1)
        assert feature["names"] is None or len(feature["names"]) == shape
    names = info["features"]["observation.state"]["names"]
    assert names[:8] == [*(f"root_{k}" for k in ("x", "y", "z", "qw", "qx", "qy", "qz")), names[7]]
    rows = parquet.read_table(data_set / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["dataset_from_index"] for row in rows] == [0, rows[0]["dataset_to_index"]]
    assert rows[1]["tasks"] == ["Move the box."]
    stats = json.loads((data_set / "meta/stats.json").read_text())
    state = np.array(table["observation.state"].to_pylist())
    assert stats["observation.state"]["std"] == pytest.approx(state.std(axis=0).tolist(), abs=1e-6)
    assert rows[0]["stats/action/max"][0] <= stats["action"]["max"][0]
    about = json.loads((data_set / "meta/omocap.json").read_text())
    assert [episode["take"] for episode in about["episodes"]] == ["carry", "lift"]


def test_each_episode_has_its_task(tmp_path: Path) -> None:
    pose, contact = np.zeros((100, 7)), np.zeros((100, 2), bool)
    tasks = ("Lift.", "Carry.", "Lift.")
    episodes = [RobotEpisode("a", task, pose, pose, contact, contact) for task in tasks]
    write_lerobot(tmp_path, episodes, [], 30, "cart")
    table = parquet.read_table(tmp_path / "data/chunk-000/file-000.parquet")
    assert table["task_index"].to_pylist() == [0] * 100 + [1] * 100 + [0] * 100
    rows = parquet.read_table(tmp_path / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["tasks"] for row in rows] == [[task] for task in tasks]
    assert [row["dataset_from_index"] for row in rows] == [0, 100, 200]


def test_a_bad_take_is_named_and_the_others_are_kept(
    motions: Path, humanoid: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, frames = map(str, humanoid)
    words = ["export", str(motions), "--to", "lerobot", "--robot", model, "--frames", frames]
    out = tmp_path / "out"
    said = [*words, "--fps", "24", "--task", "Carry it.", "-o", str(out)]
    assert invoke(said) == 2
    printed = capsys.readouterr().out
    assert "Failed: torn is left out" in printed
    assert "torn.damaged" not in printed
    tasks = parquet.read_table(out / "meta/tasks.parquet").to_pylist()
    assert tasks == [{"task_index": 0, "__index_level_0__": "Carry it."}]
    assert list(tmp_path.iterdir()) == [out]
    assert invoke(said) == 2
    assert "exports replace none" in capsys.readouterr().err


def test_an_interrupted_export_goes_on(
    motions: Path, humanoid: tuple[Path, Path], data_set: Path, tmp_path: Path
) -> None:
    def stop(stage: str, fraction: float) -> None:
        if stage == "episodes" and fraction > 0.0:
            raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        export_data_set(request(motions, humanoid, out), stop)
    assert not out.exists()
    done = export_data_set(request(motions, humanoid, out))
    assert done.notes[0] == "1 of 2 episodes were there from an earlier run."
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    for name in ("data", "meta/episodes"):
        file = f"{name}/chunk-000/file-000.parquet"
        assert parquet.read_table(out / file).equals(parquet.read_table(data_set / file))


@pytest.mark.parametrize(("function", "found"), [("_write_table", 2), ("np.savez", 0)])
def test_a_full_disk_loses_nothing_that_is_finished(
    motions: Path,
    humanoid: tuple[Path, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    function: str,
    found: int,
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    asked = request(motions, humanoid, tmp_path / "out")
    with monkeypatch.context() as patch:
        patch.setattr(f"capture_app.robots.lerobot_files.{function}", full)
        with pytest.raises(InputError) as caught:
            export_data_set(asked)
    assert caught.value.code == "disk-full"
    assert not asked.output.exists()
    notes = export_data_set(asked).notes
    assert any(note.startswith(f"{found} of 2") for note in notes) == (found > 0)


def test_every_sample_may_be_an_episode(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    done = export_data_set(request(result.folder, humanoid, tmp_path / "out", all_samples=True))
    assert done.files == (tmp_path / "out" / f"{result.folder.name}_lerobot",)
    about = json.loads((done.files[0] / "meta/omocap.json").read_text())
    assert [episode["take"] for episode in about["episodes"]] == [f"{result.folder.name} sample 1"]


def test_nothing_to_export_is_an_error(
    motions: Path, humanoid: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    for folder, code in ((tmp_path / "empty", "results-none"), (motions / "torn", "episodes-none")):
        with pytest.raises(InputError) as caught:
            export_data_set(request(folder, humanoid, tmp_path / "out"))
        assert caught.value.code == code
    assert [path.name for path in tmp_path.iterdir()] == ["empty"]


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["--to", "robot", "--all-samples"], "--all-samples"),
        (["--to", "glb", "--task", "Sweep."], "--task"),
        (["--to", "lerobot", "--up", "y"], "--up"),
        (["--to", "lerobot", "--all-samples", "--sample", "2"], "--sample"),
    ],
)
def test_options_that_say_nothing_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], option: str
) -> None:
    assert invoke(["export", str(tmp_path), *words]) == 2
    said = capsys.readouterr().err
    assert option in said
    assert "option-unused" in said


@pytest.fixture(scope="session")
def python_with_lerobot() -> Path:
    """The Python that LEROBOT_PYTHON names, which has lerobot; its environment takes gigabytes."""
    if (named := os.environ.get("LEROBOT_PYTHON")) is None:
        pytest.skip(f"no Python with lerobot: install {LEROBOT}, and set LEROBOT_PYTHON")
    return Path(named)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_lerobot_reads_it(data_set: Path, python_with_lerobot: Path, tmp_path: Path) -> None:
    script = Path(__file__).with_name("lerobot_reader.py")
    environment = os.environ | {"HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "cache")}
    words = [python_with_lerobot, script, data_set, tmp_path / "read.npz"]
    subprocess.run(words, env=environment, check=True)
    theirs = np.load(tmp_path / "read.npz")
    table = parquet.read_table(data_set / "data/chunk-000/file-000.parquet")
    for name in table.column_names:
        assert (theirs[name] == np.array(table[name].to_pylist(), theirs[name].dtype)).all()
    frames = len(table) // 2
    assert theirs["episodes"] == 2
    assert theirs["lengths"].tolist() == [frames, frames]
    assert theirs["last_length"] == frames
    assert theirs["edited"].tolist() == [4, 4 * frames, 3, 3 * frames]
    assert set(theirs["tasks"].tolist()) == {"Move the box."}
    assert len(theirs["names"]) == theirs["observation.state"].shape[1]
    assert theirs["mean"] == pytest.approx(theirs["action"].mean(axis=0), abs=1e-5)
    # The frame before the first one and those after the last one are repeated, and marked.
    state, action = theirs["observation.state"], theirs["action"]
    assert (theirs["before"] == state[frames]).all()
    assert theirs["before_is_pad"].tolist() == [True, False]
    assert (theirs["after"] == action[-1]).all()
    assert theirs["after_is_pad"].tolist() == [False, True, True]
