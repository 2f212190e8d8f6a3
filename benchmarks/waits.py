"""Seconds until a motion is there, and until its video is; and how fast the video is drawn.

Each take is run as a user runs it, `omocap run` in a process of its own, by this checkout and by another
one if it is given, in turns, so that the machine's load falls on both alike. Printed are the medians.

Usage: python -m benchmarks.waits [--other CHECKOUT] [--turns 3] [--log FILE_OF_A_PHONE]...
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from capture_app.result import load_result
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.motion import FPS

HERE = Path(__file__).parent.parent
_START = "from capture_app.cli.start import main; main()"


@dataclass(frozen=True)
class Wait:
    """Of one run, from the command's start."""

    motion: float
    """Seconds until the result folder stands."""
    whole: float
    """Seconds until the command ends, its video drawn."""
    pictures: int
    drawing: float
    """Seconds that drawing took."""


def words_of(log: Path | None) -> list[str]:
    """The command for a log, or for the demo; a bare log is taken as the motion of the demo's box."""
    if log is None:
        given = [str(DEMO / SESSION), "--mount", str(DEMO / MOUNT)]
    else:
        given = [str(log), "--mount", "identity", "--force"]
    return ["run", *given, "--object", str(DEMO / MESH)]


def wait_for(checkout: Path, words: list[str], folder: Path) -> Wait:
    """Run it, and watch for the result folder."""
    output = folder / "result"
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_WAIT_POLICY": "PASSIVE"}
    command = [sys.executable, "-P", "-c", _START, *words, "-o", str(output)]
    begin, motion = time.perf_counter(), 0.0
    with (folder / "said.txt").open("w") as said:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=said, stderr=subprocess.STDOUT
        )
        while process.poll() is None:
            if not motion and (output / "manifest.json").exists():
                motion = time.perf_counter() - begin
            time.sleep(0.02)
    whole = time.perf_counter() - begin
    if process.returncode:
        raise SystemExit((folder / "said.txt").read_text())
    made = load_result(output)
    # Versions that draw before they publish have noted how long it took.
    drawing = made.manifest.timings.get("video", whole - motion)
    return Wait(motion or whole, whole, len(made.object_motion.valid), drawing)


def tell(name: str, waits: list[Wait]) -> None:
    """A line of medians."""
    motion, whole, rate = (
        statistics.median(values)
        for values in zip(
            *((w.motion, w.whole, w.pictures / w.drawing) for w in waits), strict=True
        )
    )
    seconds = waits[0].pictures / FPS
    print(
        f"{name:44} {seconds:5.1f} s   motion after {motion:5.1f} s   "
        f"video after {whole:5.1f} s   drawn at {rate:4.1f} pictures/s",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--other", type=Path, help="another checkout of the project")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--log", type=Path, action="append", default=[])
    options = parser.parse_args()
    checkouts = {"this checkout": HERE}
    if options.other:
        checkouts["the other"] = options.other.resolve()
    for log in (None, *options.log):
        waits: dict[str, list[Wait]] = {name: [] for name in checkouts}
        for _ in range(options.turns):
            for name, checkout in checkouts.items():
                with tempfile.TemporaryDirectory() as folder:
                    words = words_of(log and log.resolve())
                    waits[name].append(wait_for(checkout, words, Path(folder)))
        for name, each in waits.items():
            tell(f"{log.name if log else 'demo'}, {name}", each)


if __name__ == "__main__":
    main()
