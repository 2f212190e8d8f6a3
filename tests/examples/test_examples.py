"""Every example runs as it stands, and other readers find in its files what it says."""

import csv
import json
import re
import runpy
import shutil
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom
from pygltflib import GLTF2
from safetensors import safe_open
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import DEMO, MESH, SESSION, clamped_phone
from ingest.formats import registry
from tests.conftest import REPO, WriteClip

with warnings.catch_warnings():
    # Its own dependency asks to be imported under another name.
    warnings.simplefilter("ignore")
    import bvhio

FRAMES = 348
"""Of the demonstration take at 30 fps."""
FOLDER = REPO / "examples"
Run = Callable[..., str]


def example(number: int) -> Path:
    (path,) = FOLDER.glob(f"{number:02}_*.py")
    return path


def run_example(number: int, *words: object) -> None:
    """Run a script with these arguments, as Python runs a file, in this process."""
    path = str(example(number))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [path, *map(str, words)])
        runpy.run_path(path, run_name="__main__")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of all examples, with the motion that most of them go on from."""
    folder = tmp_path_factory.mktemp("example_output")
    run_example(3, folder)
    return folder


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a script; returns what it prints."""

    def go(number: int, *words: object) -> str:
        capfd.readouterr()
        run_example(number, *words)
        return capfd.readouterr().out

    return go


def test_01_tells_of_a_session_what_its_files_say(run: Run):
    said = run(1)
    with (DEMO / SESSION / "odometry.csv").open(newline="") as file:
        rows = list(csv.DictReader(file, skipinitialspace=True))
    times = [float(row["timestamp"]) for row in rows]
    seconds = times[-1] - times[0]
    assert f"Length:   {seconds:.1f} s" in said
    assert f"Rate:     {(len(times) - 1) / seconds:.1f} poses a second" in said
    assert "App:      Stray Scanner" in said
    assert "Verdict:  good" in said


def test_02_finds_the_mount_of_the_simulated_phone(run: Run, tmp_path: Path):
    said = run(2, tmp_path)
    T = np.array(json.loads((tmp_path / "mount.json").read_text())["T_phone_object"])
    assert np.abs(T - clamped_phone().T_phone_object).max() < 0.005
    assert "Method: tracker" in said


def test_03_makes_a_result_folder(out: Path):
    with np.load(out / "motion" / "motion.npz", allow_pickle=False) as file:
        assert file["joints"].shape == (4, FRAMES, 24, 3)
        assert np.isfinite(file["joints"]).all()
    scene = GLTF2.load(out / "motion" / "motion.glb")
    assert scene is not None
    assert len(scene.skins[0].joints) == 52
    manifest = json.loads((out / "motion" / "manifest.json").read_text())
    assert manifest["options"]["samples"] == len(manifest["scores"]) == 4


