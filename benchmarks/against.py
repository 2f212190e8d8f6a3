"""This checkout against another one: processor time, wall time and peak memory, in alternating runs.

Usage: python -m benchmarks.against OTHER [--rounds 5] [--only NAME ...]

OTHER is another checkout of the project. Each round runs every case once in both, each in a process of
its own, so that what else the machine does hits both alike. Printed are medians, and ours over theirs.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
GENERATE = """
import dataclasses, json, resource, time
from benchmarks.generate import carried
from omomo_core.body.model import load_body
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.weights.load import load_stages
has = {{field.name for field in dataclasses.fields(GenerationOptions)}}
options = GenerationOptions({samples}, **({{"solve": "shown"}} if "solve" in has else {{}}))
body, stages, motion = load_body(), load_stages("capture"), carried({seconds})
generate(carried(1), body, stages, GenerationOptions(1, steps=2))
wall, processor = time.perf_counter(), time.process_time()
generate(motion, body, stages, options)
print(json.dumps([time.process_time() - processor, time.perf_counter() - wall,
                  resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""
RUN = """
import json, resource, subprocess, sys, tempfile, time
demo = "capture_app/demo_take/"
with tempfile.TemporaryDirectory() as folder:
    wall = time.perf_counter()
    subprocess.run([sys.executable, "-c", "from capture_app.cli.start import main; main()", "run",
                    demo + "session", "--object", demo + "box.obj", "--mount", demo + "mount.json",
                    "-o", folder + "/out", "--no-video"], check=True, capture_output=True)
    wall = time.perf_counter() - wall
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024]))
"""
CASES = {
    "demo, omocap run": RUN,
    "4 s, 1 sample": GENERATE.format(samples=1, seconds=4),
    "4 s, 20 samples": GENERATE.format(samples=20, seconds=4),
    "40 s, 4 samples": GENERATE.format(samples=4, seconds=40),
    "120 s, 4 samples": GENERATE.format(samples=4, seconds=120),
    "10 min, 1 sample": GENERATE.format(samples=1, seconds=600),
    "10 min, 4 samples": GENERATE.format(samples=4, seconds=600),
}
FIGURES = ("processor s", "wall s", "peak MB")


def main() -> None:
    """Run the rounds and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", nargs="*", choices=CASES, default=list(CASES))
    said = parser.parse_args()
    measured: dict[tuple[str, Path], list[list[float]]] = defaultdict(list)
    for n in range(said.rounds):
        for name in said.only:
            for checkout in (HERE, said.other.resolve())[:: 1 if n % 2 else -1]:
                measured[name, checkout].append(once(checkout, CASES[name]))
                print(f"round {n + 1}: {name}: {checkout.name}", file=sys.stderr)
    for name in said.only:
        ours, theirs = (
            [statistics.median(column) for column in zip(*measured[name, checkout], strict=True)]
            for checkout in (HERE, said.other.resolve())
        )
        told = [
            f"{figure} {b:.2f} to {a:.2f} ({a / b:.2f})"
            for figure, a, b in zip(FIGURES, ours, theirs, strict=True)
        ]
        print(f"{name}: {', '.join(told)}")


def once(checkout: Path, code: str) -> list[float]:
    """Return the figures of one run of a case in a checkout."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": str(checkout), "OMP_WAIT_POLICY": "PASSIVE"},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
