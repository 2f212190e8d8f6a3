"""Poses of a board from its corners in pixels, with covariances that hold."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int
from scipy.special import fdtri

from ingest.calibration.board.board_lens import Sightings, first_poses, mirrored, sightings, trusted
from ingest.calibration.board.board_spec import MIN_CORNERS, Grid
from ingest.distributions import chi2_quantile
from ingest.uncertainty import between, moved

_LEAST = 1e-9
"""Part of the information that is added: frames of nonsense show nothing of some direction."""
_ROUNDS = 30
_DONE = 1e-7
"""Radians and metres: a step as small changes nothing."""


@dataclass(frozen=True)
class BoardFit:
    """The pose of the board in each frame, and its residuals."""

    T: Float64[np.ndarray, "frames 4 4"]
    """T_camera_board."""
    off: Float64[np.ndarray, "frames corners"]
    """Pixels between a corner and where the pose puts it; 0 where not seen."""
    cost: Float64[np.ndarray, " frames"]
    """Sum of squares over the corners used, pixels^2."""


def fit(
    sightings: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    start: Float64[np.ndarray, "frames 4 4"],
) -> BoardFit:
    """The poses nearest to `start` at which the corners used reproject best."""
    T = start.copy()
    damping = np.full(len(T), 1e-3)
    cost = _cost(residuals(sightings, T), used)
    open_ = np.ones(len(T), bool)
    for _ in range(_ROUNDS):
        k = np.flatnonzero(open_)
        if len(k) == 0:
            break
        part = sightings.of(k)
        J, r = jacobian(part, T[k]), residuals(part, T[k])
        A, b = _normal(J, r, used[k])
        A[:, range(6), range(6)] *= 1 + damping[k, None]
        even, size = _evened(A)
        step = size * np.linalg.solve(even, (size * b)[..., None])[..., 0]
        tried = moved(T[k], step)
        new = _cost(residuals(part, tried), used[k])
        better = new < cost[k]
        T[k[better]], cost[k[better]] = tried[better], new[better]
        damping[k] *= np.where(better, 0.2, 8.0)
        open_[k] = (np.abs(step).max(axis=1) > _DONE) & (damping[k] < 1e6)
    off = np.linalg.norm(residuals(sightings, T), axis=-1) * sightings.seen
    return BoardFit(T, off, cost)


def covariances(
    sightings: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    T: Float64[np.ndarray, "frames 4 4"],
    sigma: Float64[np.ndarray, " frames"],
) -> Float64[np.ndarray, "frames 6 6"]:
    """Covariances of the poses, for corners with errors of `sigma` pixels along each axis.

    Of `ingest.uncertainty`: rotation (rad), then translation (m), in the camera's axes.
    """
    J = jacobian(sightings, T)
    A, _ = _normal(J, residuals(sightings, T), used)
    even, size = _evened(A)
    return np.linalg.inv(even) * size[:, :, None] * size[:, None, :] * sigma[:, None, None] ** 2


def residuals(
    sightings: Sightings, T: Float64[np.ndarray, "frames 4 4"]
) -> Float64[np.ndarray, "frames corners 2"]:
    """Seen minus projected, pixels; nonsense where not seen."""
    P = sightings.points @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    # A pose that puts the board behind the camera is never better than one in front of it.
    depth = np.where(P[..., 2:] > 1e-6, P[..., 2:], 1e-6)
    return _in_pixels(sightings, sightings.direction - P[..., :2] / depth)


def jacobian(
    sightings: Sightings, T: Float64[np.ndarray, "frames 4 4"]
) -> Float64[np.ndarray, "frames corners 2 6"]:
    """Jacobian of the projection (pixels) by a step of `ingest.uncertainty.moved`."""
    arm = sightings.points @ T[:, :3, :3].swapaxes(1, 2)
    P = arm + T[:, None, :3, 3]
    depth = np.where(P[..., 2:] > 1e-6, P[..., 2:], 1e-6)
    x, y = np.moveaxis(P[..., :2] / depth, -1, 0)
    a, b, c = np.moveaxis(arm, -1, 0)
    one, zero = np.ones_like(x), np.zeros_like(x)
    # d(x/z) and d(y/z) times z: along r (about the board's origin), then along t.
    u = np.stack([-x * b, c + x * a, -b, one, zero, -x], axis=-1)
    v = np.stack([-c - y * b, y * a, a, zero, one, -y], axis=-1)
    slope = np.stack([u, v], axis=-1) / depth[..., None]
    return np.moveaxis(_in_pixels(sightings, np.moveaxis(slope, 2, 0)), 0, -1)


def _in_pixels(
    sightings: Sightings, change: Float64[np.ndarray, "*batch frames corners 2"]
) -> Float64[np.ndarray, "*batch frames corners 2"]:
    """Changes of directions as changes of pixels; written out, which is faster than matrices."""
    A, x, y = sightings.to_pixels, change[..., 0], change[..., 1]
    return np.stack([A[..., 0, 0] * x + A[..., 0, 1] * y, A[..., 1, 0] * x + A[..., 1, 1] * y], -1)


def _normal(
    J: Float64[np.ndarray, "frames corners 2 6"],
    r: Float64[np.ndarray, "frames corners 2"],
    used: Bool[np.ndarray, "frames corners"],
) -> tuple[Float64[np.ndarray, "frames 6 6"], Float64[np.ndarray, "frames 6"]]:
    rows = (J * used[..., None, None]).reshape(len(J), 2 * used.shape[1], 6)
    turned = rows.swapaxes(1, 2)
    return turned @ rows, (turned @ r.reshape(len(J), 2 * used.shape[1], 1))[..., 0]


def _evened(
    A: Float64[np.ndarray, "frames 6 6"],
) -> tuple[Float64[np.ndarray, "frames 6 6"], Float64[np.ndarray, "frames 6"]]:
    """A with ones on its diagonal, which can be inverted whatever the scales; and the scales."""
    size = 1 / np.sqrt(np.einsum("fii->fi", A) + 1e-300)
    return A * size[:, :, None] * size[:, None, :] + _LEAST * np.eye(6), size


def _cost(
    r: Float64[np.ndarray, "frames corners 2"], used: Bool[np.ndarray, "frames corners"]
) -> Float64[np.ndarray, " frames"]:
    return ((r * r).sum(axis=2) * used).sum(axis=1)


_SUSPECT = 1.0
"""Pixels rms above which a frame is searched for wrong corners."""
_TAIL = 2.5
"""The farthest corner by the median one is mostly less than that where all err alike."""
_SHARP = 0.05
"""Pixels: no camera places corners better than that."""
_LOST, _BLURRED = 2.0, 4.0
"""A frame whose corners err by more pixels, and so many times more than usual, is left out."""
_PRIOR = 10.0
"""Degrees of freedom that the noise of all frames counts in each."""
_SURE = 16.0
"""Likelihood (chi-square) by which the second pose must be worse; 1 : 3,000."""
_SAME = np.radians(0.3)
_LOOSE = np.radians(2.0)
"""Radians (one sigma): beyond, the errors of a pose are not normal."""
_GATE, _MEDIAN = 3.7, 1.1774
"""Bounds of 999 of 1,000 errors, and of half of them, in sigmas, as in `board_lens`."""


@dataclass(frozen=True)
class BoardPoses:
    """The pose of the board in each frame that shows enough of it."""

    frames: Int[np.ndarray, " poses"]
    """Which of the frames given; those with too few corners, or all in a line, are left out."""
    T_camera_board: Float64[np.ndarray, "poses 4 4"]
    """OpenCV's camera axes (x right, y down, z ahead); the frame of `Grid`."""
    covariance: Float64[np.ndarray, "poses 6 6"]
    """Covariance as in `ingest.uncertainty`: rotation (rad), then translation (m), in the camera's axes.
    For independent errors of the corners: errors of the intrinsics or of the printed size are
    shared by all frames and not in it."""
    rms: Float64[np.ndarray, " poses"]
    """Distance between corners and their reprojection, pixels."""
    corners: Int[np.ndarray, " poses"]
    """Number of corners used."""
    ambiguous: Bool[np.ndarray, " poses"]
    """The tilt is not known: the board tilted the other way explains the corners as well, or
    nearly, or any tilt does; the covariance does not hold."""
    sigma: float
    """Error of a corner along each axis as estimated from all frames, pixels."""


