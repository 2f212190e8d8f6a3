"""Mount: where the object is in the phone's frame, and the file that says so."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from pydantic import BaseModel, ValidationError

from omomo_core.errors import InputError

_RIGID_TOLERANCE = 1e-3
_MAX_OFFSET = 5.0


@dataclass(frozen=True)
class Mount:
    """The constant pose of the object in the ARKit camera frame of the phone clamped to it."""

    T_phone_object: Float64[np.ndarray, "4 4"]
    """Maps object-frame points into the phone's camera frame (x right, y up, z to the viewer)."""
    method: str
    """How it was found, e.g. "hand-eye"."""
    covariance: Float64[np.ndarray, "6 6"] | None = None
    """Of rotation (rad) then translation (m), in the phone's frame."""
    residuals: dict[str, float] = field(default_factory=dict[str, float])
    """What the method left over, by name with its unit, e.g. {"rms_mm": 3.1}."""
    note: str = ""


class _MountFile(BaseModel):
    T_phone_object: list[list[float]]
    method: str = "given"
    covariance: list[list[float]] | None = None
    residuals: dict[str, float] = {}
    note: str = ""


def identity_mount() -> Mount:
    """The phone's own frame is the object's."""
    return Mount(np.eye(4), "identity")


def load_mount(path: Path) -> Mount:
    """Read mount.json: {"T_phone_object": four rows of four, "method": ...}.

    Raises:
        InputError: "mount-missing", "mount-unreadable", "mount-not-finite", "mount-not-rigid"
            (with the measured deviation) or "mount-units".
    """
    if not path.is_file():
        raise InputError(
            "mount-missing",
            "There is no mount file.",
            where=str(path),
            fix="Calibrate the mount, or write one by hand: "
            '{"T_phone_object": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "method": "measured"}.',
        )
    try:
        file = _MountFile.model_validate_json(path.read_bytes())
    except ValidationError as problem:
        raise InputError(
            "mount-unreadable",
            f"The mount file is not what it should be: {_first_problem(problem)}.",
            where=str(path),
            fix='It needs "T_phone_object" as four rows of four numbers, and "method".',
        ) from None
    covariance = None
    if file.covariance is not None:
        covariance = _matrix(file.covariance, 6, "covariance", path)
    return Mount(
        T_phone_object=_rigid(_matrix(file.T_phone_object, 4, "T_phone_object", path), path),
        method=file.method,
        covariance=covariance,
        residuals=file.residuals,
        note=file.note,
    )


def save_mount(mount: Mount, path: Path) -> None:
    """Write what `load_mount` reads."""
    file = _MountFile(
        T_phone_object=mount.T_phone_object.tolist(),
        method=mount.method,
        covariance=None if mount.covariance is None else mount.covariance.tolist(),
        residuals=mount.residuals,
        note=mount.note,
    )
    path.write_text(file.model_dump_json(indent=2, exclude_none=True) + "\n", encoding="utf-8")


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


def _rigid(T: Float64[np.ndarray, "4 4"], path: Path) -> Float64[np.ndarray, "4 4"]:
    """T with its rotation made exact, or an error when it is none."""
    R = T[:3, :3]
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    determinant = float(np.linalg.det(R))
    last_row = float(np.abs(T[3] - [0, 0, 0, 1]).max())
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
