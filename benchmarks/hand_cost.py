"""What hands cost: the share of laying palms and closing fingers in a whole `omocap run` without its video.

Usage: python -m benchmarks.hand_cost [LOG_OF_A_PHONE]...

The demo's take, and each log as a motion of the demo's box, become four people each in a process of its
own. Printed is the processor time of all of the command, with loading and export, and how much of it the
hands take.
"""

import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.waits import words_of
from capture_app.cli.start import main as command
from omomo_core.generation import decoding

HANDS = ("lay_palms", "close_fingers")
INSIDE = "--inside"
"""Says that this process is one of those that are measured."""


def measured(words: list[str]) -> None:
    """Run the command in this process, and print the time of its hands and of all."""
    spent, lock = Counter[str](), threading.Lock()

    def timed(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def timing(*args: Any, **named: Any) -> Any:
            began = time.thread_time()
            try:
                return call(*args, **named)
            finally:
                with lock:
                    spent[name] += time.thread_time() - began

        return timing

    for name in HANDS:
        setattr(decoding, name, timed(name, getattr(decoding, name)))
    sys.argv = ["omocap", *words]
    try:
        command()
    finally:
        print(f"{spent.total()} {time.process_time()}")


def cost(log: Path | None) -> tuple[float, float]:
    """Seconds of the processor that hands take, and that the whole command takes."""
    with tempfile.TemporaryDirectory() as folder:
        words = [*words_of(log), "--no-video", "-o", str(Path(folder) / "result")]
        line = [sys.executable, "-m", "benchmarks.hand_cost", INSIDE, *words]
        done = subprocess.run(line, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    hands, whole = map(float, done.stdout.splitlines()[-1].split())
    return hands, whole


def main() -> None:
    words = sys.argv[1:]
    if words[:1] == [INSIDE]:
        measured(words[1:])
        return
    print(f"{'take':32}{'hands':>8}{'of':>10}{'share':>8}")
    for log in (None, *map(Path, words)):
        hands, whole = cost(log)
        name = log.name if log else "demo"
        print(f"{name:32}{hands:6.1f} s{whole:8.1f} s{hands / whole:8.1%}")


if __name__ == "__main__":
    main()
