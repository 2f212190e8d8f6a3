"""Is the sample that is shown as good when only it is solved, as the best of all solved ones?

Usage: python -m benchmarks.shown_sample CLIPS [--samples K] [--seeds N] [--steps S] [--to FILE]

CLIPS is a folder of recorded clips (`omomo_core/learning/evaluation/real_clips.py`). People of each clip are
sampled, and all are solved. Printed are the errors of the sample that is chosen among all solved ones, those
of the one that is chosen as sampled and solved first, and their paired differences with 95 % intervals over
clips; the share of results that leap, and how many bodies were solved; and what share of all samples leaps.
"""

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from omomo_core.body.model import load_body
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import sample_take
from omomo_core.generation.sampled_take import SampledTake
from omomo_core.generation.selection.ranking import (
    choose,
    is_good,
    order_as_sampled,
    score,
)
from omomo_core.learning.evaluation.metrics import joint_errors, paired_bootstrap
from omomo_core.learning.evaluation.real_clips import RealClip, clip_paths, read_clip
from omomo_core.weights.load import load_stages

ERRORS = ("hand_jpe_cm", "mpjpe_cm", "t_root_cm")
Row = dict[str, float]


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--to", type=Path)
    said = parser.parse_args()
    body, stages = load_body(), load_stages("capture")
    rows: list[Row] = []
    for path in clip_paths(said.clips):
        clip = read_clip(path, body)
        for seed in range(said.seeds):
            options = GenerationOptions(said.samples, seed, steps=said.steps)
            take = sample_take(clip.motion, clip.body, stages, options)
            rows.append({"clip": len(rows) // said.seeds, **compared(take, clip)})
            print(path.stem, seed, json.dumps(rows[-1]), flush=True)
    if said.to is not None:
        said.to.write_text(json.dumps(rows))
    for line in summary(rows):
        print(line)


def compared(take: SampledTake, clip: RealClip) -> Row:
    """Return errors and faults of both choices."""
    must = take.must_hold
    people = [take.solve(k) for k in range(take.samples)]
    scores = [score(person, must) for person in people]
    best = choose([person.human for person in people], scores)
    solved, shown = list[int](), best
    order, _ = order_as_sampled([take.as_sampled(k) for k in range(take.samples)], must)
    for k in order:
        solved.append(k)
        if is_good(scores[k], len(must)):
            shown = k
            break
    row: Row = {"solved": len(solved), "leap": float(np.mean([s["leaping"] > 0 for s in scores]))}
    for name, k in (("all", best), ("shown", shown)):
        errors: Mapping[str, float] = joint_errors(people[k].human.joints, clip.joints)
        row |= {f"{name} {key}": float(errors[key]) for key in ERRORS}
        row |= {f"{name} leaps": float(scores[k]["leaping"] > 0)}
        row |= {f"{name} faults": float(scores[k]["total"])}
    return row


def summary(rows: list[Row]) -> Iterator[str]:
    """Yield what is printed of all."""
    clips = [str(row["clip"]) for row in rows]
    solved = np.mean([row["solved"] for row in rows])
    leap = np.mean([row["leap"] for row in rows])
    yield f"{len(set(clips))} clips, {len(rows)} takes, {solved:.2f} bodies solved of each"
    yield f"{leap:.0%} of all samples leap"
    for key in (*ERRORS, "faults", "leaps"):
        new, old = ([row[f"{name} {key}"] for row in rows] for name in ("shown", "all"))
        difference = paired_bootstrap(new, old, clips)
        yield (
            f"{key:14} all {np.mean(old):6.2f}  shown {np.mean(new):6.2f}  difference "
            f"{difference.mean:+.2f} ({difference.low:+.2f} to {difference.high:+.2f})"
        )


if __name__ == "__main__":
    main()
