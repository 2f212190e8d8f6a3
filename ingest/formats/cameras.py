"""What logs say about the camera: 3 x 3 matrices, and one size for all images."""

import numpy as np
from jaxtyping import Float64

from ingest.formats.poses import Place
from omomo_core.errors import InputError


def from_matrices(
    K: Float64[np.ndarray, "frames 3 3"], place: Place
) -> Float64[np.ndarray, "frames 4"]:
    """fx, fy, cx, cy of camera matrices given row by row, in their pixels.

    Raises:
        InputError: "camera-damaged" for a last row that is not 0 0 1 (a transposed matrix) or a
            focal length that is not positive.
    """
    bad = (np.abs(K[:, 2] - [0, 0, 1]) > 1e-3).any(axis=1) | (K[:, 0, 0] <= 0) | (K[:, 1, 1] <= 0)
    if bad.any():
        raise InputError(
            "camera-damaged",
            "The camera matrix is not fx 0 cx / 0 fy cy / 0 0 1 with positive focal lengths.",
            where=place(int(np.argmax(bad))),
            fix="Write it row by row, the principal point in the last column.",
        )
    return np.stack([K[:, 0, 0], K[:, 1, 1], K[:, 0, 2], K[:, 1, 2]], axis=1)


def to_matrix(intrinsics: Float64[np.ndarray, "4"]) -> list[list[float]]:
    """The rows of the camera matrix of fx, fy, cx, cy, for JSON."""
    fx, fy, cx, cy = intrinsics.tolist()
    return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def one_size(sizes: Float64[np.ndarray, "frames 2"], place: Place) -> tuple[int, int]:
    """Width and height, the same in every frame.

    Raises:
        InputError: "image-size" naming the first frame of another size.
    """
    changed = (sizes != sizes[0]).any(axis=1)
    if changed.any():
        row = int(np.argmax(changed))
        raise InputError(
            "image-size",
            f"The images change from {sizes[0, 0]:g} x {sizes[0, 1]:g} to "
            f"{sizes[row, 0]:g} x {sizes[row, 1]:g} pixels.",
            where=place(row),
            fix="Do not join logs: give one take as the app wrote it.",
        )
    return int(sizes[0, 0]), int(sizes[0, 1])


def at_times(
    times: Float64[np.ndarray, " frames"],
    known_times: Float64[np.ndarray, " known"],
    intrinsics: Float64[np.ndarray, "known 4"],
) -> Float64[np.ndarray, "frames 4"]:
    """Intrinsics of images, interpolated to the times of poses; the nearest beyond the ends."""
    columns = [np.interp(times, known_times, column) for column in intrinsics.T]
    return np.stack(columns, axis=1)
