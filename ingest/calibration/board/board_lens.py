"""The lens of a camera that filmed a board: distortion, homographies and self-calibration."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int

from ingest.calibration.board.board_spec import Grid
from ingest.calibration.board.camera_file import WitnessCamera
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import nearest_rotation

_STEP = 1e-5
_NEWTON = 3


@dataclass(frozen=True)
class Sightings:
    """Points of a board seen in frames, one column for each of its points."""

    points: Float64[np.ndarray, "corners 3"]
    """In the board's frame, metres."""
    seen: Bool[np.ndarray, "frames corners"]
    direction: Float64[np.ndarray, "frames corners 2"]
    """x/z and y/z in the camera (OpenCV's axes), lens undone; 0 where not seen."""
    to_pixels: Float64[np.ndarray, "frames corners 2 2"]
    """Maps small changes of a direction to pixels."""

    def of(self, frames: np.ndarray) -> "Sightings":
        """These frames only (indices or mask)."""
        return Sightings(
            self.points, self.seen[frames], self.direction[frames], self.to_pixels[frames]
        )


def sightings(
    points: Float64[np.ndarray, "corners 3"],
    seen: Bool[np.ndarray, "frames corners"],
    pixels: Float64[np.ndarray, "frames corners 2"],
    K: Float64[np.ndarray, "*frames 3 3"],
    distortion: Float64[np.ndarray, " coefficients"],
) -> Sightings:
    """Undo the lens.

    Args:
        points: of the board, metres.
        seen: whether a frame shows a point.
        pixels: where (any value where not seen).
        K: of all frames, or of each; skew is left out.
        distortion: OpenCV's coefficients, of any of its number; none or zeros for no distortion.
    """
    focal = np.broadcast_to(np.diagonal(K, axis1=-2, axis2=-1)[..., :2], (len(seen), 2))
    centre = np.broadcast_to(K[..., :2, 2], (len(seen), 2))
    bent = np.where(seen[..., None], (pixels - centre[:, None]) / focal[:, None], 0.0)
    to_pixels = np.zeros((*seen.shape, 2, 2))
    to_pixels[...] = focal[:, None, :, None] * np.eye(2)
    if not distortion.any():
        return Sightings(points, seen, bent, to_pixels)
    direction = bent.copy()
    direction[seen], slope = undistorted(bent[seen], distortion)
    to_pixels[seen] = to_pixels[seen] @ slope
    return Sightings(points, seen, direction, to_pixels)


def undistorted(
    bent: Float64[np.ndarray, "n 2"], distortion: Float64[np.ndarray, " coefficients"]
) -> tuple[Float64[np.ndarray, "n 2"], Float64[np.ndarray, "n 2 2"]]:
    """Directions whose distorted ones are given, and the slope of the distortion there.

    OpenCV stops after five rounds, which leaves tenths of a pixel in strong lenses; Newton's steps
    finish its work.
    """
    if len(bent) == 0:
        return np.empty((0, 2)), np.empty((0, 2, 2))
    start = cv2.undistortPoints(bent.reshape(-1, 1, 2), np.eye(3), distortion)
    direction = np.asarray(start, float).reshape(-1, 2)
    slope = np.empty((len(bent), 2, 2))
    for _ in range(_NEWTON):
        for axis in range(2):
            step = _STEP * np.eye(2)[axis]
            rise = distorted(direction + step, distortion) - distorted(direction - step, distortion)
            slope[:, :, axis] = rise / (2 * _STEP)
        miss = bent - distorted(direction, distortion)
        direction = direction + np.linalg.solve(slope, miss[..., None])[..., 0]
    return direction, slope


def distorted(
    direction: Float64[np.ndarray, "n 2"], distortion: Float64[np.ndarray, " coefficients"]
) -> Float64[np.ndarray, "n 2"]:
    """Directions x/z, y/z after the lens's distortion (OpenCV's model)."""
    if len(direction) == 0:
        return direction
    rays = np.concatenate([direction, np.ones((len(direction), 1))], axis=1)
    zero = np.zeros(3)
    bent = cv2.projectPoints(rays, zero, zero, np.eye(3), distortion)[0]
    return np.asarray(bent, float).reshape(-1, 2)


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


_CORNERS = 10
_VIEWS, _ENOUGH = 40, 8
_DIFFERENT = 0.04
"""Widths of the picture by which views differ (all four corners of the board together) to count."""
_FLAGS = cv2.CALIB_FIX_K3
"""k1, k2, p1 and p2: left out, p1 and p2 would make the centre look surer than it is."""
_MAX_RMS = 2.0
_MAX_FOCAL, _MAX_CENTRE = 0.01, 0.02
"""One sigma of the focal lengths as a part of them, of the centre as a part of the width."""
_WILD = 3.0


