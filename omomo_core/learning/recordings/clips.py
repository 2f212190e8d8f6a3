"""Clip: the unit of training data, and its file format: one npz, or a folder of them."""

import json
import zipfile
from collections import defaultdict
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.whole_file import whole_file

_PER_FRAME = ("root", "rotations", "hand_contact", "foot_contact")


SYNTHESIS = "synthesis"
"""The source of clips that the synthesis makes."""


@dataclass(frozen=True)
class Clip:
    """One person's motion on our skeleton at 30 fps, with the object they moved if there is one.

    Arrays read from files are single precision, as they are stored.
    """

    name: str
    source: str
    """Origin of the clip: "cmu_bvh", "o3de", "hdm05", "cmu_jump", `SYNTHESIS`..."""
    licence: str
    root: Float[np.ndarray, "frames 3"]
    """Pelvis joint, world (z up, floor 0), metres."""
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global R_world_joint of the body joints."""
    hand_contact: Float[np.ndarray, "frames 2"]
    """1 while the left, right palm touches the object."""
    foot_contact: Float[np.ndarray, "frames 4"]
    """1 while the left ankle, right ankle, left toe, right toe is planted."""
    object_motion: ObjectMotion | None


def save_clips(
    path: Path, clips: Sequence[Clip], notes: Mapping[str, object] | None = None
) -> None:
    """Write clips into one compressed npz (no pickle): arrays joined along frames, plus a JSON index.

    Args:
        path: the file; it appears under its name only when it is whole and on the disk.
        clips: what to write.
        notes: anything JSON can hold, kept with the clips (see `read_index`).
    """
    arrays: dict[str, list[np.ndarray]] = defaultdict(list)
    for clip in clips:
        for key in _PER_FRAME:
            arrays[key].append(np.asarray(getattr(clip, key), np.float32))
        if moved := clip.object_motion:
            arrays["T"].append(moved.T_world_object.astype(np.float32))
            arrays["vertices"].append(moved.mesh.vertices.astype(np.float32))
            arrays["faces"].append(moved.mesh.faces.astype(np.int32))
    joined: dict[str, Any] = {k: np.concatenate(v) for k, v in arrays.items()}
    index, extra = json.dumps([_index_row(clip) for clip in clips]), json.dumps(dict(notes or {}))
    with whole_file(path) as partial, partial.open("wb") as file:
        np.savez_compressed(file, index=np.array(index), notes=np.array(extra), **joined)


def load_clips(path: Path) -> list[Clip]:
    """All clips of a file that `save_clips` wrote, or of a folder of such files, in their order.

    Raises:
        InputError: ``clips-missing`` when there is no such file, or none in the folder;
            ``clips-damaged`` when a file is not one of those, or is not whole.
    """
    return [clip for file in clip_files(path) for clip in _read_file(file)]


def clip_files(path: Path) -> list[Path]:
    """The files of a data set: the path itself, or the npz files of a folder by name.

    Raises:
        InputError: ``clips-missing`` when there is none.
    """
    files = sorted(path.glob("[!.]*.npz")) if path.is_dir() else [path]
    if not files or not files[0].is_file():
        raise InputError(
            "clips-missing",
            "There are no training clips.",
            where=str(path),
            fix="Make some with ‹omocap data build› and ‹omocap data synthesise›.",
        )
    return files


def read_index(file: Path) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """What is in a file, without reading the motion: a row for each clip, and the notes.

    Raises:
        InputError: ``clips-damaged``.
    """
    with _opened(file) as data:
        return json.loads(str(data["index"])), json.loads(str(data.get("notes", "{}")))


@contextmanager
def _opened(file: Path) -> Generator[Mapping[str, Any]]:
    try:
        # Opened here, because numpy leaves a damaged file open.
        with file.open("rb") as handle, np.load(handle, allow_pickle=False) as data:
            yield data
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(
            "clips-damaged",
            "This is not a file of training clips, or it is damaged.",
            where=str(file),
            fix="Delete it and run the same command again that made it.",
        ) from error


def _read_file(file: Path) -> Iterator[Clip]:
    with _opened(file) as stored:
        index = json.loads(str(stored["index"]))
        data = {k: stored[k] for k in stored if k not in ("index", "notes")}
    at = {"frames": 0, "T": 0, "verts": 0, "faces": 0}
    for row in index:
        here = slice(at["frames"], at["frames"] + row["frames"])
        moved = _object_motion(row, data, at) if row["object"] is not None else None
        yield Clip(
            name=row["name"],
            source=row["source"],
            licence=row["licence"],
            object_motion=moved,
            **{k: data[k][here] for k in _PER_FRAME},
        )
        at["frames"] = here.stop


def _index_row(clip: Clip) -> dict[str, object]:
    moved = clip.object_motion
    return {
        "name": clip.name,
        "source": clip.source,
        "licence": clip.licence,
        "frames": len(clip.root),
        "object": moved.mesh.name if moved else None,
        "verts": len(moved.mesh.vertices) if moved else 0,
        "faces": len(moved.mesh.faces) if moved else 0,
    }


def _object_motion(
    row: dict[str, Any], data: dict[str, np.ndarray], at: dict[str, int]
) -> ObjectMotion:
    frames, verts, faces = row["frames"], row["verts"], row["faces"]
    mesh = ObjectMesh(
        vertices=data["vertices"][at["verts"] : at["verts"] + verts],
        faces=data["faces"][at["faces"] : at["faces"] + faces],
        name=row["object"],
    )
    T = data["T"][at["T"] : at["T"] + frames]
    at["T"] += frames
    at["verts"] += verts
    at["faces"] += faces
    return ObjectMotion(mesh=mesh, T_world_object=T, valid=np.ones(frames, bool))
