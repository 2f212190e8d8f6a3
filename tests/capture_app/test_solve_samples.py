"""Samples that are solved when they are asked for: kept in the result, and the same whoever asks."""

import shutil
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from capture_app.cli.app import invoke
from capture_app.commands.run import RunRequest
from capture_app.motion_arrays import SAMPLED, sample_file, unsolved_samples
from capture_app.pipeline import run_take
from capture_app.replay.scene_pack import pack_result
from capture_app.result import Result, body_of, load_result
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from capture_app.solve_samples import all_solved, solved_result
from omomo_core.errors import InputError
from omomo_core.generation.sampled_file import load_sampled
from tests.capture_app.replay.made import read_pack


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The demonstration take with three samples, of which what is shown is solved."""
    request = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=tmp_path_factory.mktemp("demo") / "result",
        samples=3,
        steps=3,
        video_size=None,
    )
    return run_take(request)


@pytest.fixture
def result(made: Result, tmp_path: Path) -> Result:
    """The same in a folder of its own."""
    return load_result(Path(shutil.copytree(made.folder, tmp_path / "result")))


def _other(result: Result) -> int:
    return min(result.unsolved)


def test_a_sample_is_solved_once_and_kept(result):
    k = _other(result)
    rough = result.people[k]
    solved = solved_result(result, [k])
    assert k not in solved.unsolved
    assert rough.finger_fit is None
    assert solved.people[k].finger_fit is not None
    assert np.abs(solved.people[k].human.joints - rough.human.joints).max() > 0.001
    again = load_result(result.folder)
    assert again.unsolved == result.unsolved - {k}
    for name in ("root", "rotations", "fingers", "joints"):
        one, other = (getattr(r.people[k].human, name) for r in (solved, again))
        np.testing.assert_array_equal(one, other)


def test_a_run_and_its_file_give_the_same_person_to_the_last_bit(result):
    """The chosen sample was solved in the run's memory; here it is solved from the folder."""
    chosen = result.manifest.chosen
    again = load_sampled(result.folder / SAMPLED, body_of(result)).solve(chosen)
    stored = result.people[chosen]
    for name in ("root", "joints", "hand_contact", "foot_contact"):
        one = getattr(again.human, name).astype(np.float32)
        np.testing.assert_array_equal(one, getattr(stored.human, name))
    np.testing.assert_array_equal(
        again.finger_fit.depth.astype(np.float32), stored.finger_fit.depth
    )


def test_what_is_solved_already_stays_as_it_is(result):
    assert solved_result(result, [result.manifest.chosen]) is result


def test_all_are_solved_where_that_is_asked_for(made, tmp_path):
    options = made.manifest.options
    assert options["solve"] == "shown"
    whole = all_solved(load_result(Path(shutil.copytree(made.folder, tmp_path / "copy"))))
    assert not whole.unsolved
    assert unsolved_samples(whole.folder) == frozenset()


def test_an_export_of_another_sample_solves_it(result, tmp_path):
    k = _other(result)
    file = tmp_path / "other.csv"
    assert invoke(["export", str(result.folder), "--sample", str(k + 1), "-o", str(file)]) == 0
    assert sample_file(result.folder, k).is_file()
    assert k not in load_result(result.folder).unsolved


def test_a_scene_says_which_samples_are_not_solved(result):
    header, _ = read_pack(pack_result(result, film=False))
    assert header["unsolved"] == sorted(result.unsolved)


def test_damaged_samples_are_refused_by_name(result):
    (result.folder / "sampled.npz").write_bytes(b"PK\x03\x04 and no more")
    with pytest.raises(InputError, match="not solved yet cannot be read"):
        solved_result(result, [_other(result)])


def test_a_folder_that_cannot_be_written_gives_the_sample_all_the_same(result, monkeypatch):
    def full(path):
        raise InputError("disk-full", "The disk is full.", where=str(path), fix="Make room.")

    monkeypatch.setattr("capture_app.result.whole_file", full)
    k = _other(result)
    assert solved_result(result, [k]).people[k].finger_fit is not None
    assert not sample_file(result.folder, k).exists()


@pytest.mark.parametrize("command", ["export", "replay", "compare", "render"])
def test_commands_show_how_far_solving_is(result, tmp_path, monkeypatch, command):
    told: list[str] = []

    @contextmanager
    def bars():
        yield lambda stage, done: told.append(stage)

    monkeypatch.setattr(f"capture_app.cli.{command}.progress_bars", bars)
    number = str(_other(result) + 1)
    words = {
        "export": ["--sample", number, "-o", str(tmp_path / "other.csv")],
        "replay": ["--no-film", "-o", str(tmp_path / "other.html")],
        "compare": ["--samples", "--still", "1", "-o", str(tmp_path / "other.png")],
        "render": ["--sample", number, "--still", "1", "-o", str(tmp_path / "other.png")],
    }
    assert invoke([command, str(result.folder), *words[command]]) == 0
    assert "solve" in told
