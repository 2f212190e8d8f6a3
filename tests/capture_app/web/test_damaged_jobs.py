"""A list of jobs that is damaged costs the list, and nothing else; the server starts, and says so."""

import random
import shutil
import signal
from pathlib import Path

import httpx
import pytest

from capture_app.commands.export import ExportRequest
from capture_app.jobs.queue import open_queue
from capture_app.web.library import Library
from capture_app.web.server import open_jobs
from tests.capture_app.web.serving import Server

RESULT = "00000000000000aa"
JOBS = 40


@pytest.fixture(scope="module")
def used(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library with a result, and jobs some of which are only in the write-ahead log."""
    root = tmp_path_factory.mktemp("used") / "library"
    library = Library(root)
    place = library.results.place(RESULT)
    place.mkdir()
    (place / "manifest.json").write_text("{}")
    (library.results.folder / f".{RESULT}.0123456789abcdef.part").mkdir()
    queue = open_queue(library.database)
    for k in range(JOBS):
        queue.submit(ExportRequest(name=f"{k}", result=place, to="csv", output=place / f"{k}.csv"))
    # As a killed server leaves it: the log is not folded into the file.
    copy = root.with_name("killed")
    shutil.copytree(root, copy)
    queue.close()
    assert (copy / "jobs.sqlite-wal").stat().st_size > 10_000
    return copy


def _opened(used: Path, folder: Path) -> Library:
    shutil.copytree(used, folder)
    return Library(folder)


@pytest.mark.parametrize("seed", range(6))
def test_a_log_that_was_cut_or_overwritten(used: Path, tmp_path: Path, seed: int) -> None:
    library = _opened(used, tmp_path / "library")
    wal = library.root / "jobs.sqlite-wal"
    rng = random.Random(seed)
    data = bytearray(wal.read_bytes())
    at = rng.randrange(len(data))
    data[at : at + 4096] = b"" if seed % 2 else rng.randbytes(4096)
    wal.write_bytes(data[: rng.randrange(at, len(data))] if seed % 3 == 0 else data)
    said: list[str] = []
    queue = open_jobs(library, said.append)
    records = queue.list(limit=1000)
    assert len(records) <= JOBS
    assert bool(said) == bool(list(library.root.glob("jobs-damaged-*")))
    queue.submit(ExportRequest(result=library.root, to="csv", output=library.root / "a.csv"))
    queue.close()
    assert [id_ for id_, _ in library.results.list()] == [RESULT]


@pytest.mark.parametrize("left", [100, 5000, 40_000])
def test_the_server_starts_says_so_and_lists_every_result(
    used: Path, tmp_path: Path, left: int
) -> None:
    library = _opened(used, tmp_path / "library")
    open_queue(library.database).close()  # folds the log into the file
    file = library.root / "jobs.sqlite"
    assert file.stat().st_size > left
    # Zeros from there on, as after a crash of the disk.
    data = file.read_bytes()
    file.write_bytes(data[:left] + bytes(len(data) - left))
    server = Server(library.root)
    try:
        server.wait()
        results = httpx.get(f"{server.url}/api/results", timeout=30).json()
        jobs = httpx.get(f"{server.url}/api/jobs", timeout=30).json()
    finally:
        status = server.stop(signal.SIGINT)
    assert status == 0
    assert [one["id"] for one in results] == [RESULT]
    assert jobs == []
    assert "The list of jobs was damaged" in " ".join(server.said.split())
    assert "Traceback" not in server.said
    assert len(list(library.root.glob("jobs-damaged-*.sqlite"))) == 1
    assert not list(library.results.folder.glob(".*.part"))
