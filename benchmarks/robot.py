"""How near a humanoid keeps to a person's motion: palms, ankles, limits, time for a frame.

Usage: python -m benchmarks.robot ROBOT [--results DIR ...] [--clips DIR]

ROBOT is an MJCF or URDF file of a robot whose bodies are known. Results are folders that `omocap run` made;
clips are recorded people (docs/evaluation.md), whose hands hold where a palm is near the surface and hardly
moves against it, and whose feet stand where soles are low and slow.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_closing, binary_opening

from capture_app.exports.resample import Sampled
from capture_app.result import body_of, load_result
from capture_app.robots.robot_model import load_robot
from capture_app.robots.robot_solver import RobotMotion, solve_robot
from capture_app.robots.robot_targets import robot_targets
from omomo_core.body.model import BodyModel, load_body
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.evaluation.real_clips import RealClip, clip_paths, read_clip
from omomo_core.learning.recordings.grounding import foot_contacts, sole_points
from omomo_core.motion import FPS, HumanMotion

HEAD = (
    "take frames palm_median_mm palm_95th_mm palm_most_mm ankle_95th_mm ankle_99th_mm ankle_most_mm "
    "fastest_rad_s beyond_range_rad nearest_mm ms_a_frame"
)
REACH, SLIDING = 0.06, 0.15
"""Metres from palm joint to surface, and metres a second along it, within which a recorded hand holds."""


def recorded(clip: RealClip) -> Sampled:
    """The motion of a clip with contacts by distance and speed."""
    T, palms = clip.motion.T_world_object, clip.joints[:, 22:]
    local = to_local(T, palms)
    surface = sample_surface(clip.motion.mesh)
    away = surface.tree.query(local.reshape(-1, 3))[0].reshape(-1, 2)
    speed = np.linalg.norm(np.gradient(local, axis=0), axis=2) * FPS
    window = np.ones((7, 1), bool)
    held = binary_opening(binary_closing((away < REACH) & (speed < SLIDING), window), window)
    feet = foot_contacts(sole_points(clip.body, clip.root, clip.rotations))
    human = HumanMotion(
        root=clip.root.astype(np.float32),
        rotations=clip.rotations.astype(np.float32),
        fingers=np.tile(np.eye(3, dtype=np.float32), (len(clip.root), 30, 1, 1)),
        joints=clip.joints.astype(np.float32),
        hand_contact=held.astype(np.float32),
        foot_contact=feet.astype(np.float32),
    )
    return Sampled(human, clip.motion, FPS)


def takes(results: list[Path], clips: Path | None) -> Iterator[tuple[str, Sampled, BodyModel]]:
    """Every sample that is solved of each result, and every clip."""
    for folder in results:
        result = load_result(folder)
        for k, person in enumerate(result.people):
            if k not in result.unsolved:
                name = f"{folder.name}#{k + 1}"
                yield name, Sampled(person.human, result.object_motion, FPS), body_of(result)
    for path in [] if clips is None else clip_paths(clips):
        clip = read_clip(path, load_body())
        yield clip.name, recorded(clip), clip.body


def row(motion: RobotMotion, seconds: float) -> list[float]:
    """The figures of HEAD after the frames."""
    miss, slid = 1e3 * motion.miss[motion.targets.held], 1e3 * motion.planted_speed
    model, joints = motion.robot.model, motion.qpos[:, 7:]
    low, high = model.jnt_range[1:].T
    palms = np.percentile(miss, [50, 95, 100]) if len(miss) else np.full(3, np.nan)
    ankles = np.percentile(slid, [95, 99, 100]) if len(slid) else np.full(3, np.nan)
    beyond = max(0.0, float(np.maximum(low - joints, joints - high).max()))
    apart, cost = 1e3 * motion.apart.min(), 1e3 * seconds / len(joints)
    return [*palms, *ankles, motion.joint_speed, beyond, apart, cost]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", type=Path)
    parser.add_argument("--results", type=Path, nargs="*", default=[])
    parser.add_argument("--clips", type=Path)
    given = parser.parse_args()
    robot, misses, slides = load_robot(given.robot), [], []
    print(HEAD)
    for name, sampled, body in takes(given.results, given.clips):
        start = time.process_time()
        motion = solve_robot(robot, robot_targets(robot, sampled, body))
        figures = row(motion, time.process_time() - start)
        print(name, len(motion.qpos), *(f"{x:.2f}" for x in figures), flush=True)
        misses.append(1e3 * motion.miss[motion.targets.held])
        slides.append(1e3 * motion.planted_speed)
    palms, ankles = np.concatenate(misses), np.concatenate(slides)
    print(f"all palms, 95th percentile: {np.percentile(palms, 95):.2f} mm")
    print(
        f"all ankles, 99th percentile and most: {np.percentile(ankles, 99):.2f} {ankles.max():.2f} mm"
    )


if __name__ == "__main__":
    main()
