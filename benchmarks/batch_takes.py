"""A batch of many takes: seconds a take, and memory, by this checkout and by another one.

Usage: python -m benchmarks.batch_takes [--takes 200] [--workers 1] [--samples 4] [--other CHECKOUT]

The takes are drawn from a fixed seed: eight objects of different kinds, each lifted, carried along a bend and
put down, most of them for 4 to 15 seconds and one in ten for a minute or longer. They are files of object
poses in one table, as `omocap batch` takes it. Printed are the processor seconds and the wall seconds a take,
and the peak of memory of one process, of each checkout, one after the other; then ours over theirs.
"""

import argparse
import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.hands import MORE_PROPS, PROPS, lifted, prop

HERE = Path(__file__).resolve().parents[1]
OBJECTS = (*PROPS, *MORE_PROPS)[:8]
LONG = 10
"""One take in so many is long."""
RUN = """
import resource, subprocess, sys, time
start = time.perf_counter()
command = "from capture_app.cli.start import main; main()"
subprocess.run([sys.executable, "-c", command, *sys.argv[1:]], check=True, stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, time.perf_counter() - start, used.ru_maxrss / 1024)
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--takes", type=int, default=200)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--other", type=Path)
    said = parser.parse_args()
    checkouts = [HERE] if said.other is None else [HERE, said.other.resolve()]
    print(f"{'checkout':24}{'processor s':>12}{'wall s':>9}{'peak MB':>9}   a take of {said.takes}")
    measured: list[list[float]] = []
    with tempfile.TemporaryDirectory() as folder:
        table = draw(Path(folder), said.takes)
        for checkout in checkouts:
            figures = measure(checkout, table, said.workers, said.samples)
            a_take = [figures[0] / said.takes, figures[1] / said.takes, figures[2]]
            measured.append(a_take)
            print(
                f"{checkout.name:24}{a_take[0]:12.2f}{a_take[1]:9.2f}{a_take[2]:9.0f}", flush=True
            )
    if len(measured) == 2:
        ratios = [ours / theirs for ours, theirs in zip(*measured, strict=True)]
        print(f"{'ours over theirs':24}{ratios[0]:12.2f}{ratios[1]:9.2f}{ratios[2]:9.2f}")


def draw(folder: Path, takes: int) -> Path:
    """Write the takes and their objects; return the table that names them."""
    rng = np.random.default_rng(0)
    for name in OBJECTS:
        mesh = lifted(prop(name), 1.0).mesh
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / f"{name}.obj")
    rows: list[tuple[str, str, str]] = []
    for n in range(takes):
        name = OBJECTS[int(rng.integers(len(OBJECTS)))]
        seconds = rng.uniform(60, 120) if n % LONG == LONG - 1 else rng.uniform(4, 15)
        motion = lifted(prop(name), float(seconds))
        file = folder / f"take_{n:03}.npz"
        np.savez_compressed(file, T_world_object=motion.T_world_object, fps=30.0)
        rows.append((file.name, f"{name}.obj", file.stem))
    table = folder / "takes.csv"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("session", "object", "name"))
        writer.writerows(rows)
    return table


def measure(checkout: Path, table: Path, workers: int, samples: int) -> list[float]:
    """Return processor seconds, wall seconds and peak megabytes of a batch by a checkout."""
    with tempfile.TemporaryDirectory() as folder:
        asked = ["batch", table, "-o", f"{folder}/out", "--workers", workers, "--samples", samples]
        done = subprocess.run(
            [sys.executable, "-c", RUN, *map(str, asked), "--no-video"],
            cwd=checkout,
            env={**os.environ, "PYTHONPATH": str(checkout), "OMP_WAIT_POLICY": "PASSIVE"},
            check=True,
            capture_output=True,
            text=True,
        )
    return [float(word) for word in done.stdout.split()]


if __name__ == "__main__":
    main()
