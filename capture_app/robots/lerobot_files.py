"""A LeRobotDataset v3.0: the frames of all episodes as parquet, and `meta`, which says what they are.

lerobot itself is not needed: pyarrow writes the tables. Quaternions are w first, as in MuJoCo's qpos.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from capture_app.robots.robot_model import robot_package
from omomo_core.whole_file import whole_file

INFO = "meta/info.json"
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_FIRST_FILE = _FILE.format(chunk_index=0, file_index=0)
"""Readers take as many files as there are; one holds ten hours of a humanoid in half a gigabyte."""
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_PARTS = ("chunk", "file")
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_INDEX = "__index_level_0__"
"""Name that pandas gives to the column of an index without a name."""

Columns = dict[str, np.ndarray]
"""Features of consecutive frames by name; those of one number have no second axis."""


@dataclass(frozen=True)
class RobotEpisode:
    """A take that a robot does, at the rate of the data set."""

    take: str
    """Name of the result folder, and the number of the sample where all are taken."""
    task: str
    """What the robot does, in words."""
    qpos: Float[np.ndarray, "frames qpos"]
    """Root x, y, z in metres, quaternion (w first), joints in radians in the model's order."""
    object_pose: Float[np.ndarray, "frames 7"]
    """Position and quaternion (w first) of the object."""
    hand_contact: Bool[np.ndarray, "frames 2"]
    """Frames in which the left and the right hand hold."""
    foot_contact: Bool[np.ndarray, "frames 2"]
    """Frames in which the left and the right foot stand."""
    notes: tuple[str, ...] = ()
    """What the robot could not do, in sentences."""


def write_lerobot(
    folder: Path, episodes: Sequence[RobotEpisode], joints: Sequence[str], fps: int, robot: str
) -> None:
    """Write a whole data set into a folder.

    Args:
        folder: exists.
        episodes: at least one, of one robot, at one rate.
        joints: names of the joints, in the order of `qpos`.
        fps: frames a second.
        robot: name of the robot's type.

    Raises:
        InputError: "disk-full" or "output-not-writable".
    """
    tasks = list(dict.fromkeys(episode.task for episode in episodes))
    starts = [0, *accumulate(len(episode.qpos) for episode in episodes)]
    columns = [
        _columns(episode, number, starts[number], tasks.index(episode.task), fps)
        for number, episode in enumerate(episodes)
    ]
    rows = [
        _row(episode, number, starts[number], columns[number])
        for number, episode in enumerate(episodes)
    ]
    whole = {name: np.concatenate([some[name] for some in columns]) for name in columns[0]}
    about = [{"take": episode.take, "notes": episode.notes} for episode in episodes]
    (folder / "meta").mkdir(exist_ok=True)
    with whole_file(folder / INFO) as info:
        _write_table(folder / "data" / _FIRST_FILE, _table(whole))
        episode_table = robot_package("pyarrow").Table.from_pylist(rows)
        _write_table(folder / "meta/episodes" / _FIRST_FILE, episode_table)
        _write_table(folder / "meta/tasks.parquet", _task_table(tasks))
        _write_json(folder / "meta/stats.json", {name: _stats(x) for name, x in whole.items()})
        _write_json(folder / "meta/omocap.json", {"episodes": about})
        _write_json(info, _info(whole, joints, fps, robot, len(episodes), len(tasks)))


def _columns(episode: RobotEpisode, number: int, start: int, task: int, fps: int) -> Columns:
    """Return the features of an episode's frames; the action is the state one step on."""
    state, steps = episode.qpos.astype(np.float32), np.arange(len(episode.qpos))
    return {
        "observation.state": state,
        "observation.environment_state": episode.object_pose.astype(np.float32),
        "observation.hand_contact": episode.hand_contact.astype(np.float32),
        "observation.foot_contact": episode.foot_contact.astype(np.float32),
        "action": np.concatenate([state[1:], state[-1:]]),
        "timestamp": (steps / fps).astype(np.float32),
        "frame_index": steps,
        "episode_index": np.full(len(steps), number),
        "index": start + steps,
        "task_index": np.full(len(steps), task),
    }


