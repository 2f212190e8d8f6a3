"""The mount from two trackers of one motion: closed form, refinement, checks."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.hand_eye_guess import Offset, find_offsets, first_guess, motions
from ingest.calibration.hand_eye.hand_eye_model import (
    HandEyeFit,
    PoseStream,
    Samples,
    matched,
    paired,
    world,
)
from ingest.calibration.hand_eye.hand_eye_refine import (
    Drift,
    check_drift,
    drift_of,
    mount_covariance,
    refine,
    undrifted,
)
from ingest.calibration.posterior import TILT_IT, OpenDirection, open_directions
from ingest.uncertainty import moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_LEAST_TURN = np.radians(8.0)
_MOST_WILD = 0.45
_LOOSE_DEG, _LOOSE_MM = 4.0, 80.0
"""Rms errors of two good trackers of one thing stay well below these."""
_MOST_WALK = np.array([np.radians(1.5), 0.04])
"""Drift of no tracker that works, rad and m in the square root of a second."""
_DOUBTFUL = np.array([np.radians(1.5), 0.03])
"""Rms errors, before drift is taken out, at which other readings are tried."""
_CLEARLY = 0.4
"""Another reading is the right one if it leaves this part of the error or less."""
_FAR = 2.0
"""Metres from the phone beyond which nothing is clamped to it."""
LEAST_SAMPLES = 8
"""Moments that both trackers must know."""

Gather = Callable[[PoseStream, PoseStream], Samples]
"""Pairs two streams' poses of the same moments."""


Poses = Float64[np.ndarray, "poses 4 4"]


@dataclass(frozen=True)
class OtherReading:
    """A common mistake in a file of poses, and the function that undoes it."""

    fault: str
    fix: str
    read: Callable[[Poses], Poses]


