"""What is named is found, put onto one clock into one world, and measured."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from capture_app.cli.compare import compare
from capture_app.comparison.arrange import compared, place, same_object
from capture_app.comparison.compared_motions import Motion, choice, load_motions, moved, stretch
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip, save_clips
from tests.video_frames import read_frames

from .conftest import FRAMES, WriteResult, carrying

WHOLE = carrying()


def turned(yaw: float, x: float, y: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    T[:2, 3] = x, y
    return T


@settings(max_examples=20)
@given(
    yaw=some.floats(-3.1, 3.1),
    x=some.floats(-3, 3),
    y=some.floats(-3, 3),
    start=some.integers(0, 20),
    cut=some.integers(0, 12),
)
def test_a_part_of_the_take_in_another_world_finds_its_place(
    yaw: float, x: float, y: float, start: int, cut: int
) -> None:
    away = turned(yaw, x, y)
    other = moved(stretch(WHOLE, start, FRAMES - cut), away)
    at = place(WHOLE.object_motion, other.object_motion)
    assert at.same_take
    assert at.begin == start
    assert np.abs(at.T @ away - np.eye(4)).max() < 0.02
    back = moved(other, at.T)
    assert np.abs(back.human.joints - WHOLE.human.joints[start : FRAMES - cut]).max() < 0.02


def test_another_way_of_the_object_begins_at_the_same_place() -> None:
    T = WHOLE.object_motion.T_world_object.copy()
    T[:, 2, 3] += np.linspace(0, 0.8, FRAMES)
    other = replace(WHOLE.object_motion, T_world_object=turned(0, 2, 1) @ T)
    at = place(WHOLE.object_motion, other)
    assert not at.same_take
    assert at.begin == 0
    assert np.allclose(at.T[:2, 3], (-2, -1))


def test_figures_are_what_was_put_in(write_result: WriteResult) -> None:
    """A person 4 cm beside the truth, whose palms slide over the box at 6 cm/s."""
    truth = replace(WHOLE, label="truth", truth=True)
    other = replace(carrying(aside=0.04), label="aside")
    slide = (
        WHOLE.object_motion.T_world_object[:, :3, 1]
        * np.linspace(0, 0.06 * 59 / 30, FRAMES)[:, None]
    )
    joints = WHOLE.human.joints.copy()
    joints[:, 22:] += slide[:, None]
    sliding = replace(WHOLE, human=replace(WHOLE.human, joints=joints), label="sliding")
    made = compared([truth, other, sliding])
    assert made.notes == ()
    assert [c.reference is None for c in made.contenders] == [True, False, False]
    true, beside, slid = made.figures
    assert "mpjpe_cm" not in true
    assert beside["mpjpe_cm"] == pytest.approx(0.0, abs=1e-6)
    assert beside["t_root_cm"] == pytest.approx(4.0, abs=1e-6)
    assert beside["hand_jpe_cm"] == pytest.approx(4.0, abs=1e-6)
    assert beside["slip_cm_s"] == pytest.approx(0.0, abs=1e-6)
    assert slid["slip_cm_s"] == pytest.approx(6.0, abs=1e-3)
    assert true["held_percent"] == 100
    best = [[n.name for n in c.numbers if n.best] for c in made.contenders]
    assert "T_root" in best[2]
    assert "T_root" not in best[1]


def test_a_hand_that_is_nowhere_near_holds_nothing() -> None:
    far = replace(carrying(aside=3.0), contact=np.zeros((FRAMES, 2), bool), label="far")
    near, away = compared([WHOLE, far]).figures
    assert (near["held_percent"], away["held_percent"]) == (100, 0)
    assert "slip_cm_s" not in away


def test_lengths_and_starts_are_said() -> None:
    made = compared([replace(WHOLE, label="A"), replace(stretch(WHOLE, 15, 45), label="B")])
    assert [c.begin for c in made.contenders] == [0, 15]
    said = " ".join(made.notes)
    assert "B begins 0.50 s after A." in said
    assert "B ends 0.50 s before A" in said
    first = compared([replace(stretch(WHOLE, 15, 60), label="B"), replace(WHOLE, label="A")])
    assert [c.begin for c in first.contenders] == [15, 0]
    assert "A begins 0.50 s before B." in " ".join(first.notes)


def test_other_objects_need_to_be_allowed() -> None:
    other = replace(carrying(size=0.9), label="other")
    assert not same_object(WHOLE.object_motion.mesh, other.object_motion.mesh)
    with pytest.raises(InputError, match="another object") as caught:
        compared([WHOLE, other])
    assert (caught.value.code, "‹any_object›" in caught.value.fix) == ("objects-differ", True)
    made = compared([replace(WHOLE, truth=True), other], any_object=True)
    assert "goes another way" in made.notes[0]
    assert "mpjpe_cm" not in made.figures[1]
    assert made.contenders[1].reference is None


def test_one_alone_is_no_comparison() -> None:
    with pytest.raises(InputError) as caught:
        compared([WHOLE])
    assert caught.value.code == "one-motion"


def test_samples_are_named_by_number(write_result: WriteResult) -> None:
    folder = write_result("take", WHOLE, carrying(aside=0.1), carrying(aside=0.2), chosen=1)
    (chosen,) = load_motions([choice(str(folder))])
    assert chosen.label == "take"
    assert np.allclose(chosen.human.root, carrying(aside=0.1).human.root, atol=1e-5)
    (third,) = load_motions([choice(f"{folder}#3")])
    assert third.label == "take #3"
    assert np.allclose(third.human.root, carrying(aside=0.2).human.root, atol=1e-5)
    every = load_motions([choice(str(folder))], all_samples=True)
    assert [m.label for m in every] == ["take #1", "take #2", "take #3"]
    for wrong in ("#4", "#0", "#x"):
        with pytest.raises(InputError) as caught:
            load_motions([choice(f"{folder}{wrong}")])
        assert caught.value.code == "sample-missing"
    with pytest.raises(InputError) as caught:
        choice(f"{folder}_not#1")
    assert caught.value.code == "motion-missing"


def test_results_of_one_name_are_told_apart(write_result: WriteResult) -> None:
    a, b = write_result("a/take", WHOLE), write_result("b/take", WHOLE)
    labels = [m.label for m in load_motions([choice(str(a)), choice(str(b)), choice(str(b))])]
    assert len(set(labels)) == 3
    assert labels[0] == str(a)


def test_recorded_and_training_clips_are_the_truth(write_clip, tmp_path: Path) -> None:
    write_clip("sub1_box_001")
    (clip,) = load_motions([choice(str(tmp_path / "sub1_box_001.npz"))])
    assert clip.truth
    assert clip.contact.all()
    made = Clip(
        name="walk 7",
        source="synthesis",
        licence="",
        root=WHOLE.human.root.astype(np.float32),
        rotations=WHOLE.human.rotations.astype(np.float32),
        hand_contact=np.ones((FRAMES, 2), np.float32),
        foot_contact=np.ones((FRAMES, 4), np.float32),
        object_motion=WHOLE.object_motion,
    )
    path = tmp_path / "set.npz"
    save_clips(path, [replace(made, name="bare", object_motion=None), made])
    for which in ("walk 7", "2"):
        (trained,) = load_motions([choice(f"{path}#{which}")])
        assert trained.truth
        assert np.abs(trained.human.joints - WHOLE.human.joints).max() < 1e-3
    for which, code in (
        ("", "clip-not-named"),
        ("#bare", "clip-without-object"),
        ("#3", "sample-missing"),
    ):
        with pytest.raises(InputError) as caught:
            load_motions([choice(f"{path}{which}")])
        assert caught.value.code == code


def test_by_the_papers_rule_a_hand_never_lets_go(write_result: WriteResult) -> None:
    """The person takes their hands off the box half way; the rule keeps them on it."""
    human = WHOLE.human
    late = np.arange(FRAMES) >= 30
    rotations = human.rotations.copy()
    spread = np.linspace(0, 0.8, 30)
    for j, sign in ((16, 1), (17, -1)):
        for k in (0, 2, 4):
            way = Rotation.from_rotvec(np.outer(sign * spread, [0, 0, 1])).as_matrix()
            rotations[late, j + k] = way @ rotations[late, j + k]
    from omomo_core.body.kinematics import joints_of

    joints = joints_of(WHOLE.body, human.root, rotations)
    contact = np.where(late[:, None], 0.0, np.ones((FRAMES, 2)))
    free = replace(
        WHOLE,
        human=replace(human, rotations=rotations, joints=joints, hand_contact=contact),
        contact=contact > 0.5,
    )
    folder = write_result("open", free)
    ours, paper = load_motions([choice(str(folder))], paper_rule=True)
    assert paper.label == "open, paper's rule"
    assert not ours.contact[30:].any()
    assert paper.contact.all()
    figures = compared([ours, paper]).figures
    gap = [np.abs(joints[-1, 22] - m.human.joints[-1, 22]).max() for m in (ours, paper)]
    assert gap[0] < 1e-4 < 0.05 < gap[1]  # the hand was brought back
    assert figures[1]["held_percent"] >= figures[0]["held_percent"]
    assert figures[1]["slip_cm_s"] < 3


@pytest.fixture
def command() -> typer.Typer:
    app = typer.Typer()
    app.command()(compare)
    return app


def run(command: typer.Typer, *words: str) -> None:
    done = CliRunner().invoke(command, list(words))
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output


@pytest.mark.runs("compare")
def test_the_command_writes_what_its_ending_says(
    write_result: WriteResult, command: typer.Typer, tmp_path: Path
) -> None:
    short = [stretch(carrying(aside=a), 20, 28) for a in (0.0, 0.05)]
    folder = write_result("take", *short)
    small = ["--size", "96x72", "--samples", str(folder), "--no-markers"]
    movie, picture, figures = (tmp_path / n for n in ("c.mp4", "c.png", "c.json"))
    run(command, *small, "-o", str(movie), "--heat", "--json", str(figures))
    assert len(read_frames(movie, range(8))) == 8
    rows = json.loads(figures.read_text())["motions"]
    assert [r["label"] for r in rows] == ["take #1", "take #2"]
    assert rows[0]["lasts_s"] == pytest.approx(8 / 30)
    assert rows[0]["figures"]["slip_cm_s"] >= 0
    run(command, *small, "-o", str(picture), "--sheet", "2", "--label", "a", "--label", "b")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["-o", "x.avi"], "output-ending"),
        (["-o", "x.png"], "output-ending"),
        (["-o", "x.mp4", "--still", "0"], "output-ending"),
        (["-o", "nowhere/x.mp4"], "output-not-writable"),
        (["-o", "x.mp4", "--size", "big"], "size-invalid"),
        (["-o", "x.mp4", "--label", "one"], "labels-differ"),
        (["-o", "x.png", "--still", "99"], "time-outside"),
    ],
)
def test_what_cannot_be_drawn_is_said_and_leaves_no_file(
    write_result: WriteResult,
    command: typer.Typer,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    code: str,
) -> None:
    folder = write_result("take", WHOLE, WHOLE)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        run(command, str(folder), "--samples", *words)
    assert caught.value.code == code
    assert sorted(p.name for p in tmp_path.iterdir()) == ["take"]


def test_a_damaged_result_is_named(write_result: WriteResult) -> None:
    folder = write_result("take", WHOLE)
    (folder / "motion.npz").write_bytes(b"PK nothing")
    with pytest.raises(InputError, match="cannot be read") as caught:
        load_motions([choice(str(folder))])
    assert "take" in caught.value.where


def test_moving_a_motion_moves_all_of_it() -> None:
    T = turned(0.7, 1.0, -2.0)
    other: Motion = moved(WHOLE, T)
    want = WHOLE.human.joints @ T[:3, :3].T + T[:3, 3]
    assert np.allclose(other.human.joints, want)
    from omomo_core.body.kinematics import joints_of

    assert np.allclose(
        joints_of(WHOLE.body, other.human.root, other.human.rotations), want, atol=1e-5
    )
