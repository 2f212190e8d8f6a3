"""Ctrl-C and SIGTERM end a command quietly and leave nothing half written."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from capture_app.cli.interrupts import INTERRUPTED, STOPPED, TERMINATED
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

_START = """
import signal
from capture_app.cli.start import main
given = signal.signal
def ready(number, handler):
    old = given(number, handler)
    if number == signal.SIGINT:
        signal.signal = given
        print("ready", flush=True)
    return old
signal.signal = ready
main()
"""
"""The command, which says when it has taken over Ctrl-C."""
_SWALLOWING = """
import signal, sys, time, types
from capture_app.cli.start import main
class Ended:
    def __del__(self):
        signal.raise_signal(int(sys.argv[1]))
def run_command():
    Ended()
    time.sleep(30)
sys.modules["capture_app.cli.app"] = types.SimpleNamespace(run_command=run_command)
main()
"""
"""The command, with a signal that arrives where Python ignores exceptions."""


def _command(*arguments: str) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", _START, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


@pytest.mark.parametrize("seconds", [0.0, 0.2, 0.6])
def test_an_interrupt_while_it_loads_is_no_traceback(seconds: float):
    process = _command("run", "nowhere", "--object", "x.obj", "--mount", "identity", "-o", "out")
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert "Traceback" not in told
    # Where it was quicker than the signal it has said what is wrong.
    assert process.returncode in (130, 2), told


@pytest.mark.parametrize(
    ("number", "code", "told"),
    [(signal.SIGINT, INTERRUPTED, f"{STOPPED}\n"), (signal.SIGTERM, TERMINATED, "")],
)
def test_a_signal_whose_exception_is_ignored_is_sent_again(number: int, code: int, told: str):
    """Python ignores exceptions in finalizers, and in callbacks of compiled code."""
    command = [sys.executable, "-c", _SWALLOWING, str(int(number))]
    process = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (process.returncode, process.stderr) == (code, told)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_run_that_is_stopped_leaves_no_folder(tmp_path: Path, number: int, code: int):
    given = [str(DEMO / name) for name in (SESSION, MESH, MOUNT)]
    process = _command(
        "run", given[0], "--object", given[1], "--mount", given[2], "-o", str(tmp_path / "out")
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".out.*.part")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(number)
    _, told = process.communicate(timeout=60)
    assert process.returncode == code, told
    assert STOPPED in told
    assert "Traceback" not in told
    assert list(tmp_path.iterdir()) == []
