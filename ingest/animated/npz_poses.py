"""Poses in npz: `T_world_object` (T, 4, 4), or `obj_pos` (T, 3) and `obj_rot_xyzw` (T, 4).

`fps` says how many a second, `up` which axis of the world is up ("z" where it is left out).
Metres. Nothing in such a file is ever unpickled.
"""

import zipfile
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.animated.animated_take import split_stretch
from ingest.animated.animation import (
    MAX_FPS,
    Animation,
    Up,
    check_times,
    checked,
    not_finite,
    rigid,
    sampled,
)
from omomo_core.errors import InputError, reading

NAME = "npz"
FILES = "npz with T_world_object, or obj_pos and obj_rot_xyzw, and fps"

MAX_BYTES = 2**30
_MATRICES, _POSITIONS, _ROTATIONS = "T_world_object", "obj_pos", "obj_rot_xyzw"
_NAMES = (_MATRICES, _POSITIONS, _ROTATIONS, "fps", "up")
_SCALED = 1e-3

_Arrays = dict[str, np.ndarray]


def detect(path: Path) -> bool:
    """Whether it is an npz with poses under one of these names."""
    return not {_MATRICES, _POSITIONS}.isdisjoint(_members(path))


def read(path: Path) -> Animation:
    """Read poses.

    Raises:
        InputError: "npz-damaged", "npz-keys", "pose-not-finite", "animation-one-key",
            "animation-not-affine", "animation-stretched", "animation-scaled",
            "quaternion-not-unit" or "animation-long".
    """
    arrays = _load(path)
    fps, up = _fps(arrays, path), _up(arrays, path)
    T = _matrices(arrays, path) if _MATRICES in arrays else _quaternions(arrays, path)
    times = np.arange(len(T)) / fps
    check_times(times, lambda frame: _place(path, frame), path)
    return sampled(path, times, T, up)


def _place(path: Path, frame: int) -> str:
    return f"{path}, frame {frame}"


def _members(path: Path) -> dict[str, int]:
    """Unpacked size of each array in the archive; {} if it is none."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {item.filename.removesuffix(".npy"): item.file_size for item in archive.filelist}
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return {}


def _load(path: Path) -> _Arrays:
    """The arrays that are wanted, and nothing else."""
    members = _members(path)
    wanted = [name for name in _NAMES if name in members]
    if sum(members[name] for name in wanted) > MAX_BYTES:
        raise _damaged(path, "it unpacks to more than a gigabyte")
    with reading(lambda why: _damaged(path, why)), np.load(path, allow_pickle=False) as file:
        return {name: np.asarray(file[name]) for name in wanted}


def _damaged(path: Path, why: str) -> InputError:
    return InputError(
        "npz-damaged",
        f"{path.name} cannot be read: {why}.",
        where=str(path),
        fix="Write it again with numpy.savez, with arrays of numbers.",
    )


def _keys(path: Path, what: str) -> InputError:
    return InputError(
        "npz-keys",
        f"{path.name} is not what it should be: {what}.",
        where=str(path),
        fix="Save T_world_object (T, 4, 4), or obj_pos (T, 3) with obj_rot_xyzw (T, 4); fps; and up, "
        '"y" or "z".',
    )


def _fps(arrays: _Arrays, path: Path) -> float:
    fps = float(_numbers(arrays, "fps", (), path).reshape(()))
    if not 0 < fps < MAX_FPS:
        raise _keys(path, f"fps is {fps:g}")
    return fps


def _up(arrays: _Arrays, path: Path) -> Up:
    words = arrays.get("up", np.array("z")).ravel().tolist()
    word = str(words[0]).lower() if len(words) == 1 else ""
    if word == "y":
        return "y"
    if word == "z":
        return "z"
    raise _keys(path, f'up is {word[:30]!r} instead of "y" or "z"')


def _numbers(
    arrays: _Arrays, name: str, shape: tuple[int | None, ...], path: Path
) -> Float64[np.ndarray, "..."]:
    """An array of numbers with that shape, None for any length."""
    array = arrays.get(name)
    if array is None:
        raise _keys(path, f"it has no {name}")
    fits = array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype.kind not in "iuf":
        raise _keys(path, f"{name} is of shape {array.shape} and type {array.dtype}")
    return array.astype(np.float64)


def _finite(
    values: Float64[np.ndarray, "poses numbers"], path: Path
) -> Float64[np.ndarray, "poses numbers"]:
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise not_finite(_place(path, int(np.argmin(finite))))
    return values


def _quaternions(arrays: _Arrays, path: Path) -> Float64[np.ndarray, "poses 4 4"]:
    positions = _finite(_numbers(arrays, _POSITIONS, (None, 3), path), path)
    xyzw = _finite(_numbers(arrays, _ROTATIONS, (len(positions), 4), path), path)
    return rigid(positions, checked(xyzw, lambda frame: _place(path, frame)))


def _matrices(arrays: _Arrays, path: Path) -> Float64[np.ndarray, "poses 4 4"]:
    rows = _numbers(arrays, _MATRICES, (None, 4, 4), path).reshape(-1, 16)
    T = _finite(rows, path).reshape(-1, 4, 4)
    if len(T) == 0:
        return T
    poses, stretch = split_stretch(T, lambda frame: _place(path, frame))
    if np.abs(stretch - np.eye(3)).max() > _SCALED:
        raise InputError(
            "animation-scaled",
            "The matrices scale or mirror the object, whose mesh is not in this file.",
            where=str(path),
            fix="Write rotations without scale, and a mesh in metres.",
        )
    return poses
