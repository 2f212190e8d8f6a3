"""A sample of a result becomes a robot's motion: a folder of files, and what the robot could not do."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capture_app.commands.export import ExportRequest
from capture_app.exports.export_sample import Exported
from capture_app.exports.resample import Sampled, at_rate
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, load_result, sample_index
from capture_app.robots.robot_files import ARRAYS, scene_of, write_robot_files
from capture_app.robots.robot_model import Robot, load_robot
from capture_app.robots.robot_solver import RobotMotion, robot_motion
from capture_app.solve_samples import solved_result
from capture_app.staging import staged_folder
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs

NEAR = 0.015
"""Metres: a palm that is farther from its place on the object is reported."""
SLIDING = 0.03
"""Metres a second: a planted foot that is faster is reported."""
_JOINED = 0.3
"""Seconds between two spans that are reported as one."""


def export_robot(request: ExportRequest, progress: Progress = silent) -> Exported:
    """Write the folder of a robot's motion; it appears whole or not at all.

    Args:
        request: the result, the robot, the folder to make or one to put it in, the rate and the sample.
        progress: told the stage "solve" where the sample was not solved yet.

    Raises:
        InputError: "robot-needed", see `load_robot` and `scene_of`; or the result cannot be read, or the
            folder exists.
    """
    robot = robot_of(request)
    result = load_result(request.result)
    index = sample_index(result, request.sample)
    suffix = "" if request.sample is None else f"_sample_{request.sample}"
    target = new_folder(request.output, f"{result.folder.resolve().name}{suffix}_robot", ARRAYS)
    with staged_folder(target) as folder:
        scene = scene_of(folder, robot, result.object_motion.mesh)
        result = solved_result(result, [index], progress)
        sampled = sampled_person(result, index, float(request.fps))
        motion = robot_motion(robot, sampled, body_of(result))
        files = write_robot_files(folder, motion, sampled.object_motion, scene)
    files = tuple(target / f.relative_to(folder) for f in files)
    return Exported(files, tuple(unreached(motion)))


def sampled_person(result: Result, index: int, fps: float) -> Sampled:
    """Return a sample and its object at a rate."""
    person = result.people[index].human
    return at_rate(person, result.object_motion, body_of(result), fps)


def robot_of(request: ExportRequest) -> Robot:
    """Return the robot that a request names.

    Raises:
        InputError: "robot-needed", or see `load_robot`.
    """
    if request.robot is None:
        raise InputError(
            "robot-needed",
            "Nothing says which robot shall move.",
            field="robot",
            fix="Give its MJCF or URDF file with ‹robot›.",
        )
    return load_robot(request.robot, request.frames)


def new_folder(output: Path, name: str, mark: str) -> Path:
    """Return the folder to make, which is not there yet.

    Args:
        output: the folder, or one to put it in.
        name: of the folder in that one.
        mark: a file of such a folder, by which one that is there already is known.

    Raises:
        InputError: "output-exists".
    """
    target = output
    if target.is_dir() and not (target / mark).exists():
        target /= name
    if target.exists() or target.is_symlink():
        raise InputError(
            "output-exists",
            "There is a file or folder of this name already, and exports replace none.",
            where=str(target),
            fix="Choose another name with ‹output›.",
        )
    return target


def unreached(motion: RobotMotion) -> Iterator[str]:
    """Yield what the robot could not do, with its times, in sentences."""
    fps = motion.targets.fps
    for k, side in enumerate(("left", "right")):
        far = motion.miss[:, k] > NEAR
        for start, stop in runs(_joined(far, round(_JOINED * fps))):
            most = motion.miss[start:stop, k].max()
            yield (
                f"From {start / fps:.2f} to {stop / fps:.2f} s the {side} palm is up to "
                f"{100 * most:.1f} cm from its place on the object: the robot cannot reach it."
            )
    planted = motion.targets.planted
    slid = fps * np.linalg.norm(np.diff(motion.ankles, axis=0), axis=2) * planted[1:] * planted[:-1]
    for start, stop in runs(_joined((slid > SLIDING).any(axis=1), round(_JOINED * fps))):
        yield (
            f"From {start / fps:.2f} to {stop / fps:.2f} s a foot that stands slides at up to "
            f"{slid[start:stop].max():.2f} m/s: the robot cannot stand on it there."
        )
    touching = runs(_joined(motion.apart < 0.0, round(_JOINED * fps)))
    for start, stop in touching:
        yield f"From {start / fps:.2f} to {stop / fps:.2f} s parts of the robot touch each other."


def _joined(mask: np.ndarray, gap: int) -> np.ndarray:
    out = mask.copy()
    for start, stop in runs(~mask):
        if start > 0 and stop < len(mask) and stop - start <= gap:
            out[start:stop] = True
    return out