def board_poses(
    pixels: Sequence[Float64[np.ndarray, "_ 2"]],
    numbers: Sequence[Int[np.ndarray, " _"]],
    board: Grid,
    K: Float64[np.ndarray, "*frames 3 3"],
    distortion: Float64[np.ndarray, " coefficients"],
) -> BoardPoses:
    """The board's pose in each frame.

    Both poses that a flat board has are refined and the better one is kept; corners that contradict
    the others are left out (fewer than half may). The noise of the corners is estimated from what
    is left over, mostly over all frames together.

    Args:
        pixels: of the corners seen in each frame; (0, 0) is the centre of the first pixel.
        numbers: of the same corners, as in `Grid.corners`.
        board: which board it is.
        K: camera matrix of all frames, or of each.
        distortion: OpenCV's coefficients.
    """
    seen, where = _table(pixels, numbers, len(board.corners))
    frames = np.flatnonzero(_enough(seen, board))
    own = K if K.ndim == 2 else K[frames]
    sight = sightings(board.corners, seen[frames], where[frames], own, distortion)
    best, other, used = _fits(sight)
    in_front = (best.T[:, 2, :3] @ sight.points.T + best.T[:, 2, 3:] > 0).all(axis=1)
    variance = best.cost / (2 * used.sum(axis=1) - 6).clip(1)
    pooled = max(float(np.median(variance)) if len(frames) else 0.0, _SHARP**2)
    clear = variance < np.maximum(_LOST**2, _BLURRED**2 * pooled)
    good = np.flatnonzero(in_front & clear & _enough(used, board))
    sight, used, cost = sight.of(good), used[good], best.cost[good]
    freedom = 2.0 * used.sum(axis=1) - 6
    sigma = np.sqrt((cost + _PRIOR * pooled) / (freedom + _PRIOR))
    # The noise is estimated too: chi-square's 95 % become those of F.
    growth = 6 * fdtri(6, freedom + _PRIOR, 0.95) / chi2_quantile(0.95, 6)
    turn = np.einsum("fij,fij->f", best.T[good, :3, :3], other.T[good, :3, :3])
    angle = np.arccos(((turn - 1) / 2).clip(-1, 1))
    two = ((other.cost[good] - cost) / sigma**2 < _SURE) & (angle > _SAME)
    covariance = _honest(sight, used, best.T[good], sigma) * growth[:, None, None]
    loose = np.linalg.eigvalsh(covariance[:, :3, :3])[:, -1] > _LOOSE**2
    return BoardPoses(
        frames=frames[good],
        T_camera_board=best.T[good],
        covariance=covariance,
        rms=np.sqrt(cost / used.sum(axis=1)),
        corners=used.sum(axis=1),
        ambiguous=two | loose,
        sigma=pooled**0.5,
    )


