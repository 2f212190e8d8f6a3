"""`motion.npz` of a result folder: the samples of a person's motion and the object they moved."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture_app.manifest import Manifest, read_manifest
from capture_app.quaternions import matrix_from_xyzw, xyzw_from_matrix
from omomo_core.body.load import load_body
from omomo_core.body.model import BodyModel, with_height
from omomo_core.errors import InputError
from omomo_core.motion import FPS, HumanMotion, ObjectMesh, ObjectMotion
from omomo_core.skeleton import BODY_JOINTS, FINGER_JOINTS

JOINT_NAMES = (*BODY_JOINTS, "left_palm", "right_palm")

MOTION, MANIFEST, GLB, VIDEO = "motion.npz", "manifest.json", "motion.glb", "motion.mp4"
"""Names of the files of a result folder."""


@dataclass(frozen=True)
class Result:
    """A result folder in memory."""

    folder: Path
    manifest: Manifest
    motions: tuple[HumanMotion, ...]
    """The samples; `manifest.chosen` is the index of the best."""
    object_motion: ObjectMotion


def load_result(folder: Path) -> Result:
    """Read a result folder.

    Raises:
        InputError: it is none, or damaged.
    """
    manifest = read_manifest(folder / MANIFEST)
    motions, object_motion = load_motion(folder / MOTION)
    if manifest.chosen >= len(motions):
        raise _damaged(folder / MOTION, "it holds fewer samples than the manifest says")
    return Result(folder, manifest, motions, object_motion)


def body_of(result: Result) -> BodyModel:
    """The body that a result's motion is on.

    Raises:
        AssetError: it was the user's own, and is not where it was.
    """
    given = [Path(item.path) for item in result.manifest.inputs if item.role == "body"]
    return with_height(load_body(given[0] if given else None), result.manifest.body.height)


def save_motion(
    path: Path,
    motions: Sequence[HumanMotion],
    chosen: int,
    object_motion: ObjectMotion,
    body_name: str,
) -> None:
    """Write the arrays that docs/format.md describes; the same motion gives the same bytes.

    Args:
        path: the .npz file to write (no pickle in it).
        motions: K samples of equal length.
        chosen: index of the best one.
        object_motion: as many frames as the samples.
        body_name: the body whose bones the motions move.
    """
    arrays: dict[str, np.ndarray] = {
        "fps": np.array(FPS, np.float32),
        "chosen": np.array(chosen, np.int32),
        "body": np.array(body_name),
        "joint_names": np.array(JOINT_NAMES),
        "rotation_names": np.array(BODY_JOINTS),
        "finger_names": np.array(FINGER_JOINTS),
        **_human_arrays(motions),
        **_object_arrays(object_motion),
    }
    # numpy stamps every member 1980-01-01: equal arrays make equal files.
    np.savez_compressed(path, allow_pickle=False, **arrays)


def load_motion(path: Path) -> tuple[tuple[HumanMotion, ...], ObjectMotion]:
    """Read what `save_motion` wrote: the samples and the object's motion.

    Raises:
        InputError: the file is missing or damaged.
    """
    try:
        # Opened here and not by numpy, which leaves a damaged file open.
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            data = {key: file[key] for key in file.files}
        samples = range(len(data["root"]))
        return tuple(_human(data, k) for k in samples), _object_motion(data)
    except FileNotFoundError as error:
        raise InputError(
            "result-missing",
            "The result folder has no motion in it.",
            where=str(path),
            fix="Run the take again.",
        ) from error
    except Exception as error:  # damaged bytes fail in a dozen ways in zipfile, zlib and numpy
        raise _damaged(path, str(error)) from error


def _damaged(path: Path, why: str) -> InputError:
    return InputError(
        "result-damaged",
        f"The motion cannot be read: {why}.",
        where=str(path),
        fix="Run the take again.",
    )


def _human_arrays(motions: Sequence[HumanMotion]) -> dict[str, np.ndarray]:
    plain = ("root", "joints", "hand_contact", "foot_contact")
    arrays = {key: np.stack([getattr(m, key) for m in motions]) for key in plain}
    arrays["rotations_xyzw"] = np.stack([xyzw_from_matrix(m.rotations) for m in motions])
    arrays["fingers_xyzw"] = np.stack([xyzw_from_matrix(m.fingers) for m in motions])
    return {key: array.astype(np.float32) for key, array in arrays.items()}


def _object_arrays(moved: ObjectMotion) -> dict[str, np.ndarray]:
    T = moved.T_world_object
    return {
        "object_position": T[:, :3, 3].astype(np.float32),
        "object_rotation_xyzw": xyzw_from_matrix(T[:, :3, :3]).astype(np.float32),
        "object_vertices": moved.mesh.vertices.astype(np.float32),
        "object_faces": moved.mesh.faces.astype(np.int32),
        "object_name": np.array(moved.mesh.name),
        "valid": moved.valid,
        "start_time": np.array(moved.start_time, np.float64),
    }


def _human(data: dict[str, np.ndarray], k: int) -> HumanMotion:
    plain = ("root", "joints", "hand_contact", "foot_contact")
    return HumanMotion(
        rotations=matrix_from_xyzw(data["rotations_xyzw"][k]).astype(np.float32),
        fingers=matrix_from_xyzw(data["fingers_xyzw"][k]).astype(np.float32),
        **{key: data[key][k] for key in plain},
    )


def _object_motion(data: dict[str, np.ndarray]) -> ObjectMotion:
    T = np.tile(np.eye(4), (len(data["valid"]), 1, 1))
    T[:, :3, :3] = matrix_from_xyzw(data["object_rotation_xyzw"])
    T[:, :3, 3] = data["object_position"]
    mesh = ObjectMesh(data["object_vertices"], data["object_faces"], str(data["object_name"]))
    return ObjectMotion(mesh, T, data["valid"], float(data["start_time"]))
