"""Many sessions: what is found, what is ordered, what is told, and that it goes on."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from waiting import until

from capture_app.cli.app import invoke
from capture_app.commands.run import RunRequest
from capture_app.jobs.batch import find_sessions, order_of, read_table, submit_batch, write_results
from capture_app.jobs.queue import open_queue
from capture_app.pipeline import run_take
from omomo_core.errors import InputError


@pytest.fixture
def takes(inputs, tmp_path: Path) -> Path:
    """Two sessions, an archive of one, one deeper, a folder of something else, and no sessions."""
    folder = tmp_path / "takes"
    for name in ("a", "b", "day/one", "day/two"):
        shutil.copytree(inputs.session, folder / name)
    shutil.make_archive(str(folder / "c"), "zip", inputs.session)
    (folder / "junk").mkdir()
    (folder / "junk" / "notes.txt").write_text("nothing")
    (folder / "notes.txt").write_text("nothing")
    shutil.copytree(inputs.session, folder / ".hidden")
    (folder / "result").mkdir()
    (folder / "result" / "manifest.json").write_text("{}")
    return folder


def test_sessions_are_found_and_what_may_be_one_is_not_passed_over(takes: Path) -> None:
    found = find_sessions(takes)
    assert found == {
        "a": takes / "a",
        "b": takes / "b",
        "c": takes / "c.zip",
        "day_one": takes / "day" / "one",
        "day_two": takes / "day" / "two",
        "junk": takes / "junk",
    }


@pytest.mark.parametrize(("folder", "code"), [("none", "batch-missing"), (".", "batch-empty")])
def test_a_folder_without_sessions_is_named(tmp_path: Path, folder: str, code: str) -> None:
    with pytest.raises(InputError) as caught:
        find_sessions(tmp_path / folder)
    assert caught.value.code == code


def test_a_table_says_what_is_particular_to_each_session(tmp_path: Path) -> None:
    file = tmp_path / "takes.csv"
    file.write_text(
        "session,object,mount,height,up,name,stood\n"
        'one,chair.obj,identity,1.8,"0,1,0",,"0.5,-1"\n'
        "deep/one,/abs/b.obj,m.json,,,,phone\n"
        "two,,,,,Take / 2,\n"
    )
    first, second, third = read_table(file)
    assert first == {
        "session": tmp_path / "one",
        "object": tmp_path / "chair.obj",
        "mount": "identity",
        "height": 1.8,
        "up": (0.0, 1.0, 0.0),
        "name": "one",
        "stood": (0.5, -1.0),
    }
    assert second["stood"] == "phone"
    assert "stood" not in third
    assert (second["object"], second["mount"]) == (Path("/abs/b.obj"), tmp_path / "m.json")
    assert (second["name"], third["name"]) == ("one_2", "Take _ 2")
    order = order_of({"samples": 3, **first}, tmp_path / "out")
    assert (order.height, order.up, order.samples, order.mount) == (1.8, (0, 1, 0), 3, None)
    assert order.stood == (0.5, -1.0)
    assert order.output == tmp_path / "out" / "one"


def test_a_place_before_the_phone_is_not_asked_of_an_animation(tmp_path: Path) -> None:
    mesh = tmp_path / "thrown.npz"
    np.savez(mesh, T_world_object=np.tile(np.eye(4), (60, 1, 1)), fps=30)
    said = {"session": mesh, "name": "thrown", "object": tmp_path / "box.obj", "stood": "phone"}
    order = order_of(said, tmp_path)
    assert order.animated
    assert order.stood is None


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("object\na.obj\n", "batch-table-columns"),
        ("session,colour\na,red\n", "batch-table-columns"),
        ("session,object\na\n", "batch-table-line"),
        ("session,object\na,b,c\n", "batch-table-line"),
        ("session,name\n,x\n", "batch-table-line"),
        ("session,stood\na,here\n", "place-invalid"),
        ("session,up\na,above\n", "direction-invalid"),
        ("session,height\na,9\n", "batch-option"),
    ],
)
def test_a_table_that_is_not_understood_is_refused_with_its_line(
    tmp_path: Path, text: str, code: str
) -> None:
    file = tmp_path / "takes.csv"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_table(file)
    assert caught.value.code == code
    assert str(file) in caught.value.where


def test_wrong_options_and_a_missing_mount_are_told_before_anything_starts(tmp_path: Path) -> None:
    said = {"session": tmp_path / "one", "name": "one"}
    with pytest.raises(InputError) as caught:
        order_of(said, tmp_path)
    assert caught.value.code == "mount-missing"
    with pytest.raises(InputError) as caught:
        order_of({**said, "mount": "identity", "height": "9"}, tmp_path)
    assert (caught.value.code, caught.value.where) == ("batch-option", "one")
    assert "height" in caught.value.what


def test_the_same_batch_again_doubles_nothing_and_tries_again_what_failed(tmp_path: Path) -> None:
    queue = open_queue(str(tmp_path / "jobs.sqlite"))
    rows = [
        {"session": tmp_path / name, "mount": "identity", "name": name} for name in ("a", "b", "c")
    ]
    orders = [order_of(row, tmp_path / "out") for row in rows]
    ids, _ = submit_batch(queue, orders)
    queue.cancel(ids[1])
    assert submit_batch(queue, orders) == (ids, [])
    assert [job.state for job in queue.get_all(ids)] == ["queued"] * 3
    assert len(queue.list()) == 3
    queue.close()


@pytest.fixture
def made(inputs, weights: Path, tmp_path: Path) -> RunRequest:
    """An order whose result stands where it wants it, though no queue knows of it."""
    said = {
        "session": inputs.session, "object": inputs.mesh, "mount": inputs.mount, "name": "take",
        "samples": 1, "steps": 1, "weights": weights, "video_size": None, "stood": (0.5, -1.0),
    }  # fmt: skip
    order = order_of(said, tmp_path / "out")
    run_take(order, lambda stage, done: None)
    return order


def test_what_was_done_stays_done_when_the_database_is_lost(
    made: RunRequest, tmp_path: Path
) -> None:
    queue = open_queue(str(tmp_path / "new.sqlite"))
    other = made.model_copy(update={"seed": 1})
    ids, notes = submit_batch(queue, [made, other])
    done, fails = queue.get_all(ids)
    assert (done.state, fails.state, notes) == ("done", "queued", [])
    assert done.summary["sample"] == 1
    assert done.timings["solve"] > 0
    assert submit_batch(queue, [made]) == ([done.id], [])
    assert queue.get_all([done.id]) == [done]
    (made.session / "changed.txt").write_text("more")
    again = open_queue(str(tmp_path / "third.sqlite"))
    ids, _ = submit_batch(again, [made])
    assert again.get_all(ids)[0].state == "queued"
    queue.close()
    again.close()


def test_a_damaged_result_is_put_aside_and_made_again(made: RunRequest, tmp_path: Path) -> None:
    queue = open_queue(str(tmp_path / "jobs.sqlite"))
    (id_,), _ = submit_batch(queue, [made])
    assert submit_batch(queue, [made]) == ([id_], [])
    file = made.output / "motion.npz"
    damaged = bytearray(file.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    file.write_bytes(damaged)
    for number in ("", "_2"):
        queue.adopt(id_, made, timings={}, summary={})
        ids, notes = submit_batch(queue, [made])
        assert ids == [id_]
        assert f"take.damaged{number}," in notes[0]
        assert queue.get_all(ids)[0].state == "queued"
        assert not made.output.exists()
        queue.cancel(id_)
        queue.delete(id_)
        shutil.copytree(made.output.with_name("take.damaged"), made.output)
    queue.close()


@pytest.mark.parametrize("room", [True, False])
def test_a_batch_that_a_full_disk_ends_says_so_and_what_became_of_each(
    takes: Path, tmp_path: Path, monkeypatch, capsys, room: bool
) -> None:
    full = InputError("disk-full", "The disk is full; 6 sessions are not done.", fix="Make room.")

    def watch(*_: object, **__: object) -> None:
        raise full

    def no_room(*_: object) -> None:
        raise InputError("disk-full", "The table cannot be written.")

    monkeypatch.setattr("capture_app.jobs.batch_watch.watch", watch)
    if not room:
        monkeypatch.setattr("capture_app.jobs.batch.write_results", no_room)
    out = tmp_path / "out"
    code = invoke(["batch", str(takes), "--mount", "identity", "-o", str(out), "--workers", "0"])
    assert code == 2
    told = capsys.readouterr().err
    assert "6 sessions are not done" in told
    assert "Traceback" not in told
    assert (out / "results.csv").exists() == room


def test_one_table_tells_of_all(tmp_path: Path) -> None:
    queue = open_queue(str(tmp_path / "jobs.sqlite"))
    row = {"session": tmp_path / "a", "mount": "identity", "name": "=a"}
    ids, _ = submit_batch(queue, [order_of(row, tmp_path / "out")])
    job = queue.get_all(ids)[0]
    done = job.model_copy(
        update={
            "state": "done",
            "timings": {"read": 1.0, "solve": 2.0},
            "summary": {"verdict": "good", "sample": 2, "scores": {"miss_cm": 0.123456}},
        }
    )
    write_results(tmp_path, [done, job])
    with (tmp_path / "results.csv").open() as file:
        first, second = csv.DictReader(file)
    assert (first["state"], first["verdict"], first["seconds"]) == ("done", "good", "3.0")
    assert (first["miss_cm"], second["miss_cm"]) == ("0.1235", "")
    assert json.loads((tmp_path / "results.json").read_text())[0]["scores"] == {"miss_cm": 0.1235}
    queue.close()


def command(*arguments: str) -> list[str]:
    script = "from capture_app.cli.start import main; main()"
    return [sys.executable, "-c", script, *arguments]


@pytest.mark.slow
def test_a_batch_is_interrupted_and_goes_on(inputs, weights: Path, takes: Path) -> None:
    out = inputs.folder / "out"
    arguments = command(
        "batch", str(takes), "--object", str(inputs.mesh), "--mount", str(inputs.mount),
        "-o", str(out), "--samples", "1", "--steps", "2", "--weights", str(weights), "--no-video",
    )  # fmt: skip
    with subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True) as first:
        until(lambda: (out / "a" / "manifest.json").exists(), 120.0)
        os.kill(first.pid, signal.SIGINT)
        assert first.wait(60) == 130
        assert first.stderr is not None
        assert "Traceback" not in first.stderr.read()
    made = (out / "a" / "manifest.json").stat().st_mtime_ns
    second = subprocess.run(arguments, capture_output=True, text=True, timeout=280)
    assert second.returncode == 2  # one of them is no session
    assert "5 of 6" in second.stdout
    assert (out / "a" / "manifest.json").stat().st_mtime_ns == made
    with (out / "results.csv").open() as file:
        states = {row["name"]: (row["state"], row["code"]) for row in csv.DictReader(file)}
    good = dict.fromkeys(["a", "b", "c", "day_one", "day_two"], ("done", ""))
    assert states == {**good, "junk": ("failed", "session-unknown")}
    assert [path for path in out.iterdir() if path.name.startswith(".")] == []


def test_a_worker_without_a_usable_database_says_so_and_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from capture_app.cli.worker import worker

    (tmp_path / "jobs.sqlite").write_bytes(b"no database" * 500)
    with pytest.raises(InputError) as caught:
        worker(str(tmp_path / "jobs.sqlite"))
    assert caught.value.code == "jobs-database-damaged"
    assert capsys.readouterr().out == ""
