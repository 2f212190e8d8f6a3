"""A LeRobotDataset v3.0: frames of all episodes as parquet, and `meta`, which says what they are.

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
_VERSION = "v3.0"
_CHUNK, _MEGABYTES = 1000, 100
"""The most files of a folder, and the size from which the next episode begins a new file."""
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")

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
    """
    tasks = list(dict.fromkeys(episode.task for episode in episodes))
    starts = [0, *accumulate(len(episode.qpos) for episode in episodes)]
    columns = [
        _columns(episode, number, starts[number], tasks.index(episode.task), fps)
        for number, episode in enumerate(episodes)
    ]
    files = _files(columns)
    _write_frames(folder, columns, files)
    rows = [
        _row(episode, number, starts[number], files[number]) | _flat_stats(columns[number])
        for number, episode in enumerate(episodes)
    ]
    _write_table(
        folder / "meta/episodes" / _named(0), robot_package("pyarrow").Table.from_pylist(rows)
    )
    _write_table(folder / "meta/tasks.parquet", _task_table(tasks))
    whole = {name: np.concatenate([some[name] for some in columns]) for name in columns[0]}
    _write_json(folder / "meta/stats.json", {name: _stats(x) for name, x in whole.items()})
    info = _info(whole, joints, fps, robot, len(episodes), len(tasks))
    _write_json(folder / INFO, info)
    about = [{"take": episode.take, "notes": episode.notes} for episode in episodes]
    _write_json(folder / "meta/omocap.json", {"episodes": about})


def _info(
    frames: Columns, joints: Sequence[str], fps: int, robot: str, episodes: int, tasks: int
) -> dict[str, Any]:
    return {
        "codebase_version": _VERSION,
        "robot_type": robot,
        "total_episodes": episodes,
        "total_frames": len(frames["index"]),
        "total_tasks": tasks,
        "chunks_size": _CHUNK,
        "data_files_size_in_mb": _MEGABYTES,
        "video_files_size_in_mb": 2 * _MEGABYTES,
        "fps": fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": f"data/{_FILE}",
        "video_path": None,
        "features": {name: _feature(name, x, joints) for name, x in frames.items()},
    }


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


def _feature(name: str, values: np.ndarray, joints: Sequence[str]) -> dict[str, Any]:
    robot = [*(f"root_{part}" for part in _POSE), *joints]
    names = {
        "observation.state": robot,
        "observation.environment_state": [f"object_{part}" for part in _POSE],
        "observation.hand_contact": ["left_hand", "right_hand"],
        "observation.foot_contact": ["left_foot", "right_foot"],
        "action": robot,
    }
    return {
        "dtype": "int64" if name in _COUNTERS else "float32",
        "shape": values.shape[1:] or (1,),
        "names": names.get(name),
    }


def _files(columns: Sequence[Columns]) -> list[int]:
    """Return the number of the file that each episode is in."""
    sizes = [sum(x.nbytes for x in some.values()) for some in columns]
    before = np.array([0, *accumulate(sizes)][:-1])
    return np.unique(before // (_MEGABYTES * 2**20), return_inverse=True)[1].tolist()


def _named(number: int) -> str:
    return _FILE.format(chunk_index=number // _CHUNK, file_index=number % _CHUNK)


def _write_frames(folder: Path, columns: Sequence[Columns], files: Sequence[int]) -> None:
    """Write the frames, each episode as a row group of its file."""
    parquet = robot_package("pyarrow.parquet")
    for number in sorted(set(files)):
        tables = [_table(some) for some, file in zip(columns, files, strict=True) if file == number]
        path = folder / "data" / _named(number)
        path.parent.mkdir(parents=True, exist_ok=True)
        with parquet.ParquetWriter(path, tables[0].schema) as writer:
            for table in tables:
                writer.write_table(table)


def _table(columns: Columns) -> Any:
    arrow = robot_package("pyarrow")

    def array(x: np.ndarray) -> Any:
        flat = arrow.array(x.ravel())
        return flat if x.ndim == 1 else arrow.FixedSizeListArray.from_arrays(flat, x.shape[1])

    return arrow.table({name: array(x) for name, x in columns.items()})


def _row(episode: RobotEpisode, number: int, start: int, file: int) -> dict[str, Any]:
    """Return what `meta/episodes` says of an episode, but for its statistics."""
    return {
        "episode_index": number,
        "tasks": [episode.task],
        "length": len(episode.qpos),
        "data/chunk_index": file // _CHUNK,
        "data/file_index": file % _CHUNK,
        "dataset_from_index": start,
        "dataset_to_index": start + len(episode.qpos),
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }


def _flat_stats(columns: Columns) -> dict[str, Any]:
    return {
        f"stats/{name}/{stat}": value
        for name, x in columns.items()
        for stat, value in _stats(x).items()
    }


def _stats(values: np.ndarray) -> dict[str, Any]:
    """Return what policies are normalised with, each a number for every column."""
    x = values.reshape(len(values), -1).astype(np.float64)
    quantiles = np.quantile(x, list(_QUANTILES.values()), axis=0)
    found = {
        "min": x.min(axis=0),
        "max": x.max(axis=0),
        "mean": x.mean(axis=0),
        "std": x.std(axis=0),
    }
    found |= dict(zip(_QUANTILES, quantiles, strict=True))
    return {"count": [len(x)], **{name: value.tolist() for name, value in found.items()}}


def _task_table(tasks: Sequence[str]) -> Any:
    """Return the table of tasks as pandas writes one whose index they are."""
    index = "__index_level_0__"
    table = robot_package("pyarrow").table({"task_index": range(len(tasks)), index: tasks})
    described = [
        {"name": name, "field_name": field, "pandas_type": kind, "numpy_type": type_, "metadata": None}
        for name, field, kind, type_ in (
            ("task_index", "task_index", "int64", "int64"), (None, index, "unicode", "object"),
        )
    ]  # fmt: skip
    about = {"index_columns": [index], "column_indexes": [], "columns": described}
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
    notes = tuple(kept.pop("notes").tolist())
    return RobotEpisode(**words, **kept, notes=notes)
