"""By how much the pelvis and the back tilt for each degree of the chest, in recorded people.

Usage: python -m benchmarks.pelvis DATA.npz

DATA is what `omocap data build` has made of recordings. Least squares over frames in which the chest is
tilted by 20 to 100 degrees.
"""

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np
import torch

from omomo_core.generation.decoding import pitch
from omomo_core.learning.recordings.clips import load_clips
from omomo_core.skeleton import joint

BENT = np.radians([20.0, 100.0])
PARTS = ("pelvis", "spine1", "spine2")


def bent(rotations: torch.Tensor) -> np.ndarray:
    """Pitches of PARTS and of the chest in the frames in which it is bent."""
    columns = [pitch(rotations, joint(part)) for part in (*PARTS, "spine3")]
    found = torch.stack(columns, dim=1).numpy()
    return found[(found[:, 3] > BENT[0]) & (found[:, 3] < BENT[1])]


def main() -> None:
    """Print a line for each library, and the mean over them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    by_source: dict[str, list[np.ndarray]] = defaultdict(list)
    for clip in load_clips(parser.parse_args().data):
        by_source[clip.source].append(bent(torch.from_numpy(clip.rotations).double()))
    slopes: list[np.ndarray] = []
    for source, rows in by_source.items():
        found = np.concatenate(rows)
        slopes.append((found[:, :3] * found[:, 3:]).sum(axis=0) / (found[:, 3] ** 2).sum())
        print(source, len(found), dict(zip(PARTS, slopes[-1].round(2).tolist(), strict=True)))
    print("mean", dict(zip(PARTS, np.mean(slopes, axis=0).round(2).tolist(), strict=True)))


if __name__ == "__main__":
    main()
