"""Peak memory of `omocap run` on takes of any length: the whole command, with all that it keeps and writes.

Usage: python -m benchmarks.run_memory [--seconds 13 120 600] [--samples 4] [--solve shown|all] [--steps 10]

The simulated phone records the demonstration's box, which is carried to and fro as long as asked for. Each
take is run without a video, in a process of its own, one after the other; printed are the processor time of
that process, its wall time, and the most memory that it had, pages of mapped files among it.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from itertools import cycle, islice
from pathlib import Path

import numpy as np

from capture_app.simulator.demo_take import (
    DEMO,
    MESH,
    MOUNT,
    box_mesh,
    carried_box,
    clamped_phone,
    write_recording,
)
from capture_app.simulator.simulated_phone import NO_NOISE, simulate
from omomo_core.motion import FPS, ObjectMotion


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, nargs="+", default=[13, 120, 600])
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--solve", choices=("shown", "all"), default="shown")
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--one", type=int, help="measure this many seconds in this process")
    said = parser.parse_args()
    if said.one is None:
        print(f"{'seconds':>8}{'processor s':>13}{'wall s':>8}{'peak MB':>9}", flush=True)
        for seconds in said.seconds:
            # Each in a process of its own: a peak is that of the largest child.
            one = [*sys.argv[1:], "--one", str(seconds)]
            subprocess.run([sys.executable, "-m", "benchmarks.run_memory", *one], check=True)
        return
    with tempfile.TemporaryDirectory() as folder:
        asked = record(Path(folder), said.one)
        asked += ["--samples", said.samples, "--solve", said.solve, "--steps", said.steps]
        run = "from capture_app.cli.start import main; main()"
        command = [sys.executable, "-c", run, "run", *asked, "-o", f"{folder}/out", "--no-video"]
        start = time.perf_counter()
        done = subprocess.run(
            [str(word) for word in command], check=True, capture_output=True, text=True
        )
        wall, used = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor, peak = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    # The command says how long the motion is: a log may be cut where tracking seems lost.
    made = float(done.stdout.split(" s of motion")[0].split()[-1])
    print(f"{made:8.0f}{processor:13.1f}{wall:8.1f}{peak:9.0f}", flush=True)


def record(folder: Path, seconds: int) -> list[object]:
    """Write what the phone logs; return the arguments that name it, mesh and mount."""
    # The noise of a phone adds up to another floor within minutes.
    logged = simulate(to_and_fro(seconds), clamped_phone(), seed=0, noise=NO_NOISE)
    session = write_recording(logged, folder / "log")
    return [str(session), "--object", str(DEMO / MESH), "--mount", str(DEMO / MOUNT)]


def to_and_fro(seconds: int) -> ObjectMotion:
    """The box's motion, forwards, backwards, and so on."""
    there = carried_box().T_world_object
    frames = list(islice(cycle([*there, *there[::-1]]), round(seconds * FPS)))
    return ObjectMotion(box_mesh(), np.stack(frames), np.ones(len(frames), bool))


if __name__ == "__main__":
    main()
