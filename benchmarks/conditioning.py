"""What it helps to say of the person: the errors of the one result that a run shows.

Usage: python -m benchmarks.conditioning CLIPS [--samples K] [--seeds N] [--say WORDS ...] [--steps S]
           [--to FILE] [--other FILE]

CLIPS is a folder of recorded clips (`omomo_core/learning/evaluation/real_clips.py`). WORDS are what is said
of the recorded person, such as stood, stood+ends, side, hands, stood+side+hands; "nothing" says nothing.
People are sampled and only those are solved that a run solves. A line is printed for each, the mean over
clips and seeds, then for each class of objects: palms (HandJPE), MPJPE and T_root in centimetres, the median
T_root, the share over 60 cm, F1 within 8 cm, the shares of clips with the right number of hands and the right
side, steps backwards beside people's, and how far the head is from people's in the first frame. An
interrupted run goes on from FILE. With the FILE of another version or of other steps, paired differences
with 95 % intervals over clips follow.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from omomo_core.body.model import load_body
from omomo_core.contact.static_stability import middle_of_hold
from omomo_core.generation.conditioning import Conditioning, PlaceInTime
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.learning.evaluation.metrics import paired_bootstrap, walking_measures
from omomo_core.learning.evaluation.real_clips import clip_paths, read_clip
from omomo_core.learning.evaluation.truth import Truth
from omomo_core.weights.load import load_stages

SAID = ("nothing", "stood", "stood+ends", "side", "stood+side", "hands", "stood+ends+side+hands")
FIGURES = (
    *("hand_jpe_cm", "mpjpe_cm", "t_root_cm", "near_contact_f1", "hands_right_share"),
    *("side_right_share", "backwards_share", "first_head_cm"),
)

COMPARED = (*FIGURES[:3], "near_contact_f1", "faults", "leaps")
Row = dict[str, float | str]


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--say", nargs="*", default=SAID)
    parser.add_argument("--steps", type=int, default=GenerationOptions.steps)
    parser.add_argument("--to", type=Path)
    parser.add_argument("--other", type=Path)
    said = parser.parse_args()
    file: Path | None = said.to
    done = {} if file is None or not file.exists() else kept_rows(file)
    body, stages = load_body(), load_stages("capture")
    for seed in range(said.seeds):
        for path in clip_paths(said.clips):
            wanted = [say for say in said.say if (say, seed, path.stem) not in done]
            truth = Truth(read_clip(path, body)) if wanted else None
            for say in wanted:
                assert truth is not None
                clip = truth.clip
                options = GenerationOptions(said.samples, seed, steps=said.steps, solve="shown")
                known = conditioning(truth, say)
                made = generate(clip.motion, clip.body, stages, options, conditioning=known)
                row = truth.of_joints(made.motions[made.chosen])
                row = {key: row[key] for key in FIGURES}
                faults = made.scores[made.chosen]
                row |= {"faults": faults["total"], "leaps": float(faults["leaping"] > 0)}
                people = walking_measures(clip.joints)
                row |= {f"real_{key}": value for key, value in people.items()}
                kept = {"say": say, "seed": seed, "clip": path.stem, **row}
                done[say, seed, path.stem] = kept
                if file is not None:
                    with file.open("a") as lines:
                        lines.write(json.dumps(kept) + "\n")
    for line in summary(list(done.values())):
        print(line)
    for line in () if said.other is None else differences(done, kept_rows(said.other)):
        print(line)


def kept_rows(file: Path) -> dict[tuple[str, int, str], Row]:
    """Return the rows of a file by what is said, seed and clip."""
    rows = map(json.loads, file.open())
    return {(row["say"], row["seed"], row["clip"]): row for row in rows}


def differences(
    ours: dict[tuple[str, int, str], Row], other: dict[tuple[str, int, str], Row]
) -> Iterator[str]:
    """Yield how much greater the figures are than those of another file."""
    for say in dict.fromkeys(say for say, *_ in ours):
        both = [key for key in ours if key[0] == say and key in other]
        for figure in COMPARED:
            mine, others = ([float(rows[key][figure]) for key in both] for rows in (ours, other))
            apart = paired_bootstrap(mine, others, [clip for *_, clip in both])
            yield (
                f"{say:24}{figure:16} {np.mean(others):7.2f} to {np.mean(mine):7.2f}, difference "
                f"{apart.mean:+.2f} ({apart.low:+.2f} to {apart.high:+.2f})"
            )


def conditioning(truth: Truth, say: str) -> Conditioning:
    """Return what is said of the recorded person."""
    root, middle = truth.clip.root[:, :2], middle_of_hold(truth.must_hold)
    return Conditioning(
        start_position=root[0] if "stood" in say else None,
        end_position=root[-1] if "ends" in say else None,
        side=PlaceInTime(root[middle], middle) if "side" in say else None,
        held_with=truth.hands if "hands" in say else None,
    )


def summary(rows: list[Row]) -> Iterator[str]:
    """Yield what is printed of all."""
    yield f"{'said':24}{'':12} palms MPJPE T_root median >60 F1@8 hands side  back (people) head"
    objects = dict.fromkeys(str(row["clip"]).split("_")[1] for row in rows)
    for say in dict.fromkeys(row["say"] for row in rows):
        for name in ("all", *objects):
            every = name == "all"
            some = [r for r in rows if r["say"] == say and (every or name in str(r["clip"]))]
            mean = {key: np.mean([float(row[key]) for row in some]) for key in FIGURES}
            back = np.mean([float(row["real_backwards_share"]) for row in some])
            way = np.array([float(row["t_root_cm"]) for row in some])
            head = [abs(float(r["first_head_cm"]) - float(r["real_first_head_cm"])) for r in some]
            yield (
                f"{say:24}{name:12} {mean['hand_jpe_cm']:5.1f} {mean['mpjpe_cm']:5.1f} {way.mean():6.1f} "
                f"{np.median(way):6.1f} {(way > 60).mean():.2f} {mean['near_contact_f1']:.2f} "
                f"{mean['hands_right_share']:5.2f} {mean['side_right_share']:.2f} "
                f"{mean['backwards_share']:5.2f} ({back:.2f}) {np.mean(head):6.1f}"
            )


if __name__ == "__main__":
    main()
