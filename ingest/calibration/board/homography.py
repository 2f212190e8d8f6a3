"""First poses of a flat board from its homographies, many frames at once."""

import numpy as np
from jaxtyping import Bool, Float64

from ingest.calibration.board.lens import Sightings
from omomo_core.geometry.transforms import nearest_rotation

_SAMPLES = 40
"""With 30 % of wrong corners, one sample in four is clean."""
_CHUNK = 128
_MEDIAN = 1.1774
"""Median distance of a normal error in the plane, in sigmas of one axis."""
_GATE = 3.7
"""999 of 1,000 normal errors in the plane are within so many sigmas."""


def first_poses(
    sightings: Sightings, used: Bool[np.ndarray, "frames corners"]
) -> Float64[np.ndarray, "frames 4 4"]:
    """T_camera_board that fits the corners used, roughly: direct linear transform, taken apart."""
    free = _homographies(sightings, used)
    size = np.linalg.norm(free[:, :, :2], axis=1).mean(axis=1)
    middle = sightings.points.mean(axis=0)[:2]
    ahead = np.sign(free[:, 2, :2] @ middle + free[:, 2, 2])
    H = free * (ahead / size)[:, None, None]
    axes = np.stack([H[..., 0], H[..., 1], np.cross(H[..., 0], H[..., 1])], axis=-1)
    T = np.tile(np.eye(4), (len(H), 1, 1))
    T[:, :3, :3] = nearest_rotation(axes)
    T[:, :3, 3] = H[..., 2]
    return T


def mirrored(
    T_camera_board: Float64[np.ndarray, "frames 4 4"], middle: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "frames 4 4"]:
    """The other pose that looks the same where perspective is weak: tilted the other way.

    The depths about the board's middle change their sign (Schweighofer and Pinz 2006).
    """
    R, t = T_camera_board[:, :3, :3], T_camera_board[:, :3, 3]
    centre = R @ middle + t
    view = centre / np.linalg.norm(centre, axis=1, keepdims=True)
    flipped = np.eye(3) - 2 * view[:, :, None] * view[:, None, :]
    T = T_camera_board.copy()
    T[:, :3, :3] = flipped @ R @ np.diag([1.0, 1.0, -1.0])
    T[:, :3, 3] = centre - T[:, :3, :3] @ middle
    return T


def trusted(sightings: Sightings, rng: np.random.Generator) -> Bool[np.ndarray, "frames corners"]:
    """Corners that agree with the homography that most of them agree with.

    Least median of squares over samples of four (Rousseeuw 1984): fewer than half may be wrong,
    and no threshold is needed.
    """
    chunks = range(0, len(sightings.seen), _CHUNK)
    out = [
        _trusted(sightings.of(np.arange(i, i + _CHUNK)[: len(sightings.seen) - i]), rng)
        for i in chunks
    ]
    return np.concatenate([sightings.seen[:0], *out])


def _trusted(sightings: Sightings, rng: np.random.Generator) -> Bool[np.ndarray, "frames corners"]:
    seen = sightings.seen
    frames, corners = seen.shape
    # The four of smallest random number among those seen.
    draw = rng.random((frames, _SAMPLES, corners)) + 2.0 * ~seen[:, None]
    picks = np.argpartition(draw, 4, axis=-1)[..., :4]
    flat = np.concatenate([sightings.points[:, :2], np.ones((corners, 1))], axis=1)
    rays = np.concatenate([sightings.direction, np.ones((frames, corners, 1))], axis=2)
    board = _basis(flat[picks])
    image = _basis(rays[np.arange(frames)[:, None, None], picks])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        H = image @ _adjugate(board)
        mapped = flat @ H.swapaxes(-1, -2)
        off = mapped[..., :2] / mapped[..., 2:] - sightings.direction[:, None]
        A, x, y = sightings.to_pixels[:, None], off[..., 0], off[..., 1]
        far = np.hypot(A[..., 0, 0] * x + A[..., 0, 1] * y, A[..., 1, 0] * x + A[..., 1, 1] * y)
        far = np.where(seen[:, None], far, np.inf)
    # Three points in a line give no homography but NaN or infinity.
    far = np.nan_to_num(far, nan=np.inf)
    count = seen.sum(axis=1)
    middle = np.sort(far, axis=-1)[np.arange(frames), :, count // 2]
    best = middle.argmin(axis=1)
    sigma = middle[np.arange(frames), best] / _MEDIAN * (1 + 5 / (2 * count - 7))
    return far[np.arange(frames), best] < _GATE * np.maximum(sigma, 0.1)[:, None]


def _homographies(
    sightings: Sightings, used: Bool[np.ndarray, "frames corners"]
) -> Float64[np.ndarray, "frames 3 3"]:
    """Least squares on coordinates brought to the size of 1 (Hartley 1997)."""
    corners = used.shape[1]
    xy, to_board = _normalised(np.broadcast_to(sightings.points[:, :2], (*used.shape, 2)), used)
    uv, to_image = _normalised(sightings.direction, used)
    one, zero = np.ones((*used.shape, 1)), np.zeros((*used.shape, 3))
    flat = np.concatenate([xy, one], axis=2)
    top = np.concatenate([flat, zero, -uv[..., :1] * flat], axis=2)
    bottom = np.concatenate([zero, flat, -uv[..., 1:] * flat], axis=2)
    A = np.concatenate([top, bottom], axis=1) * np.tile(used, 2).reshape(-1, 2 * corners, 1)
    _, vectors = np.linalg.eigh(A.swapaxes(1, 2) @ A)
    H = vectors[..., 0].reshape(-1, 3, 3)
    return np.linalg.inv(to_image) @ H @ to_board


def _normalised(
    points: Float64[np.ndarray, "frames corners 2"], used: Bool[np.ndarray, "frames corners"]
) -> tuple[Float64[np.ndarray, "frames corners 2"], Float64[np.ndarray, "frames 3 3"]]:
    """Points about 0 with spread 1, and the matrix that makes them so."""
    share = used / used.sum(axis=1, keepdims=True)
    middle = np.einsum("fc,fci->fi", share, points)
    off = points - middle[:, None]
    scale = np.einsum("fc,fci->f", share, off**2) ** -0.5
    T = np.tile(np.eye(3), (len(points), 1, 1))
    T[:, :2, 2] = -scale[:, None] * middle
    T[:, [0, 1], [0, 1]] = scale[:, None]
    return off * scale[:, None, None], T


def _basis(points: Float64[np.ndarray, "*batch 4 3"]) -> Float64[np.ndarray, "*batch 3 3"]:
    """The matrix that maps unit vectors to the first three points and their sum to the fourth."""
    M = points[..., :3, :].swapaxes(-1, -2)
    return M * (_adjugate(M) @ points[..., 3, :, None]).swapaxes(-1, -2)


def _adjugate(M: Float64[np.ndarray, "*batch 3 3"]) -> Float64[np.ndarray, "*batch 3 3"]:
    """The inverse times the determinant, which exists for every matrix."""
    a, b, c = M[..., 0], M[..., 1], M[..., 2]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)
