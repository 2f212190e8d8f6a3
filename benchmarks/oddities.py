"""How often a made person does what recorded people do not: at both ends of a take, and while holding.

Usage: python -m benchmarks.oddities CLIPS [--samples K] [--seeds N] [--only WORD] [--halves] [--to FILE]

CLIPS is a folder of recorded clips (`omomo_core/learning/evaluation/real_clips.py`). The person that a run
shows is looked at beside the recorded one, who has no fingers. Two columns are printed for each oddity: the
share of clips in which ours has it, and in which people have it; `--halves` prints the halves by turns of the
clips' names. An interrupted run goes on from FILE.

walks at the end     the pelvis goes faster than 0.3 m/s on average in the last half second
holds at rest        a palm is within 5 cm of the object in the last 5 frames, and it has rested before them
bent at first        the trunk leans more than 35 degrees in the first frame
bent while carrying  it leans more than 30 degrees in a third of the frames in which the object is off the
                     floor and the palms are above the knees
elbow up             an elbow is above its shoulder while its palm holds below the shoulder
toes in the floor    a foot's skin is deeper than 2 cm below the floor in some frame
hands in each other  joints of one hand are within 1 cm of those of the other in some frame
hand in the thigh    a finger joint is within 6 cm of the line of a thigh bone in the first frame
"""

import argparse
import json
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.kinematics import full_kinematics
from omomo_core.body.model import BodyModel, load_body
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.geometry.object_features import object_features
from omomo_core.learning.evaluation.real_clips import clip_paths, read_clip
from omomo_core.learning.evaluation.truth import TOUCH, Truth, recorded_person, skin_of
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import joint
from omomo_core.weights.load import load_stages

HALF = round(FPS / 2)
"""Half a second, frames."""
LIFTED = 0.03
"""Metres off the floor from which an object is carried."""
STILL = 0.03
"""Metres a second below which an object rests."""
Joints = Float[np.ndarray, "frames 52 3"]
ODDITIES = (
    *("walks at the end", "holds at rest", "bent at first", "bent while carrying", "elbow up"),
    *("toes in the floor", "hands in each other", "hand in the thigh"),
)


def main() -> None:
    """Look at all clips, and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("clips", type=Path)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--halves", action="store_true")
    parser.add_argument("--to", type=Path)
    said = parser.parse_args()
    file: Path | None = said.to
    rows = [] if file is None or not file.exists() else list(map(json.loads, file.open()))
    done = {(row["seed"], row["clip"]) for row in rows}
    body, stages = load_body(), load_stages("capture")
    for seed in range(said.seeds):
        for path in clip_paths(said.clips):
            if said.only not in path.stem or (seed, path.stem) in done:
                continue
            truth = Truth(read_clip(path, body))
            clip, options = truth.clip, GenerationOptions(said.samples, seed, solve="shown")
            made = generate(clip.motion, clip.body, stages, options)
            ours = oddities(truth, made.motions[made.chosen])
            people = oddities(truth, recorded_person(clip, clip.body))
            row = {"seed": seed, "clip": path.stem, "ours": ours, "people": people}
            rows.append(row)
            print(path.stem, seed, ", ".join(name for name in ODDITIES if ours[name]) or "nothing")
            if file is not None:
                with file.open("a") as lines:
                    lines.write(json.dumps(row) + "\n")
    names = sorted({row["clip"] for row in rows})
    for half in (names[::2], names[1::2]) if said.halves else (names,):
        some = [row for row in rows if row["clip"] in half]
        print(f"\n{len(half)} clips{'':14} ours people")
        for name in ODDITIES:
            ours, people = (np.mean([r[who][name] for r in some]) for who in ("ours", "people"))
            print(f"{name:22} {ours:5.2f} {people:5.2f}")


def oddities(truth: Truth, human: HumanMotion) -> dict[str, bool]:
    """Return what a person for a clip does."""
    body = truth.clip.body
    joints = all_joints(human, body)
    palms = truth.touching.palms(human.joints[:, 22:], TOUCH)
    take = object_features(truth.clip.motion)
    off = take.lowest > LIFTED
    ends_at_rest = (
        not truth.must_hold[-HALF:].any()
        and not (np.linalg.norm(take.velocity[-HALF:], axis=1) > STILL).any()
    )
    carried = off & (joints[:, [20, 21], 2].min(axis=1) > joints[:, [4, 5], 2].max(axis=1))
    bent = leaning(joints)
    last = joints[-HALF:, 0, :2]
    return {
        "walks at the end": bool(np.linalg.norm(np.diff(last, axis=0), axis=1).mean() * FPS > 0.3),
        "holds at rest": bool(ends_at_rest and palms[-5:].any()),
        "bent at first": bool(bent[0] > 35),
        "bent while carrying": bool(carried.any() and (bent[carried] > 30).mean() > 1 / 3),
        "elbow up": _elbow_up(joints, palms),
        "toes in the floor": bool(skin_of(human, body)[..., 2].min() < -0.02),
        "hands in each other": bool(_between_hands(joints).min() < 0.01),
        "hand in the thigh": bool(_to_thighs(joints[0]).min() < 0.06),
    }


def all_joints(human: HumanMotion, body: BodyModel) -> Joints:
    """Return all joints with fingers, world, metres."""
    parts = (torch.from_numpy(a).float() for a in (human.root, human.rotations, human.fingers))
    return full_kinematics(body, *parts)[0].double().numpy()


def leaning(joints: Joints) -> Float[np.ndarray, " frames"]:
    """Return the angle of the trunk, pelvis to neck, to the vertical, degrees."""
    trunk = joints[:, joint("neck")] - joints[:, joint("pelvis")]
    return np.degrees(np.arccos((trunk[:, 2] / np.linalg.norm(trunk, axis=1)).clip(-1, 1)))


def _elbow_up(joints: Joints, palms: np.ndarray) -> bool:
    up = [
        (joints[:, elbow, 2] > joints[:, shoulder, 2] + 0.02)
        & (joints[:, wrist, 2] < joints[:, shoulder, 2])
        & palms[:, side]
        for side, (shoulder, elbow, wrist) in enumerate(((16, 18, 20), (17, 19, 21)))
    ]
    return bool(np.sum(up) > 5)


def _between_hands(joints: Joints) -> Float[np.ndarray, " frames"]:
    left, right = joints[:, 22:37], joints[:, 37:52]
    return np.linalg.norm(left[:, :, None] - right[:, None], axis=-1).min(axis=(1, 2))


def _to_thighs(joints: Float[np.ndarray, "52 3"]) -> Float[np.ndarray, "2 30"]:
    """Distance of each finger joint from the bones of both thighs, metres."""
    hips, knees, fingers = joints[[1, 2], None], joints[[4, 5], None], joints[None, 22:52]
    way = knees - hips
    along = ((fingers - hips) * way).sum(-1, keepdims=True) / (way**2).sum(-1, keepdims=True)
    return np.linalg.norm(fingers - hips - along.clip(0, 1) * way, axis=-1)


if __name__ == "__main__":
    main()
