"""Which hand holds when, on synthetic clips whose contacts are known: our segments and the paper's rule.

Usage: python benchmarks/contacts.py DATASET [clips] [samples]

DATASET is a folder of `omocap data synthesise` with a seed that the weights have not seen. F1 is over the
frames of each hand; onsets and releases are compared with the nearest true ones of the same hand. How an
object moves hardly tells how many hands moved it, and never whether the left or the right: so F1 is also
given of the clips in which both hands hold at some time, of those with one hand, and of "some hand holds".
"""

import sys
from pathlib import Path

import numpy as np

from omomo_core.body.model import load_body
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.learning.recordings.clips import load_clips
from omomo_core.learning.recordings.dataset import shards
from omomo_core.weights.load import load_stages

FAR = 30
"""Frames beyond which an onset has no counterpart."""


def timing(found: np.ndarray, true: np.ndarray, step: int) -> list[int]:
    """Frames between each true change by `step` and the nearest found one, at most FAR."""
    # Clips that begin or end in contact have no onset or release there.
    real, made = (np.flatnonzero(np.diff(x.astype(int)) == step) for x in (true, found))
    return [int(min([FAR, *abs(made - frame)])) for frame in real]


def f1(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Over the frames of all pairs of found and true."""
    hits = sum(int((found & true).sum()) for found, true in pairs)
    return 2 * hits / max(1, sum(int(found.sum() + true.sum()) for found, true in pairs))


def told(pairs: list[tuple[np.ndarray, np.ndarray]], misses: np.ndarray) -> str:
    """What one rule comes to; found and true are frames by hands."""
    onsets, releases = (
        np.array([n for a, b in pairs for h in (0, 1) for n in timing(a[:, h], b[:, h], step)])
        for step in (1, -1)
    )
    both = [pair for pair in pairs if pair[1].any(axis=0).all()]
    one = [pair for pair in pairs if not pair[1].any(axis=0).all()]
    return (
        f"per-hand F1 {f1(pairs):.3f} (both hands, {len(both)} clips: {f1(both):.3f}; one, {len(one)}: "
        f"{f1(one):.3f}), some hand {f1([(a.any(1), b.any(1)) for a, b in pairs]):.3f}; median onset "
        f"{np.median(onsets):.0f} ({np.mean(onsets <= 4):.0%} within 4), release {np.median(releases):.0f} "
        f"({np.mean(releases <= 4):.0%}) frames; palms off by over 1 cm in "
        f"{np.mean(misses > 0.01):.1%} of contact frames"
    )


def main() -> None:
    folder, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 40
    samples = int(sys.argv[3]) if len(sys.argv) > 3 else 4
    body, stages = load_body(), load_stages()
    clips = [clip for shard in shards(folder) for clip in load_clips(shard)][:count]
    for rule in ("segments", "paper"):
        pairs: list[tuple[np.ndarray, np.ndarray]] = []
        misses: list[np.ndarray] = []
        for clip in clips:
            assert clip.object_motion is not None
            options = GenerationOptions(samples, contact=rule)  # type: ignore[arg-type]
            made = generate(clip.object_motion, body, stages, options, lambda name, done: None)
            person = made.people[made.chosen]
            found = person.human.hand_contact > 0.99
            misses.append(person.miss[found])
            pairs.append((found, clip.hand_contact > 0.5))
        print(f"{rule:9} {told(pairs, np.concatenate(misses))}; {len(clips)} clips", flush=True)


if __name__ == "__main__":
    main()
