"""A 4x4 matrix in a text or JSON file: a pose, or a similarity."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from omomo_core.errors import InputError
from omomo_core.geometry.transforms import nearest_rotation

_RIGID = 1e-3
_BRACKETS = str.maketrans("[](),;", "      ")
_MAX_CHARACTERS = 100_000


def load_pose(path: Path) -> Float64[np.ndarray, "4 4"]:
    """Read a pose: four lines of four numbers, metres; brackets and commas do not matter.

    Raises:
        InputError: "pose-missing", "pose-unreadable" or "pose-not-rigid" (mirrored, scaled or
            column-major).
    """
    T, scale = load_similarity(path)
    if abs(scale - 1) > _RIGID:
        raise _not_rigid(path, f"it scales by {scale:.4g}")
    return T


def load_similarity(path: Path) -> tuple[Float64[np.ndarray, "4 4"], float]:
    """Read a rigid transform whose rotation may be scaled: the rigid part, and the scale.

    Raises:
        InputError: "pose-missing", "pose-unreadable" or "pose-not-rigid".
    """
    if not path.is_file():
        raise InputError(
            "pose-missing",
            "There is no such file of a pose.",
            where=str(path),
            fix="Check the path.",
        )
    text = path.read_text(encoding="utf-8", errors="replace")[:_MAX_CHARACTERS]
    try:
        values = [float(word) for word in text.translate(_BRACKETS).split()]
        T = np.array(values).reshape(4, 4)
    except ValueError:
        raise InputError(
            "pose-unreadable",
            "The file does not hold four rows of four numbers.",
            where=str(path),
            fix="Write the matrix row by row, metres, last row 0 0 0 1.",
        ) from None
    if not np.isfinite(T).all():
        raise _not_rigid(path, "it holds NaN or infinity")
    determinant = float(np.linalg.det(T[:3, :3]))
    if determinant <= 0:
        raise _not_rigid(path, f"its determinant is {determinant:.3g}")
    scale = float(np.cbrt(determinant))
    R = T[:3, :3] / scale
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > _RIGID or np.abs(T[3] - [0, 0, 0, 1]).max() > _RIGID:
        raise _not_rigid(path, f"axes off orthonormal by {off:.3g}, last row {T[3].tolist()}")
    T[:3, :3], T[3] = nearest_rotation(R), [0, 0, 0, 1]
    return T, scale


def _not_rigid(path: Path, why: str) -> InputError:
    return InputError(
        "pose-not-rigid",
        f"The matrix is no pose: {why}.",
        where=str(path),
        fix="Export it row by row, in metres, from a right-handed frame.",
    )