def _honest(
    sight: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    T: Float64[np.ndarray, "frames 4 4"],
    sigma: Float64[np.ndarray, " frames"],
) -> Float64[np.ndarray, "frames 6 6"]:
    """Covariances with the tilt taken one sigma smaller than found, down to none.

    Noise makes a board look tilted, and a tilted board shows its tilt better: at the pose found, a
    nearly frontal board would seem to be known better than it is.
    """
    to_other = between(T, mirrored(T, sight.points.mean(axis=0)))
    turn = np.linalg.norm(to_other[:, :3], axis=1)
    axis = to_other[:, :3] / np.maximum(turn, 1e-12)[:, None]
    plain = covariances(sight, used, T, sigma)
    spread = np.sqrt(np.einsum("fi,fij,fj->f", axis, plain[:, :3, :3], axis))
    share = np.minimum(spread / np.maximum(turn, 1e-12), 0.5)
    return covariances(sight, used, moved(T, share[:, None] * to_other), sigma)


def _table(
    pixels: Sequence[Float64[np.ndarray, "_ 2"]],
    numbers: Sequence[Int[np.ndarray, " _"]],
    count: int,
) -> tuple[Bool[np.ndarray, "frames count"], Float64[np.ndarray, "frames count 2"]]:
    """One row per frame, one column per corner of the board."""
    seen = np.zeros((len(numbers), count), bool)
    where = np.zeros((len(numbers), count, 2))
    frame = np.repeat(np.arange(len(numbers)), [len(n) for n in numbers])
    if len(frame):
        number = np.concatenate([np.asarray(n) for n in numbers])
        seen[frame, number] = True
        where[frame, number] = np.concatenate([np.reshape(p, (-1, 2)) for p in pixels])
    return seen, where