def test_03_says_why_a_take_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr("capture_app.simulator.demo_take.MOUNT", "nowhere.json")
    with pytest.raises(SystemExit, match="The take is refused: There is no mount file"):
        run_example(3, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_04_streams_every_frame_once(run: Run, tmp_path: Path):
    said = run(4, tmp_path)
    joints = np.load(tmp_path / "streamed.npy", allow_pickle=False)
    assert joints.shape == (FRAMES, 24, 3)
    # Seams included, no pelvis goes faster than people run.
    assert np.linalg.norm(np.diff(joints[:, 0], axis=0), axis=-1).max() < 0.15
    blocks = [(int(a), int(b), int(c)) for a, b, c in _BLOCK.findall(said)]
    assert [first for first, _, _ in blocks] == [0, *(last + 1 for _, last, _ in blocks[:-1])]
    assert blocks[-1][1] == FRAMES - 1
    assert blocks[0][2] < FRAMES, "the first block waits for no more than its own poses"


_BLOCK = re.compile(r"frames +(\d+) to +(\d+) are finished, (\d+) poses")


def test_05_lets_the_left_hand_go_earlier(run: Run, out: Path):
    run(5, out)
    before, after = (json.loads((out / name / "contacts.json").read_text()) for name in _BOTH)
    left = [[s for s in c["segments"] if s["hand"] == "left"][-1] for c in (before, after)]
    assert left[0]["stop"] - left[1]["stop"] == 15
    assert left[0]["anchor"][2] - left[1]["anchor"][2] == pytest.approx(0.04)
    with (
        np.load(out / "motion" / "motion.npz") as old,
        np.load(out / _BOTH[1] / "motion.npz") as new,
    ):
        assert new["joints"].shape == (1, FRAMES, 24, 3)
        assert np.array_equal(new["joints"][0, :20], old["joints"][old["chosen"], :20])
        assert new["hand_contact"][0, left[1]["stop"] + 19 :, 0].max() == 0


_BOTH = ("motion", "corrected")


def test_06_writes_files_that_other_readers_open(run: Run, out: Path):
    run(6, out)
    assert len(GLTF2.load(out / "take.glb").animations) == 1
    root = bvhio.readAsBvh(str(out / "take.bvh"))
    assert root.FrameTime == pytest.approx(1 / 60, abs=1e-5)
    assert root.FrameCount == 2 * FRAMES - 1
    assert (out / "take_object.bvh").is_file()
    stage = Usd.Stage.Open(str(out / "take.usdc"))
    assert stage.GetTimeCodesPerSecond() == 24
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    with (out / "take.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == FRAMES


def test_07_draws_pictures_of_the_size_asked_for(run: Run, out: Path):
    said = run(7, out, 96)
    with Image.open(out / "still.png") as still, Image.open(out / "samples.png") as samples:
        assert still.size == (96, 54)
        assert np.asarray(still).std() > 5
        assert samples.width > 3 * 96
    with av.open(str(out / "orbit.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == FRAMES
    assert "motion #2: moving object held" in said


_FIGURES = re.compile(
    r"^predicted_palms(?:_stood)? +(\d+\.\d) +(\d+\.\d) +(\d+\.\d) +(\d\.\d\d)$", re.M
)


def test_08_measures_on_a_clip_of_its_own(run: Run, out: Path):
    said = run(8, out)
    assert "Mean of 1 clips" in said
    assert "Skipped" not in said
    rows = np.array(_FIGURES.findall(said), float)
    assert rows.shape == (2, 4)
    # The truth was generated by these very networks: they must come near it.
    assert rows[:, :3].max() < 60
    assert rows[:, 3].min() > 0.8


def test_08_measures_on_clips_that_are_given(run: Run, write_clip: WriteClip, tmp_path: Path):
    write_clip("sub1_box_001")
    said = run(8, tmp_path / "out", tmp_path)
    assert len(_FIGURES.findall(said)) == 2
    assert not (tmp_path / "out").exists()


def test_08_measures_on_a_recorded_person(run: Run, shared: Path, tmp_path: Path):
    clips = shared / "data" / "omomo_clips"
    shutil.copy(clips / "sub3_largebox_003.npz", tmp_path)
    (tmp_path / "meshes").symlink_to(clips / "meshes")
    rows = np.array(_FIGURES.findall(run(8, tmp_path / "out", tmp_path)), float)
    assert rows.shape == (2, 4)
    assert (rows > 0).all()


def test_09_trains_and_runs_a_take(run: Run, out: Path):
    run(9, out, 2)
    for name in ("hands", "body"):
        with safe_open(out / "networks" / f"{name}.safetensors", framework="np") as file:
            assert file.metadata()["steps_done"] == "2"
            assert file.metadata()["started_from"] == "shipped"
    with np.load(out / "trained" / "motion.npz", allow_pickle=False) as file:
        assert file["joints"].shape[1:] == (FRAMES, 24, 3)


def test_10_reads_a_format_that_is_not_built_in(
    run: Run, out: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(registry, "_REGISTERED", [])
    said = run(10, out)
    rows = np.loadtxt(out / "my_app" / "poses.csv", delimiter=",", skiprows=1)
    assert f"My App: {len(rows)} poses" in said
    with np.load(out / "from_my_app" / "motion.npz", allow_pickle=False) as file:
        assert file["joints"].shape[1:] == (FRAMES, 24, 3)
        assert str(file["object_name"]) == Path(MESH).stem


class StandIn:
    """Takes what GMR's class takes, checks its conventions, and follows the pelvis.

    Its turns are those of GMR's file for SMPL-X and the G1: a human joint's frame times such a turn, w first,
    is the robot's, whose pelvis and feet look along x with z up, and whose arms lie along x.
    """

    TRUNK = Rotation.from_quat([0.5, -0.5, -0.5, -0.5], scalar_first=True)
    RIGHT = Rotation.from_quat([0.0, 0.0, 0.0, -1.0], scalar_first=True)

    def __init__(
        self,
        src_human: str,
        tgt_robot: str,
        actual_human_height: float | None = None,
        solver: str = "daqp",
        damping: float = 0.5,
        verbose: bool = True,
        use_velocity_limit: bool = True,
    ) -> None:
        assert (src_human, tgt_robot) == ("smplx", "unitree_g1")
        assert actual_human_height is not None
        self.scale = 0.9 * actual_human_height / 1.8
        self.last: dict[str, Any] = {}

    def retarget(self, human_data: dict[str, Any], offset_to_ground: bool = False) -> np.ndarray:
        place = {name: np.asarray(point) for name, (point, _) in human_data.items()}
        turn = {
            name: Rotation.from_quat(q, scalar_first=True) for name, (_, q) in human_data.items()
        }
        if not self.last:
            for name in ("pelvis", "left_foot", "right_foot"):
                R = (turn[name] * self.TRUNK).as_matrix()
                assert R[2, 2] > 0.9, "upright"
                assert R[:2, 0] @ (turn["pelvis"] * self.TRUNK).as_matrix()[:2, 0] > 0.5, "ahead"
        for side, offset in (("left", Rotation.identity()), ("right", self.RIGHT)):
            arm = place[f"{side}_wrist"] - place[f"{side}_elbow"]
            along = (turn[f"{side}_elbow"] * offset).as_matrix()[:, 0]
            assert along @ arm > 0.95 * np.linalg.norm(arm), "arms lie along x"
        self.last = human_data
        return np.r_[
            self.scale * place["pelvis"], turn["pelvis"].as_quat(scalar_first=True), np.zeros(29)
        ]


def test_11_gives_gmr_what_it_expects(run: Run, out: Path, monkeypatch: pytest.MonkeyPatch):
    module = ModuleType("general_motion_retargeting")
    module.GeneralMotionRetargeting = StandIn  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    said = run(11, out)
    assert f"{FRAMES} frames of 29 joints; the way is scaled by 0.8" in said
    assert np.loadtxt(out / "gmr.csv", delimiter=",").shape == (FRAMES, 36)


def test_11_says_how_to_get_gmr(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setitem(sys.modules, "general_motion_retargeting", None)
    with pytest.raises(SystemExit, match="pip install git"):
        run_example(11, tmp_path)


def test_each_example_is_tested_and_listed():
    names = sorted(path.name for path in FOLDER.glob("*.py"))
    assert [name[:2] for name in names] == [f"{k:02}" for k in range(1, 12)]
    listed = re.findall(r"\]\((\d\d_\w+\.py)\)", (FOLDER / "README.md").read_text())
    assert listed == names
    tested = re.findall(r"^def test_(\d\d)_", Path(__file__).read_text(), re.MULTILINE)
    assert sorted(set(tested)) == [name[:2] for name in names]
