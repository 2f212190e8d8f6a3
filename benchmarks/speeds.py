"""How fast recorded people are who do what a mover of objects does: where `SpeedLimits` come from.

Usage: python -m benchmarks.speeds MOCAP

MOCAP is a folder of motion files that `omocap data build` reads (the CMU conversion with the INDEX.md that
says what each trial is, O3DE, HDM05), and takes of people with a ball. Left out is what the name or the
description calls sport, dance, a jump, a throw and the like, and what is faster than a walk: frames within a
second of any in which the pelvis goes, over a second, faster than people walk. Speeds are measured at 30 fps.
"""

import argparse
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError
from omomo_core.generation.selection.selection_config import HUMAN_LIMITS
from omomo_core.generation.selection.speed_limits import TURNING, measure_speeds
from omomo_core.learning.recordings.mocap import (
    SourceMotion,
    checked_motion,
    read_bvh_motion,
    read_mocap_npz,
)
from omomo_core.learning.recordings.recordings import motion_files
from omomo_core.learning.recordings.source_skeletons import SourceSkeleton
from omomo_core.skeleton import BODY_JOINTS, joint

PERCENTILE = 99.9
WALK = 2.1
"""m/s over a second, above which people run."""
WILD = re.compile(
    r"run|jog|jump|leap|hop|skip|sport|basketball|soccer|football|kick|punch|strike|box|sword|danc|ballet"
    r"|arabesque|pirouette|jete|glissade|rond de|coupe|fouette|attitude|playground|acrobat|cartwheel|throw"
    r"|dribbl|hit|animal|dodge|spin|flip|march|stretch|shot|layup|rebound|catch|pass_|rotateArms|elbowToKnee"
    r"|Accel|OutofRange|Roam|Mixed|legturn|lleg|turnhook|lhand|turn__|back__|helicopter|slip|fall",
    re.IGNORECASE,
)
_BALL_JOINTS = {
    "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "foot": "Toe",
    "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "palm": "Middle1",
}  # fmt: skip
BALL = SourceSkeleton(
    name="ball",
    rest_axes=None,
    points={
        f"{side}_{ours}": f"{side[0].upper()}_{theirs}"
        for side in ("left", "right")
        for ours, theirs in _BALL_JOINTS.items()
    },
    drivers={
        ours: (theirs, theirs, 0.0)
        for ours, theirs in (("pelvis", "Pelvis"), ("spine3", "Chest"), ("head", "Head"))
    },
)
"""Of the takes with a ball, which are no motion that `omocap data build` reads."""


def recordings(folder: Path) -> Iterator[SourceMotion]:
    """The calm ones."""
    trials = [p.read_text(errors="replace") for p in folder.rglob("INDEX.md")]
    about = dict(re.findall(r"^(\d+_\d+)\s+(.+)$", "\n".join(trials), re.MULTILINE))
    for path in motion_files(folder):
        if WILD.search(about.get(path.stem, path.stem)):
            continue
        try:
            yield read_bvh_motion(path) if path.suffix == ".bvh" else read_npz(path)
        except InputError as problem:
            print(f"{path.name} is left out: {problem.what}")


def read_npz(path: Path) -> SourceMotion:
    """A recording of joints, or one with a ball."""
    with np.load(path) as data:
        names = tuple(str(n) for n in data["joint_names"])
        if not BALL.joint_names <= set(names):
            return read_mocap_npz(path)
        R = Rotation.from_quat(data["joint_rot_global_xyzw"].reshape(-1, 4)).as_matrix()
        joints = np.asarray(data["joints"], float)
        return checked_motion(
            path, names, joints, R.reshape(*joints.shape[:2], 3, 3), float(data["fps"]),
            str(data["up"]), str(data["licence"]), BALL,
        )  # fmt: skip


def as_ours(motion: SourceMotion) -> tuple[np.ndarray, np.ndarray]:
    """Our 24 joints, NaN where the skeleton has none there, and the turns of pelvis and chest."""
    joints = np.full((len(motion.positions), 24, 3), np.nan)
    for k, name in enumerate((*BODY_JOINTS, "left_palm", "right_palm")):
        point = motion.point(name)
        if point is not None:
            joints[:, k] = point
    joints[:, 0] = joints[:, (joint("left_hip"), joint("right_hip"))].mean(axis=1)
    drivers = motion.skeleton.drivers
    joints[:, joint("head")] = motion.position(drivers["head"][0])
    turning = [motion.rotation(drivers[BODY_JOINTS[k]][0]) for k in TURNING]
    return joints, np.stack(turning, axis=1)


def walking(pelvis: np.ndarray) -> np.ndarray:
    """Steps that are not within a second of a run."""
    running = uniform_filter1d(pelvis, 30, mode="nearest") > WALK
    return ~maximum_filter1d(running, 61, mode="nearest")


def main() -> None:
    """Print percentiles of every quantity, and the limit taken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mocap", type=Path)
    rows: dict[str, list[np.ndarray]] = {name: [] for name in asdict(HUMAN_LIMITS)}
    clips = frames = 0
    for motion in recordings(parser.parse_args().mocap):
        speeds = measure_speeds(*as_ours(motion))
        kept = walking(speeds["pelvis"][:, 0])
        clips, frames = clips + bool(kept.any()), frames + int(kept.sum())
        for name, values in speeds.items():
            rows[name].append(values[kept].ravel())
    print(f"{clips} recordings, {frames / 1800:.1f} min")
    ranks = (50, 95, 99, PERCENTILE, 99.99, 100)
    print(f"{'':12}" + "".join(f"{rank:>9g}" for rank in ranks) + "    limit")
    for name, parts in rows.items():
        known = np.concatenate(parts)
        found = np.percentile(known[np.isfinite(known)], ranks)
        print(
            f"{name:12}"
            + "".join(f"{x:9.2f}" for x in found)
            + f"{asdict(HUMAN_LIMITS)[name]:9.1f}"
        )


if __name__ == "__main__":
    main()