def calibrate_camera(
    pixels: Sequence[Float64[np.ndarray, "_ 2"]],
    numbers: Sequence[Int[np.ndarray, " _"]],
    board: Grid,
    size: tuple[int, int],
) -> WitnessCamera:
    """Focal lengths, centre, k1 and k2 from views of the board (Zhang 2000), with their sigmas.

    Up to 40 views that differ most are used.

    Args:
        pixels, numbers: corners of each picture.
        board: which board it is; a wrong size of its squares does not matter here.
        size: width and height of the pictures.

    Raises:
        InputError: "camera-calibration" when views are too few or too alike to tell, or do not fit.
    """
    views = [
        (np.asarray(p, np.float32).reshape(-1, 1, 2), board.corners[n].astype(np.float32))
        for p, n in zip(pixels, numbers, strict=True)
        if len(n) >= _CORNERS and _spread(n, board)
    ]
    if len(views) < _ENOUGH:
        raise _refusal(f"only {len(views)} pictures show {_CORNERS} corners or more")
    picked = [views[i] for i in _diverse([_outline(*v, board, size) for v in views])]
    if len(picked) < _ENOUGH:
        raise _refusal(f"the views are too alike: only {len(picked)} of {len(views)} differ")
    _, _, _, _, errors = _solve(picked, size)
    kept = [v for v, e in zip(picked, errors, strict=True) if e <= _WILD * np.median(errors)]
    rms, K, lens, sigmas, _ = _solve(kept, size)
    if rms > _MAX_RMS:
        raise _refusal(f"the corners are {rms:.1f} px off the best camera")
    loose = max(sigmas[0] / K[0, 0], sigmas[1] / K[1, 1])
    if loose > _MAX_FOCAL or max(sigmas[2:]) > _MAX_CENTRE * size[0]:
        raise _refusal(
            f"the views are too alike: the focal length is known to {100 * loose:.1f} %, the "
            f"centre to {max(sigmas[2:]):.0f} px (one sigma)"
        )
    return WitnessCamera(
        fx=float(K[0, 0]),
        fy=float(K[1, 1]),
        cx=float(K[0, 2]),
        cy=float(K[1, 2]),
        distortion=tuple(float(k) for k in lens),
        size=size,
        sigmas=(sigmas[0], sigmas[1], sigmas[2], sigmas[3]),
        source=f"calibrated from {len(kept)} views of the board, {rms:.2f} px rms",
    )


View = tuple[np.ndarray, np.ndarray]


def _solve(
    views: Sequence[View], size: tuple[int, int]
) -> tuple[float, np.ndarray, np.ndarray, list[float], np.ndarray]:
    """rms (px), camera matrix, coefficients, sigmas of fx fy cx cy, rms of each view."""
    guess = cv2.initCameraMatrix2D([p for _, p in views], [c for c, _ in views], size)
    try:
        rms, K, lens, _, _, sigmas, _, errors = cv2.calibrateCameraExtended(
            [p for _, p in views],
            [c for c, _ in views],
            size,
            np.asarray(guess, float),
            np.zeros(5),
            flags=_FLAGS | cv2.CALIB_USE_INTRINSIC_GUESS,
        )
    except cv2.error:
        raise _refusal("no camera explains the views") from None
    deviations = [float(s) for s in np.ravel(sigmas)[:4]]
    return float(rms), np.asarray(K, float), np.ravel(lens), deviations, np.ravel(errors)


def _spread(numbers: Int[np.ndarray, " corners"], board: Grid) -> bool:
    """Whether there are corners of two columns and two rows."""
    across, down = numbers % (board.columns - 1), numbers // (board.columns - 1)
    return bool(np.ptp(across) > 0 and np.ptp(down) > 0)


def _outline(
    corners: np.ndarray, points: np.ndarray, board: Grid, size: tuple[int, int]
) -> Float64[np.ndarray, "8"]:
    """Return the board's four outer corners in the picture, in widths: they tell the whole view."""
    H, _ = cv2.findHomography(points[:, :2], corners.reshape(-1, 2))
    outer = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [board.width, board.height]
    mapped = np.concatenate([outer, np.ones((4, 1))], axis=1) @ np.asarray(H, float).T
    return np.clip(mapped[:, :2] / mapped[:, 2:] / size[0], -3, 3).ravel()


def _diverse(outlines: Sequence[Float64[np.ndarray, "8"]]) -> list[int]:
    """Views as different as possible: each next one is the farthest from those taken.

    Many of the same view would make the camera look surer than it is.
    """
    shapes = np.stack(outlines)
    far = np.linalg.norm(shapes - shapes.mean(axis=0), axis=1)
    taken = [int(far.argmax())]
    far = np.linalg.norm(shapes - shapes[taken[0]], axis=1)
    while len(taken) < _VIEWS and far.max() > _DIFFERENT:
        taken.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(shapes - shapes[taken[-1]], axis=1))
    return taken


def _refusal(why: str) -> InputError:
    return InputError(
        "camera-calibration",
        f"The camera cannot be calibrated from this video: {why}.",
        fix="Tilt the board 30 to 45 degrees to all four sides, near and far, and bring it into the "
        "corners of the picture; or give the camera's intrinsics as a file.",
    )
