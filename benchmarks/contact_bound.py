"""What F1 of contact can be reached on clips.

Usage: python -m benchmarks.contact_bound CLIPS

Somebody who touches exactly when the recorded person does, and in every other frame in which the object must
be held, too, beside the no-learning baseline; as a mean over clips, and over all frames together.
"""

import argparse
from pathlib import Path

from omomo_core.body.load import load_body
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.learning.evaluation.average import Row, average
from omomo_core.learning.evaluation.clips import read_clip
from omomo_core.learning.evaluation.metrics import contact_scores
from omomo_core.learning.evaluation.protocols import unlearned
from omomo_core.learning.evaluation.truth import Truth


def rows(path: Path) -> dict[str, Row]:
    """Of one clip: the recorded person, somebody who also holds what must be held, the baseline."""
    clip = read_clip(path, load_body())
    truth = Truth(clip)
    held = truth.held[0]
    must_hold = ObjectModel(clip.motion.mesh, 1.0).clip(clip.motion.T_world_object).must_hold
    holding = held | (must_hold & ~held.any(axis=1))[:, None]
    return {
        "recorded": contact_scores(held, held),
        "holds what must be held": contact_scores(holding, held),
        "baseline": unlearned(truth, 20, 0)[0],
    }


def main() -> None:
    """Print a line for each clip, and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    found: list[dict[str, Row]] = []
    for path in sorted(parser.parse_args().clips.glob("*.npz")):
        found.append(rows(path))
        scores = (f"{name} {row['contact_f1']:.2f}" for name, row in found[-1].items())
        print(f"{path.stem}: {', '.join(scores)}")
    for name in found[0]:
        mean = average([clip[name] for clip in found])
        both = f"{mean['contact_f1']:.3f}, all frames {mean['contact_f1_all_frames']:.3f}"
        print(f"{name}: mean over clips {both}")


if __name__ == "__main__":
    main()