def _info(
    frames: Columns, joints: Sequence[str], fps: int, robot: str, episodes: int, tasks: int
) -> dict[str, Any]:
    state = [*(f"root_{part}" for part in _POSE), *joints]
    names = {
        "observation.state": state,
        "observation.environment_state": [f"object_{part}" for part in _POSE],
        "observation.hand_contact": ["left_hand", "right_hand"],
        "observation.foot_contact": ["left_foot", "right_foot"],
        "action": state,
    }
    features = {
        name: {"dtype": str(x.dtype), "shape": x.shape[1:] or (1,), "names": names.get(name)}
        for name, x in frames.items()
    }
    counts = {"total_episodes": episodes, "total_frames": len(frames["index"])}
    sizes = {"data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "chunks_size": 1000}
    files = {"data_path": f"data/{_FILE}", "video_path": None, "splits": {"train": f"0:{episodes}"}}
    about = {"codebase_version": "v3.0", "robot_type": robot, "fps": fps, "total_tasks": tasks}
    return {**about, **counts, **sizes, **files, "features": features}


def _row(episode: RobotEpisode, number: int, start: int, columns: Columns) -> dict[str, Any]:
    """Return what `meta/episodes` says of an episode."""
    files = {f"{place}/{part}_index": 0 for place in ("data", "meta/episodes") for part in _PARTS}
    return {
        "episode_index": number,
        "tasks": [episode.task],
        "length": len(episode.qpos),
        "dataset_from_index": start,
        "dataset_to_index": start + len(episode.qpos),
        **files,
        **{f"stats/{n}/{stat}": v for n, x in columns.items() for stat, v in _stats(x).items()},
    }


def _stats(values: np.ndarray) -> dict[str, Any]:
    """Return what policies are normalised with, each a number for every column."""
    x = values.reshape(len(values), -1).astype(np.float64)
    quantiles = zip(_QUANTILES, np.quantile(x, list(_QUANTILES.values()), axis=0), strict=True)
    found = {"min": x.min(axis=0), "max": x.max(axis=0), "mean": x.mean(axis=0)}
    found |= {"std": x.std(axis=0), **dict(quantiles)}
    return {"count": [len(x)], **{name: value.tolist() for name, value in found.items()}}


def _table(columns: Columns) -> Any:
    arrow = robot_package("pyarrow")
    lists = arrow.FixedSizeListArray
    arrays = {
        name: x if x.ndim == 1 else lists.from_arrays(arrow.array(x.ravel()), x.shape[1])
        for name, x in columns.items()
    }
    return arrow.table(arrays)


def _task_table(tasks: Sequence[str]) -> Any:
    """Return the table of tasks as pandas writes one whose index they are."""
    table = robot_package("pyarrow").table({"task_index": range(len(tasks)), _INDEX: tasks})
    parts = ("name", "field_name", "pandas_type", "numpy_type", "metadata")
    number = dict(zip(parts, ("task_index", "task_index", "int64", "int64", None), strict=True))
    text = dict(zip(parts, (None, _INDEX, "unicode", "object", None), strict=True))
    about = {"index_columns": [_INDEX], "column_indexes": [], "columns": [number, text]}
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _write_table(path: Path, table: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    robot_package("pyarrow.parquet").write_table(table, path)


def _write_json(path: Path, value: Any) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n", encoding="utf-8")


def save_episode(path: Path, episode: RobotEpisode) -> None:
    """Keep a finished episode until the data set is written."""
    arrays = {name: np.array(value) for name, value in vars(episode).items()}
    arrays["notes"] = np.array(episode.notes, str)
    with whole_file(path) as unfinished:
        np.savez(unfinished, allow_pickle=False, **arrays)


def load_episode(path: Path) -> RobotEpisode:
    """Read what `save_episode` wrote."""
    with np.load(path, allow_pickle=False) as arrays:
        kept = dict(arrays)
    words = {name: str(kept.pop(name)) for name in ("take", "task")}
    return RobotEpisode(**words, notes=tuple(kept.pop("notes").tolist()), **kept)