def check_turns(phone: PoseStream) -> None:
    """Refuse a phone that hardly turned: "calibration-turns"."""
    R = Rotation.from_matrix(phone.T[:: max(1, len(phone.T) // 400), :3, :3])
    most = float((R[len(R) // 2].inv() * R).magnitude().max())
    if most < _LEAST_TURN:
        raise InputError(
            "calibration-turns",
            f"The phone turned by {np.degrees(most):.1f} deg at most: without turning, the place "
            "of the object (right, up and ahead of the camera) cannot be seen.",
            fix="Record again and turn the object by 30 to 60 degrees about two directions.",
        )


def short() -> InputError:
    """The error when too few poses of both trackers coincide."""
    return InputError(
        "calibration-short",
        f"Both trackers saw the object together in fewer than {LEAST_SAMPLES} poses.",
        fix="Record 20 seconds or more in which the witness camera sees the board.",
    )


def other_motion(offset: Offset) -> InputError:
    """The error when the two trackers followed different motions."""
    return InputError(
        "calibration-clocks",
        "The phone and the other tracker never turn alike, whatever the offset of their clocks "
        f"(best correlation {offset.correlation:.2f}, it should be above 0.9).",
        fix="Use recordings of one and the same motion; turn the object briskly a few times, about "
        "different directions, while both record.",
    )


def moves_as_one(fit: HandEyeFit) -> bool:
    """Whether the mount explains most of the samples, and closely."""
    mm, deg = rms(fit)
    close = deg < _LOOSE_DEG and mm < _LOOSE_MM
    return bool(1 - fit.kept.mean() < _MOST_WILD and close and (fit.walk < _MOST_WALK).all())


def rms(fit: HandEyeFit) -> tuple[float, float]:
    """Root mean square of the residuals of the samples kept: mm, deg."""
    square = (fit.errors[fit.kept] ** 2).reshape(-1, 2, 3).sum(axis=-1).mean(axis=0)
    return 1e3 * float(np.sqrt(square[1])), float(np.degrees(np.sqrt(square[0])))


def check_fit(
    fit: HandEyeFit, samples: Samples, streams: tuple[PoseStream, PoseStream], gather: Gather
) -> None:
    """Refuse trackers that do not move as one rigid body; the error names another reading that would fit."""
    one = moves_as_one(fit)
    if not one or (undrifted(fit, samples) > _DOUBTFUL).any():
        left = _loose(samples)
        whose, reading = _better_reading(left, *streams, gather)
        if reading is not None:
            raise InputError("calibration-stream", f"{whose} {reading.fault}.", fix=reading.fix)
    if not one:
        raise _apart(fit)
    check_drift(drift_of(fit, samples), fit, samples)
    far = float(np.linalg.norm(fit.T_phone_target[:3, 3]))
    if far > _FAR:
        raise InputError(
            "calibration-far",
            f"The target would be {far:.1f} m from the phone that is clamped to the same object.",
            fix="Look whether both streams are inverted (each must map the moving thing into its "
            "resting frame), and whether both are in metres.",
        )


def _apart(fit: HandEyeFit) -> InputError:
    mm, deg = rms(fit)
    walk = fit.walk * [np.degrees(1), 1e3]
    return InputError(
        "calibration-apart",
        f"The phone and the target do not move as one thing: {mm:.0f} mm and {deg:.1f} deg are left "
        f"over, one runs away from the other by {walk[1]:.0f} mm and {walk[0]:.1f} deg in a second, "
        f"and {100 * (1 - fit.kept.mean()):.0f} % of the moments do not fit at all.",
        fix="Look whether the clamp or the board moved on the object, whether the board's squares "
        "have the size that was given, and whether both files are of one recording.",
    )


def _better_reading(
    left: float,
    phone: PoseStream,
    target: PoseStream,
    gather: Gather,
) -> tuple[str, OtherReading | None]:
    """The other reading of one of the streams that fits by far the best, if there is one."""
    found: list[tuple[float, str, OtherReading]] = []
    for reading in _READINGS:
        again = replace(phone, T=reading.read(phone.T))
        by_phone = _loose(gather(again, target))
        again = replace(target, T=reading.read(target.T))
        by_target = _loose(gather(phone, again))
        whose = "The phone's stream" if by_phone < by_target else "The target's stream"
        if min(by_phone, by_target) > _CLEARLY * max(by_phone, by_target):
            whose = "The phone's stream or the target's"
        found.append((min(by_phone, by_target), whose, reading))
    best, whose, reading = min(found, key=lambda each: each[0])
    return whose, reading if best < _CLEARLY * left else None


def _loose(samples: Samples) -> float:
    """Residual of the closed form, in radians: the median over relative motions."""
    rng = np.random.default_rng(0)
    moved = motions(samples, rng)
    if len(moved.A) < LEAST_SAMPLES:
        return np.inf
    X = first_guess(moved, rng)
    left, right = moved.A @ X, X @ moved.B
    turn = left[:, :3, :3] @ right[:, :3, :3].swapaxes(-1, -2)
    shift = np.linalg.norm(left[:, :3, 3] - right[:, :3, 3], axis=1)
    return float(np.median(Rotation.from_matrix(turn).magnitude() + shift))


def _order(T: Poses, order: list[int]) -> Poses:
    """The rotations if the numbers of their quaternions stood in another order."""
    out = T.copy()
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    out[:, :3, :3] = Rotation.from_quat(quaternion[:, order]).as_matrix()
    return out


def _turned_back(T: Poses) -> Poses:
    out = T.copy()
    out[:, :3, :3] = T[:, :3, :3].swapaxes(-1, -2)
    return out


def _mirrored(T: Poses) -> Poses:
    flip = np.diag([1.0, 1.0, -1.0, 1.0])
    return flip @ T @ flip


_READINGS = (
    OtherReading(
        "is inverted",
        "Its poses must map the moving thing's points into the resting frame; invert each.",
        inverse,
    ),
    OtherReading(
        "has quaternions with w first, read as if x were first",
        "Write quaternions as x, y, z, w.",
        lambda T: _order(T, [1, 2, 3, 0]),
    ),
    OtherReading(
        "has quaternions with x first, read as if w were first",
        "Write quaternions as x, y, z, w.",
        lambda T: _order(T, [3, 0, 1, 2]),
    ),
    OtherReading(
        "has its rotations inverted but not its positions",
        "Give both of the moving thing in the resting frame.",
        _turned_back,
    ),
    OtherReading(
        "is mirrored (left-handed)",
        "Turn the left-handed axes of its program (Unity, Unreal) into right-handed ones.",
        _mirrored,
    ),
)


_BELONG = 0.4
"""Least correlation of two clocks' turning speeds."""
_SHOWN = 3.0
"""Standard deviations from which on a direction that counts as open shows something all the same."""
_ALIKE = np.array([np.radians(0.1)] * 3 + [0.001] * 3)
"""Errors that a tracker makes alike through a recording, so that it cannot show them: its lens, its
frame, the place of its markers; rad and m on each axis, for a tracker that does not tell."""
_UPRIGHT = np.cos(np.radians(8.0))


@dataclass(frozen=True)
class HandEye:
    """The pose of the tracked target in the phone's frame, with its covariance and residuals."""

    T_phone_target: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Rotation (rad), translation (m) in the phone's axes; wide along `open`."""
    open: tuple[OpenDirection, ...]
    """What the motion did not show."""
    T_world_camera: Float64[np.ndarray, "n 4 4"]
    """Pose of the other tracker in the phone's world, which drifts, at each sample."""
    offset: float
    """Seconds to add to the target's times to get the phone's."""
    correlation: float
    """Correlation of the turning speeds at that offset; 1 for poses that belong together one by one."""
    rms_mm: float
    rms_deg: float
    """Over the samples kept, in the phone's world, the drift taken out."""
    rest_mm: float
    rest_deg: float
    """The same with the phone's world held still."""
    drift: Drift
    """What was taken out."""
    scale: float
    """Part by which the phone's distances are shorter than the target's tracker's."""
    kept: Bool[np.ndarray, " n"]
    """False where a sample was wild."""
    times: Float64[np.ndarray, " n"]
    """Times of the samples, on the target's clock."""


def solve(phone: PoseStream, target: PoseStream, *, one_by_one: bool = False) -> HandEye:
    """Solve P(t + offset) X = Z O(t) for the mount X, the place Z of the other tracker, the offset.

    Args:
        phone: T_world_phone.
        target: T_camera_target: what is fixed to the object, seen by a resting tracker.
        one_by_one: the k-th poses of both belong together, and times mean nothing.

    Raises:
        InputError: "calibration-short", "calibration-turns" (hardly any rotation),
            "calibration-clocks" (never the same motion), "calibration-stream" (a file read the
            wrong way round, said which), "calibration-apart" (they do not move as one thing),
            "calibration-lost" (one drifted more than any tracker that works), "calibration-far", or
            "calibration-poor" (more than one direction is open).
    """
    check_turns(phone)
    found = _best(phone, target, one_by_one=one_by_one)
    check_fit(found.fit, found.samples, (phone, target), found.gather)
    return _hand_eye_of(found, has_covariance=target.covariance is not None)


@dataclass(frozen=True)
class _Attempt:
    """A fit, with the samples and the offset that it was solved from."""

    fit: HandEyeFit
    samples: Samples
    offset: Offset
    gather: Gather
    """Pairs streams at that offset."""


def _best(phone: PoseStream, target: PoseStream, *, one_by_one: bool) -> _Attempt:
    """The attempt at which they move as one thing, or else that at the likeliest offset."""
    offsets = [Offset(0.0, 1.0)] if one_by_one else find_offsets(phone, target)
    if offsets[0].correlation < _BELONG:
        raise other_motion(offsets[0])
    attempts: list[_Attempt] = []
    for offset in (o for o in offsets if o.correlation >= _BELONG):
        attempt = _attempt(phone, target, offset, one_by_one=one_by_one)
        if attempt is not None:
            attempts.append(attempt)
            if moves_as_one(attempt.fit):
                return attempt
    if not attempts:
        raise short()
    return attempts[0]


def _attempt(
    phone: PoseStream, target: PoseStream, offset: Offset, *, one_by_one: bool
) -> _Attempt | None:
    """The fit at about one offset; None when too few samples are known at it."""

    def gather(a: PoseStream, b: PoseStream) -> Samples:
        return matched(a, b) if one_by_one else paired(a, b, offset.seconds)

    def again(more: float) -> Samples:
        return samples.later(phone, offset.seconds + more)

    samples = gather(phone, target)
    if len(samples.times) < LEAST_SAMPLES:
        return None
    rng = np.random.default_rng(0)
    start = first_guess(motions(samples, rng), rng)
    if one_by_one:
        return _Attempt(refine(samples, start), samples, offset, gather)
    fit = refine(samples, start, again)
    return _Attempt(fit, again(fit.offset), offset, gather)


def _hand_eye_of(attempt: _Attempt, *, has_covariance: bool) -> HandEye:
    """The result of an attempt; `has_covariance` is whether the target's tracker states its errors."""
    fit, samples = attempt.fit, attempt.samples
    covariance = mount_covariance(fit, samples)
    if not has_covariance:
        covariance = covariance + np.diag(_ALIKE**2)
    found = open_directions(covariance, _vertical(samples))
    if len(found) > 1:
        raise InputError(
            "calibration-poor",
            "The motion leaves open: " + "; ".join(each.words for each in found) + ".",
            fix="Record again: turn the object by 30 to 60 degrees about two directions that are "
            "not parallel (tilt it forward, tilt it sideways, turn it round).",
        )
    nearer = _nearer(found, fit.T_phone_target)
    mm, deg = rms(fit)
    rest_turn, rest_shift = undrifted(fit, samples)
    return HandEye(
        T_phone_target=moved(fit.T_phone_target, nearer),
        covariance=covariance + np.outer(nearer, nearer),
        open=found,
        T_world_camera=world(fit),
        offset=attempt.offset.seconds + fit.offset,
        correlation=attempt.offset.correlation,
        rms_mm=mm,
        rms_deg=deg,
        rest_mm=1e3 * float(rest_shift),
        rest_deg=float(np.degrees(rest_turn)),
        drift=drift_of(fit, samples),
        scale=fit.scale,
        kept=fit.kept,
        times=samples.times,
    )


def _nearer(
    found: tuple[OpenDirection, ...], X: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "6"]:
    """The step that brings the target, along its open directions, no farther than the phone itself.

    Where the motion shows, however poorly, that it is not there, it stays.
    """
    step = np.zeros(6)
    for each in found:
        shift = each.step[3:]
        far = float(shift @ X[:3, 3]) / max(float(shift @ shift), 1e-9)
        if abs(far) < _SHOWN * each.sd:
            step -= each.step * far
    return step


def _vertical(samples: Samples) -> Float64[np.ndarray, "3"] | None:
    """Up in the phone's axes, if the phone kept it through the recording (ARKit's y is up)."""
    up = samples.T_world_phone[:, 1, :3]
    mean = up.mean(axis=0) / np.linalg.norm(up.mean(axis=0))
    return mean if float(np.median(up @ mean)) > _UPRIGHT else None


def free_in_words(found: tuple[OpenDirection, ...]) -> tuple[str, ...]:
    """What `Mount.free` says of a calibration's open directions."""
    return tuple(
        f"{each.words}. {TILT_IT}" if each.words == "the height of the object" else each.words
        for each in found
    )
