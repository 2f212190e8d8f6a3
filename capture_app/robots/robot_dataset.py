"""Results become a LeRobot data set of a robot's motions: an episode for each take, or for each sample.

Finished episodes are kept beside the folder that is to be made, so that an interrupted export goes on.
"""

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from capture_app.commands.export import ExportRequest
from capture_app.exports.export_sample import Exported
from capture_app.manifest import MANIFEST, MOTION
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, load_result, sample_index
from capture_app.robots.export_robot import new_folder, robot_of, sampled_person, unreached
from capture_app.robots.lerobot_files import (
    INFO,
    RobotEpisode,
    load_episode,
    save_episode,
    write_lerobot,
)
from capture_app.robots.robot_files import with_object
from capture_app.robots.robot_model import Robot, robot_package
from capture_app.robots.robot_solver import robot_motion
from capture_app.solve_samples import solved_result
from capture_app.staging import Staging
from omomo_core.errors import InputError, OmocapError

_FINISHED = "finished"
"""Folder of the episodes that are finished, in the folder that becomes the data set."""
_PUT_ASIDE = ".damaged"
"""Part of the name of a result that a batch has put aside."""


def export_data_set(request: ExportRequest, progress: Progress = silent) -> Exported:
    """Write a data set of one result or of all results in a folder; it appears whole or not at all.

    A take that cannot become an episode is left out and named. What an interrupted call has finished
    is taken over by the next one with the same robot, rate and task.

    Args:
        request: the result or the folder of results, the robot, the folder to make or one to put it in.
        progress: told the stages "episodes" and, where a sample was not solved yet, "solve".

    Raises:
        InputError: "robot-needed", "robot-extra-missing", "results-none", "episodes-none", or see
            `load_robot`; or the folder exists.
    """
    robot = robot_of(request)
    robot_package("pyarrow.parquet")
    takes = _results_in(request.result)
    target = new_folder(request.output, f"{request.result.resolve().name}_lerobot", INFO)
    staging = Staging(target, key=_key(request))
    maker = _EpisodeMaker(request, robot, staging.open() / _FINISHED)
    episodes: list[RobotEpisode] = []
    failures: list[str] = []
    for number, take in enumerate(takes):
        progress("episodes", number / len(takes))
        try:
            episodes += maker.episodes(take, progress)
        except OmocapError as error:
            if error.code in ("disk-full", "output-not-writable"):
                raise
            failures.append(f"{take.name} is left out: {error.what} {error.fix}".strip())
    if not episodes:
        staging.discard()
        raise InputError(
            "episodes-none",
            f"No take could become an episode. {failures[0]}",
            where=str(request.result),
            fix="Mend the takes, or give other results.",
        )
    write_lerobot(staging.folder, episodes, robot.joints, request.fps, robot.path.stem)
    shutil.rmtree(maker.finished)
    staging.publish()
    progress("episodes", 1.0)
    return Exported((target,), tuple(_notes(episodes, maker.found)), tuple(failures))


def _results_in(folder: Path) -> list[Path]:
    """Return the result folder itself, or the result folders in it by their names."""
    if (folder / MANIFEST).is_file():
        return [folder]
    inside = sorted(folder.iterdir()) if folder.is_dir() else []
    found = [path for path in inside if (path / MANIFEST).is_file() and path.name[0] != "."]
    takes = [path for path in found if _PUT_ASIDE not in path.name]
    if not takes:
        raise InputError(
            "results-none",
            "This is neither a result folder nor a folder of results.",
            where=str(folder),
            fix="Give a folder that ‹omocap run› or ‹omocap batch› wrote.",
        )
    return takes


def _notes(episodes: list[RobotEpisode], found: int) -> Iterator[str]:
    if found:
        yield f"{found} of {len(episodes)} episodes were there from an earlier run."
    for episode in episodes:
        yield from (f"{episode.take}: {note}" for note in episode.notes)


def _key(request: ExportRequest) -> str:
    """Return what tells exports apart whose episodes differ."""
    files = [path.read_bytes() for path in (request.robot, request.frames) if path is not None]
    return _digest(*files, request.fps, request.task)


def _digest(*values: Any) -> str:
    return hashlib.sha256(repr(values).encode()).hexdigest()[:16]


@dataclass
class _EpisodeMaker:
    """Makes episodes, each once."""

    request: ExportRequest
    robot: Robot
    finished: Path
    """Folder of the episodes that are finished."""
    found: int = 0
    """How many episodes were there from an earlier run."""

    def episodes(self, take: Path, progress: Progress) -> list[RobotEpisode]:
        """Return the episodes of a result folder."""
        result = load_result(take)
        named = {sample_index(result, self.request.sample): take.name}
        if self.request.all_samples:
            named = {k: f"{take.name} sample {k + 1}" for k in range(len(result.people))}
        return [self._episode(result, index, name, progress) for index, name in named.items()]

    def _episode(self, result: Result, index: int, name: str, progress: Progress) -> RobotEpisode:
        made = (result.folder / MANIFEST).read_bytes(), (result.folder / MOTION).stat().st_mtime_ns
        path = self.finished / f"{_digest(str(result.folder.resolve()), index, name, *made)}.npz"
        if path.is_file():
            self.found += 1
            return load_episode(path)
        episode = self._made(solved_result(result, [index], progress), index, name)
        self.finished.mkdir(exist_ok=True)
        save_episode(path, episode)
        return episode

    def _made(self, result: Result, index: int, name: str) -> RobotEpisode:
        sampled = sampled_person(result, index, float(self.request.fps))
        motion = robot_motion(self.robot, sampled, body_of(result))
        moved = sampled.object_motion
        return RobotEpisode(
            take=name,
            task=self.request.task or f"Move the {moved.mesh.name.replace('_', ' ')}.",
            qpos=motion.qpos,
            object_pose=with_object(motion, moved)[:, motion.qpos.shape[1] :],
            hand_contact=motion.targets.held,
            foot_contact=motion.targets.planted,
            notes=tuple(unreached(motion)),
        )
