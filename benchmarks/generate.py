"""How fast a person is generated: the published algorithm and ours, part by part, and long takes.

Usage: python -m benchmarks.generate [--quick] [--device cpu|cuda|mps]

Every case runs in a process of its own, one after the other, on the same object and the same cores. The
published algorithm is our `paper` configuration with 1,000 + 1,000 steps; its networks are untrained,
which costs the same. --quick lets it take 20 of those steps and multiplies. --device says where the
networks run; "rest" of the parts, "solve" and "contact" run on the CPU whatever it is. In takes of
several chunks the next chunk is sampled while one is solved, as in `omocap run`: their parts overlap in time,
and only the sum of them is exact.
"""

import json
import platform
import resource
import subprocess
import sys
import time
from argparse import ArgumentParser
from dataclasses import replace

import numpy as np
import torch

from omomo_core.body.model import load_body
from omomo_core.compute import Device, find_device
from omomo_core.generation.conditioning import UNCONDITIONED
from omomo_core.generation.generation_config import RECORDED
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.stream import stream
from omomo_core.learning.synthesis.props import make_prop
from omomo_core.motion import FPS, ObjectMotion
from omomo_core.stages import body_paper
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.stage import Stage, Stages
from omomo_core.weights.load import load_stages

QUICK_STEPS = 20
CASES = (
    ("published, 1 sample", {"paper": True, "samples": 1, "seconds": 4}),
    ("published, 20 samples", {"paper": True, "samples": 20, "seconds": 4}),
    ("ours, 1 sample", {"samples": 1, "seconds": 4}),
    ("ours, 20 samples", {"samples": 20, "seconds": 4}),
    ("ours, 100 samples", {"samples": 100, "seconds": 4}),
    ("ours, 40 s", {"samples": 1, "seconds": 40}),
    ("ours, 10 min", {"samples": 1, "seconds": 600}),
    ("ours, 10 min, 4 samples", {"samples": 4, "seconds": 600}),
)


def carried(seconds: float) -> ObjectMotion:
    """A chair-like scan that is lifted, carried to and fro, and put down, again and again."""
    rng = np.random.default_rng(4)
    prop = make_prop(rng, "lift")
    mesh = prop.mesh(rng)
    frames = round(seconds * FPS)
    t = np.arange(frames) / FPS
    swing = 0.5 - 0.5 * np.cos(2 * np.pi * t / 8)
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 0, 3] = 1.5 * swing
    T[:, 2, 3] = -mesh.vertices[:, 2].min() + 0.5 * np.clip(2 * np.sin(2 * np.pi * t / 4), 0, 1)
    return ObjectMotion(mesh, T, np.ones(frames, bool))


def measure(
    paper: bool = False,
    samples: int = 1,
    seconds: int = 4,
    quick: bool = False,
    device: Device = "cpu",
) -> dict:
    """Seconds by part, and the peak of memory, of one case."""
    body, motion = load_body(), carried(seconds)
    stages, options = load_stages("capture", device=device), GenerationOptions(samples)
    # Loading libraries is not counted.
    generate(carried(1), body, stages, GenerationOptions(1, steps=2), lambda name, done: None)
    if paper:
        hands, bodies = (Stage(config).eval() for config in (hand_paper.CONFIG, body_paper.CONFIG))
        for stage in (hands, bodies):
            stage.denoiser.to(find_device(device))
        stages = Stages(hands, bodies, body.height)
        sampler = "ddim" if quick else "ddpm"
        options = GenerationOptions(samples, 0, "paper", sampler, QUICK_STEPS if quick else 1000)
        if quick:
            # Nor are the first steps, which are slower and would be multiplied.
            first = replace(options, steps=3)
            generate(motion, body, stages, first, lambda name, done: None)
    parts: dict[str, float] = {}
    last = time.perf_counter()

    def clock(name: str, done: float) -> None:
        nonlocal last
        now = time.perf_counter()
        parts[name] = parts.get(name, 0.0) + now - last
        last = now

    if paper:
        generate(motion, body, stages, options, clock)
    else:
        poses = iter(motion.T_world_object)
        made = stream(
            motion.mesh, poses, body, stages, options, clock, UNCONDITIONED,
            chunk_sizes=RECORDED, complete=True,
        )  # fmt: skip
        assert sum(len(block.must_hold) for block in made) == len(motion.valid)
    clock("rest", 1.0)
    if quick and paper:
        parts = {
            k: v * (1000 / QUICK_STEPS if k in ("hands", "body") else 1) for k, v in parts.items()
        }
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"parts": parts, "megabytes": megabytes, "faces": len(motion.mesh.faces)}


def _name(device: Device) -> str:
    if find_device(device).type == "cuda":
        return torch.cuda.get_device_name()
    return f"{device} ({platform.processor() or platform.machine()})"


def main() -> None:
    parser = ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--device", choices=("cpu", "cuda", "mps"), default="cpu")
    parser.add_argument("--only", default="", help="cases whose names have this in them")
    parser.add_argument("--case", type=json.loads, help="measure one case in this process")
    given = parser.parse_args()
    if given.case:
        print(json.dumps(measure(**given.case)))
        return
    chosen = [(name, case) for name, case in CASES if given.only in name]
    if not chosen:
        parser.error(f"No case has {given.only!r} in its name.")
    faces = 0
    print(f"Networks on {_name(given.device)}")
    print(f"{'':24}{'seconds':>9}{'s per s':>9}{'MB':>7}   parts")
    for name, case in chosen:
        asked = json.dumps({**case, "quick": given.quick, "device": given.device})
        run = [sys.executable, __file__, "--case", asked]
        made = json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout)
        total, parts = sum(made["parts"].values()), made["parts"]
        told = ", ".join(f"{k} {v:.2f}" for k, v in parts.items() if v > 0.005)
        each, faces = total / float(case["seconds"]), made["faces"]
        print(f"{name:24}{total:9.2f}{each:9.3f}{made['megabytes']:7.0f}   {told}", flush=True)
    print(f"The object has {faces} faces.")


if __name__ == "__main__":
    main()
