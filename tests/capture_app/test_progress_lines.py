"""Progress of commands where stderr is a log: one line a minute, by a clock of the test."""

import io

import pytest
from rich.console import Console
from rich.progress import TaskProgressColumn, TextColumn

from capture_app.cli import console


class Log:
    """Stderr as a file, and a clock that the test sets."""

    def __init__(self, *, terminal: bool = False) -> None:
        self.seconds = 1000.0
        self.file = io.StringIO()
        self.console = Console(
            file=self.file, width=80, force_terminal=terminal, get_time=lambda: self.seconds
        )

    @property
    def lines(self) -> list[str]:
        """What was written so far."""
        return self.file.getvalue().splitlines()


@pytest.fixture
def log(monkeypatch: pytest.MonkeyPatch) -> Log:
    log = Log()
    monkeypatch.setattr(console, "errors", log.console)
    return log


def test_stages_say_once_a_minute_how_far_they_are(log: Log):
    with console.progress_bars() as progress:
        for step in range(201):
            progress("video", step / 200)
            log.seconds += 1.0
    assert [line.split() for line in log.lines] == [
        ["Drawing", "the", "video", "30%", "0:01:00"],
        ["Drawing", "the", "video", "60%", "0:02:00"],
        ["Drawing", "the", "video", "90%", "0:03:00"],
    ]


def test_stages_share_the_minute(log: Log):
    with console.progress_bars() as progress:
        for step in range(121):
            progress(("hands", "body")[step % 2], step / 120)
            log.seconds += 1.0
    assert len(log.lines) == 2


def test_counts_say_what_is_left(log: Log):
    with console.counting("retarget") as progress:
        for done in range(100):
            progress(done, 200)
            log.seconds += 1.0
    (line,) = log.lines
    assert line.startswith("retarget 60/200 left 0:0")


def test_a_line_tells_how_many_are_done(log: Log):
    with console.counting("Asking") as progress:
        for step in range(101):
            progress(step, 200)
            log.seconds += 1.0
    (line,) = log.lines
    assert line.startswith("Asking 60/200")


def test_what_takes_less_than_a_minute_leaves_no_line(log: Log):
    with console.progress_bars() as progress:
        for step in range(60):
            progress("read", step / 60)
            log.seconds += 0.9
    assert log.lines == []


def test_a_terminal_has_bars_and_no_such_lines(monkeypatch: pytest.MonkeyPatch):
    log = Log(terminal=True)
    monkeypatch.setattr(console, "errors", log.console)
    columns = (TextColumn("{task.description}"), TaskProgressColumn())
    with console.ProgressBars(*columns) as shown:
        task = shown.add_task("hands", total=100)
        log.seconds += 61.0
        shown.update(task, completed=50)
        assert not any(line.strip() == "hands 50%" for line in log.lines)
    assert "50%" in log.file.getvalue()
