"""Databases and workers for the tests of the jobs."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from capture_app.jobs.fleet import Fleet
from capture_app.jobs.queue import JobQueue, open_queue

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

_PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin"))


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture(scope="session")
def postgres(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], str]]:
    """A PostgreSQL cluster of our own; gives the URL of a new, empty database each time."""
    if not _PROGRAMS:
        pytest.skip("PostgreSQL is not installed")
    bin_, user = _PROGRAMS[-1], "postgres" if os.getuid() == 0 else None
    # In the system's temporary folder: another user must get there, and a socket's path be short.
    folder = Path(subprocess.check_output(["mktemp", "-d"], text=True).strip())
    if user:
        shutil.chown(folder, user)
    data, port = folder / "data", _free_port()

    def call(*command: str) -> None:
        subprocess.run(
            command, user=user, cwd=folder, check=True, stdout=subprocess.DEVNULL, timeout=60
        )

    call(str(bin_ / "initdb"), "-D", str(data), "-A", "trust", "-U", "omocap", "-N")
    options = f"-p {port} -k {folder} -c listen_addresses=127.0.0.1 -c fsync=off"
    control = [str(bin_ / "pg_ctl"), "-D", str(data), "-l", str(folder / "log"), "-w"]
    call(*control, "-o", options, "start")
    made = 0

    def database() -> str:
        nonlocal made
        made += 1
        url = f"postgresql://omocap@127.0.0.1:{port}"
        subprocess.run(
            [str(bin_ / "psql"), "-q", f"{url}/postgres", "-c", f"CREATE DATABASE jobs{made}"],
            check=True,
        )
        return f"{url}/jobs{made}"

    try:
        yield database
    finally:
        call(*control, "-m", "immediate", "stop")
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.slow)])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Of an empty database, of each kind."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'jobs.sqlite'}"
    return request.getfixturevalue("postgres")()


@pytest.fixture
def queue(database_url: str) -> Iterator[JobQueue]:
    opened = open_queue(database_url)
    yield opened
    opened.close()


Start = Callable[..., Fleet]


@pytest.fixture
def start(tmp_path: Path) -> Generator[Start]:
    """Starts workers that know the stand-in; they are stopped in the end."""
    fleets: list[Fleet] = []

    def begin(queue: JobQueue, count: int = 1, **more: Any) -> Fleet:
        fleet = Fleet(
            queue.database_url,
            count,
            log=tmp_path / "workers.log",
            command=[sys.executable, str(HERE / "worker_process.py")],
            longest_wait=0.2,
            **{"died": queue.worker_died, **more},
        )
        fleets.append(fleet)
        fleet.start()
        return fleet

    yield begin
    for fleet in fleets:
        fleet.stop()
