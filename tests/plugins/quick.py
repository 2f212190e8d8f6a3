"""What `./run test --quick` leaves out, and in which order tests are run.

`tests/seconds.json` holds how long files and tests took. `./run test --note-seconds` writes it again.
"""

import json
import multiprocessing.process
import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

SECONDS = Path(__file__).parents[1] / "seconds.json"
"""Seconds of files and of tests; what is not there is short."""
_LONG, _NOTED = 0.3, 0.3
"""Seconds from which a quick run leaves a test out, and from which one is written down."""
_STARTS = (
    (subprocess.Popen, "__init__"),
    (multiprocessing.process.BaseProcess, "start"),
    (os, "fork"),
)
"""What starts a process."""
_REASON = "it starts a process: a quick run leaves it out"
_ROOMS = ("jobs", "web", "page", "replay")
"""Folders of tests/capture_app whose workers, servers and browsers start processes from other threads."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The two options of this plugin."""
    parser.addoption("--quick", action="store_true", help="leave out long tests and processes")
    parser.addoption("--note-seconds", action="store_true", help="write tests/seconds.json")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long files begin first, so that no worker has a long one left when the others have ended."""
    seconds: dict[str, float] = json.loads(SECONDS.read_text())
    items.sort(key=lambda item: -seconds.get(_file(item.nodeid), 0.0))
    if config.getoption("quick"):
        rooms = tuple(f"tests/capture_app/{room}/" for room in _ROOMS)
        kept, left_out = list[pytest.Item](), list[pytest.Item]()
        for item in items:
            long = seconds.get(_test(item.nodeid), 0.0) >= _LONG
            (left_out if long or item.nodeid.startswith(rooms) else kept).append(item)
        config.hook.pytest_deselected(items=left_out)
        items[:] = kept


@pytest.fixture(scope="session", autouse=True)
def no_process(pytestconfig: pytest.Config) -> Iterator[None]:
    """A test that starts a process is skipped at that moment in a quick run."""
    with pytest.MonkeyPatch.context() as patch:
        if pytestconfig.getoption("quick"):
            for owner, name in _STARTS:
                patch.setattr(owner, name, _skip)
        yield


def _skip(*_: Any, **__: Any) -> None:
    pytest.skip(_REASON)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Write down the seconds of this run, if that was asked for."""
    if not config.getoption("note_seconds"):
        return
    files, tests = Counter[str](), Counter[str]()
    reports = [report for key in ("passed", "") for report in terminalreporter.stats.get(key, ())]
    for report in reports:
        files[_file(report.nodeid)] += report.duration
        test = _test(report.nodeid)
        tests[test] = max(tests[test], report.duration)
    both = {name: round(took, 1) for name, took in (files + tests).items() if took >= _NOTED}
    SECONDS.write_text(json.dumps(both, indent=0, sort_keys=True) + "\n")


def _file(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def _test(nodeid: str) -> str:
    """The name without parameters."""
    return nodeid.partition("[")[0]
