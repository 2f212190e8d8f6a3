"""Clip: the unit of training data, and its file format."""

import json
import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh, ObjectMotion


@dataclass(frozen=True)
class Clip:
    """One person's motion on our skeleton at 30 fps, with the object they moved if there is one."""

    name: str
    source: str
    """Where it came from: "cmu_bvh", "o3de", "hdm05", "cmu_jump", "synthesis"..."""
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


def save_clips(path: Path, clips: Sequence[Clip]) -> None:
    """Write clips into one compressed npz (no pickle): arrays joined along frames, plus a JSON index."""
    index: list[dict[str, object]] = []
    arrays: dict[str, list[np.ndarray]] = {
        k: []
        for k in ("root", "rotations", "hand_contact", "foot_contact", "T", "vertices", "faces")
    }
    for clip in clips:
        moved = clip.object_motion
        index.append(
            {
                "name": clip.name,
                "source": clip.source,
                "licence": clip.licence,
                "frames": len(clip.root),
                "object": moved.mesh.name if moved else None,
                "verts": len(moved.mesh.vertices) if moved else 0,
                "faces": len(moved.mesh.faces) if moved else 0,
            }
        )
        for key in ("root", "rotations", "hand_contact", "foot_contact"):
            arrays[key].append(np.asarray(getattr(clip, key), np.float32))
        if moved:
            arrays["T"].append(moved.T_world_object.astype(np.float32))
            arrays["vertices"].append(moved.mesh.vertices.astype(np.float32))
            arrays["faces"].append(moved.mesh.faces.astype(np.int32))
    joined: dict[str, Any] = {k: np.concatenate(v) for k, v in arrays.items() if v}
    # Beside the target, then renamed: an interrupted save leaves no half file.
    temporary = path.with_name(path.name + ".new.npz")
    np.savez_compressed(temporary, index=np.array(json.dumps(index)), **joined)
    os.replace(temporary, path)


def load_clips(path: Path) -> list[Clip]:
    """Read what `save_clips` wrote.

    Raises:
        InputError: ``clips-damaged`` when the file is not one of those, or is not whole.
    """
    try:
        # Opened here, because numpy leaves a damaged file open.
        with path.open("rb") as handle, np.load(handle, allow_pickle=False) as file:
            index = json.loads(str(file["index"]))
            data = {k: _double(file[k]) for k in file.files if k != "index"}
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(
            "clips-damaged",
            "This is not a file of training clips, or it is damaged.",
            where=str(path),
            fix="Make it again with `omocap data build`.",
        ) from error
    clips: list[Clip] = []
    at = {"frames": 0, "T": 0, "verts": 0, "faces": 0}
    for row in index:
        here = slice(at["frames"], at["frames"] + row["frames"])
        moved = _object_motion(row, data, at) if row["object"] is not None else None
        clips.append(
            Clip(
                name=row["name"],
                source=row["source"],
                licence=row["licence"],
                object_motion=moved,
                **{k: data[k][here] for k in ("root", "rotations", "hand_contact", "foot_contact")},
            )
        )
        at["frames"] = here.stop
    return clips


def _double(x: np.ndarray) -> np.ndarray:
    """Single precision is for the file; everything computes in double."""
    return x.astype(np.float64) if x.dtype == np.float32 else x


def _object_motion(
    row: dict[str, object], data: dict[str, np.ndarray], at: dict[str, int]
) -> ObjectMotion:
    frames, verts, faces = int(str(row["frames"])), int(str(row["verts"])), int(str(row["faces"]))
    mesh = ObjectMesh(
        vertices=data["vertices"][at["verts"] : at["verts"] + verts],
        faces=data["faces"][at["faces"] : at["faces"] + faces],
        name=str(row["object"]),
    )
    T = data["T"][at["T"] : at["T"] + frames]
    at["T"] += frames
    at["verts"] += verts
    at["faces"] += faces
    return ObjectMotion(mesh=mesh, T_world_object=T, valid=np.ones(frames, bool))
