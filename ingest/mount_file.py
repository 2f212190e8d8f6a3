"""mount.json: where the object is in the phone's frame, and how it is known."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from pydantic import BaseModel, Field, ValidationError

from ingest.mount import Mount
from ingest.uncertainty import bounds_95
from omomo_core import strict_json
from omomo_core.errors import InputError, in_words
from omomo_core.whole_file import write_whole

_RIGID_TOLERANCE = 1e-3
_MAX_OFFSET = 5.0


class _Bounds(BaseModel):
    mm: float
    deg: float


class _MountFile(BaseModel):
    T_phone_object: list[list[float]]
    method: str = "given"
    bounds_95: _Bounds | None = None
    """Bounds for people who read the file; they follow from the covariance."""
    covariance: list[list[float]] | None = None
    residuals: dict[str, float] = {}
    free: list[str] = []
    note: str = ""
    date: str = ""
    phone: str = ""
    object_id: str = ""
    object_scale: float = Field(default=1.0, gt=0, allow_inf_nan=False)
    picture: str = ""


_AS_IS = ("method", "residuals", "note", "date", "phone", "object_id", "object_scale", "picture")
"""Fields that are the same in the file and in a `Mount`."""


def load_mount(path: Path) -> Mount:
    """Read mount.json: {"T_phone_object": four rows of four, "method": ...}.

    Raises:
        InputError: "mount-missing", "mount-unreadable", "mount-not-finite", "mount-not-rigid"
            (with the measured deviation), "mount-covariance" or "mount-units".
    """
    if not path.is_file():
        raise InputError(
            "mount-missing",
            "There is no mount file.",
            where=str(path),
            fix="Calibrate the mount: omocap calibrate guides you and writes the file.",
        )
    try:
        file = _MountFile.model_validate(strict_json.parse(path.read_bytes()))
    except ValueError as problem:
        what = (
            _first_problem(problem) if isinstance(problem, ValidationError) else in_words(problem)
        )
        raise InputError(
            "mount-unreadable",
            f"The mount file is not what it should be: {what}.",
            where=str(path),
            fix='It needs "T_phone_object" as four rows of four numbers, and "method".',
        ) from None
    covariance = None
    if file.covariance is not None:
        covariance = _covariance(_matrix(file.covariance, 6, "covariance", path), path)
    return Mount(
        T_phone_object=_rigid(_matrix(file.T_phone_object, 4, "T_phone_object", path), path),
        covariance=covariance,
        free=tuple(file.free),
        **{name: getattr(file, name) for name in _AS_IS},
    )


def save_mount(mount: Mount, path: Path) -> None:
    """Write what `load_mount` reads.

    Raises:
        InputError: the file cannot be written; what stood there before stands there still.
    """
    covariance = mount.covariance
    file = _MountFile(
        T_phone_object=mount.T_phone_object.tolist(),
        bounds_95=None if covariance is None else _Bounds(**bounds_95(covariance)._asdict()),
        covariance=None if covariance is None else covariance.tolist(),
        free=list(mount.free),
        **{name: getattr(mount, name) for name in _AS_IS},
    )
    text = file.model_dump_json(indent=2, exclude_defaults=True) + "\n"
    write_whole(path, text)


def _first_problem(problem: ValidationError) -> str:
    error = problem.errors(include_url=False, include_input=False)[0]
    place = ".".join(str(part) for part in error["loc"])
    return f"{place}: {error['msg']}" if place else error["msg"]


def _matrix(
    rows: list[list[float]], size: int, name: str, path: Path
) -> Float64[np.ndarray, "size size"]:
    if [len(row) for row in rows] != [size] * size:
        raise InputError(
            "mount-unreadable",
            f"{name} is not {size} rows of {size} numbers.",
            where=str(path),
            fix="Write the matrix row by row.",
        )
    matrix = np.array(rows, dtype=np.float64)
    if not np.isfinite(matrix).all():
        raise InputError(
            "mount-not-finite",
            f"{name} holds NaN or infinity.",
            where=str(path),
            fix="Calibrate the mount again.",
        )
    return matrix


def _covariance(matrix: Float64[np.ndarray, "6 6"], path: Path) -> Float64[np.ndarray, "6 6"]:
    """The matrix, symmetric to the last bit, or an error when it cannot be a covariance."""
    size = float(np.abs(matrix).max())
    lopsided = float(np.abs(matrix - matrix.T).max())
    if lopsided > 1e-6 * size or np.linalg.eigvalsh(matrix).min() < -1e-6 * size:
        raise InputError(
            "mount-covariance",
            "The covariance is not symmetric with non-negative eigenvalues.",
            where=str(path),
            fix="Calibrate the mount again, or leave the covariance out.",
        )
    return (matrix + matrix.T) / 2


def _rigid(T: Float64[np.ndarray, "4 4"], path: Path) -> Float64[np.ndarray, "4 4"]:
    """T with its rotation made exact, or an error when it is none."""
    R = T[:3, :3]
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    determinant = float(np.linalg.det(R))
    last_row = float(np.abs(T[3] - [0, 0, 0, 1]).max())
    if max(off, abs(determinant + 1), last_row) < _RIGID_TOLERANCE:
        raise InputError(
            "mount-not-rigid",
            "T_phone_object is mirrored: its three axes are those of a left hand (determinant -1).",
            where=str(path),
            fix="Turn the sign of the axis that was counted the wrong way in what wrote the matrix; axes of "
            "a right hand have determinant 1.",
        )
    if max(off, abs(determinant - 1), last_row) > _RIGID_TOLERANCE:
        raise InputError(
            "mount-not-rigid",
            f"T_phone_object is no rigid transform: its axes are off orthonormal by {off:.4g}, its "
            f"determinant is {determinant:.4g} instead of 1, its last row is {T[3].tolist()}.",
            where=str(path),
            fix="Give a rotation and a translation in metres, row by row, last row 0 0 0 1, "
            "without scale or mirror.",
        )
    distance = float(np.linalg.norm(T[:3, 3]))
    if distance > _MAX_OFFSET:
        raise InputError(
            "mount-units",
            f"The mount puts the object {distance:.4g} m from the phone that is clamped to it.",
            where=str(path),
            fix="Give the translation in metres; this looks like millimetres or centimetres.",
        )
    U, _, Vt = np.linalg.svd(R)
    exact = T.copy()
    exact[:3, :3] = U @ Vt
    exact[3] = [0, 0, 0, 1]
    return exact