def _enough(used: Bool[np.ndarray, "frames corners"], board: Grid) -> Bool[np.ndarray, " frames"]:
    """Whether there are corners enough, and two in each direction."""
    grid = used.reshape(-1, board.rows - 1, board.columns - 1)
    across, down = ((grid.any(axis=axis).sum(axis=1) >= 2) for axis in (1, 2))
    return (used.sum(axis=1) >= MIN_CORNERS) & across & down


def _fits(sight: Sightings) -> tuple[BoardFit, BoardFit, Bool[np.ndarray, "frames corners"]]:
    """The best pose of each frame, the second one, and the corners they rest on."""
    used = sight.seen.copy()
    start = first_poses(sight, used)
    rough = fit(sight, used, start)
    suspect = np.flatnonzero(_uneven(rough, used))
    used[suspect] = trusted(sight.of(suspect), np.random.default_rng(0))
    start = rough.T
    # Fewer than four would be no homography: such a frame is given up later.
    searched = suspect[used[suspect].sum(axis=1) >= 4]
    start[searched] = first_poses(sight.of(searched), used[searched])
    best, other = _both(sight, used, start, start)
    used = _agreeing(best, sight.seen)
    best, other = _both(sight, used, best.T, other.T)
    return best, other, used


def _uneven(
    rough: BoardFit, seen: Bool[np.ndarray, "frames corners"]
) -> Bool[np.ndarray, " frames"]:
    """Whether the corners of a frame do not err as noise does: some are much farther off."""
    off = np.where(seen, rough.off, np.inf)
    middle = np.sort(off, axis=1)[np.arange(len(off)), seen.sum(axis=1) // 2]
    large = rough.cost > _SUSPECT**2 * seen.sum(axis=1)
    return large & (rough.off.max(axis=1, initial=0) > _TAIL * middle)


def _both(
    sight: Sightings,
    used: Bool[np.ndarray, "frames corners"],
    first: Float64[np.ndarray, "frames 4 4"],
    second: Float64[np.ndarray, "frames 4 4"],
) -> tuple[BoardFit, BoardFit]:
    """The better and the worse of the two poses of a flat board."""
    one = fit(sight, used, first)
    two = fit(
        sight, used, mirrored(one.T, sight.points.mean(axis=0)) if second is first else second
    )
    swap = two.cost < one.cost
    return _chosen(swap, two, one), _chosen(swap, one, two)


def _chosen(pick: Bool[np.ndarray, " frames"], yes: BoardFit, no: BoardFit) -> BoardFit:
    return BoardFit(
        np.where(pick[:, None, None], yes.T, no.T),
        np.where(pick[:, None], yes.off, no.off),
        np.where(pick, yes.cost, no.cost),
    )


def _agreeing(
    best: BoardFit, seen: Bool[np.ndarray, "frames corners"]
) -> Bool[np.ndarray, "frames corners"]:
    """Corners no farther off than their frame's noise allows, by the median of their distances."""
    off = np.where(seen, best.off, np.inf)
    count = seen.sum(axis=1)
    middle = np.sort(off, axis=1)[np.arange(len(off)), count // 2]
    own = middle / _MEDIAN * np.sqrt(2 * count / (2 * count - 6))
    usual = np.median(own) if len(own) else 0.0
    return off < _GATE * np.maximum(own, max(usual, _SHARP))[:, None]
