"""Which hand holds when, on synthetic clips whose contacts are known: our segments and the paper's rule.

Usage: python benchmarks/contacts.py DATASET [clips] [samples]

DATASET is a folder of `omocap data synthesise` with a seed that the weights have not seen. F1 is over the
frames of each hand; onsets and releases are compared with the nearest true ones of the same hand.
"""

import sys
from pathlib import Path

import numpy as np

from omomo_core.body.load import load_body
from omomo_core.data.clips import load_clips
from omomo_core.data.dataset import shards
from omomo_core.generation.generator import generate
from omomo_core.generation.result import GenerationOptions
from omomo_core.weights.load import load_stages

FAR = 30
"""Frames beyond which an onset has no counterpart."""


def timing(found: np.ndarray, true: np.ndarray, step: int) -> list[int]:
    """Frames between each true change by `step` and the nearest found one, at most FAR."""
    # Clips that begin or end in contact have no onset or release there.
    real, made = (np.flatnonzero(np.diff(x.astype(int)) == step) for x in (true, found))
    return [int(min([FAR, *abs(made - frame)])) for frame in real]


def main() -> None:
    folder, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 40
    samples = int(sys.argv[3]) if len(sys.argv) > 3 else 4
    body, stages = load_body(), load_stages()
    clips = [clip for shard in shards(folder) for clip in load_clips(shard)][:count]
    for rule in ("segments", "paper"):
        hits = total = 0
        onsets: list[int] = []
        releases: list[int] = []
        misses: list[np.ndarray] = []
        for clip in clips:
            assert clip.object_motion is not None
            options = GenerationOptions(samples, contact=rule)  # type: ignore[arg-type]
            made = generate(clip.object_motion, body, stages, options, lambda name, done: None)
            person = made.people[made.chosen]
            found = person.human.hand_contact > 0.99
            misses.append(person.miss[found])
            true = clip.hand_contact > 0.5
            hits += (found & true).sum()
            total += found.sum() + true.sum()
            for hand in range(2):
                onsets += timing(found[:, hand], true[:, hand], 1)
                releases += timing(found[:, hand], true[:, hand], -1)
        print(
            f"{rule:9} per-hand F1 {2 * hits / total:.3f}  median onset {np.median(onsets):.0f} "
            f"({np.mean(np.array(onsets) <= 4):.0%} within 4), release {np.median(releases):.0f} "
            f"({np.mean(np.array(releases) <= 4):.0%}) frames; palms off by over 1 cm in "
            f"{np.mean(np.concatenate(misses) > 0.01):.1%} of contact frames; {len(clips)} clips"
        )


if __name__ == "__main__":
    main()
