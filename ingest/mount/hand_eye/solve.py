"""The mount from two trackers of one motion: closed form, then refined, then doubted."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.mount.hand_eye.guess import first_guess, motions
from ingest.mount.hand_eye.model import Fit
from ingest.mount.hand_eye.readings import READINGS, OtherReading
from ingest.mount.hand_eye.refine import mount_covariance, refine, undrifted
from ingest.mount.hand_eye.samples import Samples, matched, paired
from ingest.mount.hand_eye.streams import PoseStream
from ingest.mount.hand_eye.timing import Offset, find_offset
from ingest.mount.observable import TILT_IT, OpenDirection, open_directions
from ingest.mount.uncertainty import moved
from omomo_core.errors import InputError

_LEAST_SAMPLES = 8
_TRIES = 3
_LEAST_TURN = np.radians(8.0)
_BELONG = 0.55
"""Least correlation of two clocks' turning speeds."""
_MOST_WILD = 0.45
_LOOSE_DEG, _LOOSE_M = 4.0, 0.08
"""Rms errors of two good trackers of one thing stay well below these."""
_MOST_WALK = np.array([np.radians(1.5), 0.04])
"""Drift of no tracker that works, rad and m in the square root of a second."""
_DOUBTFUL = np.array([np.radians(1.5), 0.03])
"""Rms errors, before drift is taken out, at which other readings are tried."""
_CLEARLY = 0.4
"""Another reading is the right one if it leaves this part of the error or less."""
_UPRIGHT = np.cos(np.radians(8.0))
_FAR = 2.0
"""Metres from the phone beyond which nothing is clamped to it."""


@dataclass(frozen=True)
class HandEye:
    """Where the tracked target is in the phone's frame, and how it is known."""

    T_phone_target: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Rotation (rad), translation (m) in the phone's axes; wide along `open`."""
    open: tuple[OpenDirection, ...]
    """What the motion did not show."""
    T_world_camera: Float64[np.ndarray, "4 4"]
    """Where the other tracker stands in the phone's world in the middle of the recording."""
    offset: float
    """Seconds to add to the target's times to get the phone's."""
    correlation: float
    """Of the turning speeds at that offset; 1 for poses that belong together one by one."""
    rms_mm: float
    rms_deg: float
    """Over the samples kept, in the phone's world."""
    kept: Bool[np.ndarray, " n"]
    """False where a sample was wild."""
    times: Float64[np.ndarray, " n"]
    """Of the samples, on the target's clock."""


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
            "calibration-far", or "calibration-poor" (more than one direction is open).
    """
    _check_turns(phone)
    offset = Offset(0.0, 1.0) if one_by_one else find_offset(phone, target)
    if offset.correlation < _BELONG:
        raise _other_motion(offset)
    gather = _gatherer(phone, target, offset, one_by_one=one_by_one)
    samples = gather(phone, target)
    if len(samples.times) < _LEAST_SAMPLES:
        raise _short(len(samples.times))
    fit = _fitted(samples, phone, offset, one_by_one=one_by_one)
    _check_fit(fit, samples, phone, target, gather)
    return _told(fit, samples, offset)


Gather = Callable[[PoseStream, PoseStream], Samples]


def _gatherer(phone: PoseStream, target: PoseStream, offset: Offset, *, one_by_one: bool) -> Gather:
    if one_by_one:
        return matched
    return lambda a, b: paired(a, b, offset.seconds)


def _fitted(samples: Samples, phone: PoseStream, offset: Offset, *, one_by_one: bool) -> Fit:
    def again(more: float) -> Samples:
        return samples.later(phone, offset.seconds + more)

    fits: list[Fit] = []
    for seed in range(_TRIES):
        rng = np.random.default_rng(seed)
        start = first_guess(motions(samples, rng), rng)
        fits.append(refine(samples, start, None if one_by_one else again))
        if _moves_as_one(fits[-1]):
            break
    return max(fits, key=lambda fit: float(fit.kept.mean()) - _rms(fit)[1] / 90)


def _moves_as_one(fit: Fit) -> bool:
    """Whether the mount explains most of the samples, and closely."""
    mm, deg = _rms(fit)
    close = deg < _LOOSE_DEG and mm < 1e3 * _LOOSE_M
    return bool(1 - fit.kept.mean() < _MOST_WILD and close and (fit.walk < _MOST_WALK).all())


def _check_turns(phone: PoseStream) -> None:
    R = Rotation.from_matrix(phone.T[:: max(1, len(phone.T) // 400), :3, :3])
    most = float((R[len(R) // 2].inv() * R).magnitude().max())
    if most < _LEAST_TURN:
        raise InputError(
            "calibration-turns",
            f"The phone turned by {np.degrees(most):.1f} deg at most: without turning, the place "
            "of the object (right, up and ahead of the camera) cannot be seen.",
            fix="Record again and turn the object by 30 to 60 degrees about two directions.",
        )


def _short(count: int) -> InputError:
    return InputError(
        "calibration-short",
        f"Both trackers saw the object together in only {count} poses.",
        fix="Record 20 seconds or more in which the witness camera sees the board.",
    )


def _other_motion(offset: Offset) -> InputError:
    return InputError(
        "calibration-clocks",
        "The phone and the other tracker never turn alike, whatever the offset of their clocks "
        f"(best correlation {offset.correlation:.2f}, it should be above 0.9).",
        fix="Use recordings of one and the same motion; turn the object briskly a few times, about "
        "different directions, while both record.",
    )


def _check_fit(
    fit: Fit, samples: Samples, phone: PoseStream, target: PoseStream, gather: Gather
) -> None:
    """Refuse trackers that do not move as one thing, and say why if another reading explains it."""
    one = _moves_as_one(fit)
    if not one or (undrifted(fit, samples) > _DOUBTFUL).any():
        whose, reading = _better_reading(_loose(samples), phone, target, gather)
        if reading is not None:
            raise InputError("calibration-stream", f"{whose} {reading.fault}.", fix=reading.fix)
    if not one:
        raise _apart(fit)
    far = float(np.linalg.norm(fit.T_phone_target[:3, 3]))
    if far > _FAR:
        raise InputError(
            "calibration-far",
            f"The target would be {far:.1f} m from the phone that is clamped to the same object.",
            fix="Look whether both streams are inverted (each must map the moving thing into its "
            "resting frame), and whether both are in metres.",
        )


def _apart(fit: Fit) -> InputError:
    mm, deg = _rms(fit)
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
    left: float, phone: PoseStream, target: PoseStream, gather: Gather
) -> tuple[str, OtherReading | None]:
    """The other reading of one of the streams that fits by far the best, if there is one."""
    found: list[tuple[float, str, OtherReading]] = []
    for reading in READINGS:
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
    """What the closed form leaves over, in radians: the median over relative motions."""
    rng = np.random.default_rng(0)
    moved = motions(samples, rng)
    if len(moved.A) < _LEAST_SAMPLES:
        return np.inf
    X = first_guess(moved, rng)
    left, right = moved.A @ X, X @ moved.B
    turn = left[:, :3, :3] @ right[:, :3, :3].swapaxes(-1, -2)
    shift = np.linalg.norm(left[:, :3, 3] - right[:, :3, 3], axis=1)
    return float(np.median(Rotation.from_matrix(turn).magnitude() + shift))


def _rms(fit: Fit) -> tuple[float, float]:
    """mm, deg over the samples kept."""
    square = (fit.errors[fit.kept] ** 2).reshape(-1, 2, 3).sum(axis=-1).mean(axis=0)
    return 1e3 * float(np.sqrt(square[1])), float(np.degrees(np.sqrt(square[0])))


def _told(fit: Fit, samples: Samples, offset: Offset) -> HandEye:
    covariance = mount_covariance(fit, samples)
    found = open_directions(covariance, _vertical(samples))
    if len(found) > 1:
        raise InputError(
            "calibration-poor",
            "The motion leaves open: " + "; ".join(each.words for each in found) + ".",
            fix="Record again: turn the object by 30 to 60 degrees about two directions that are "
            "not parallel (tilt it forward, tilt it sideways, turn it round).",
        )
    mm, deg = _rms(fit)
    return HandEye(
        T_phone_target=_without(found, fit.T_phone_target),
        covariance=covariance,
        open=found,
        T_world_camera=fit.T_world_camera,
        offset=offset.seconds + fit.offset,
        correlation=offset.correlation,
        rms_mm=mm,
        rms_deg=deg,
        kept=fit.kept,
        times=samples.times,
    )


def _without(
    found: tuple[OpenDirection, ...], X: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "4 4"]:
    """The mount with the target no farther along its open directions than the phone itself."""
    step = np.zeros(6)
    for each in found:
        shift = each.step[3:]
        step -= each.step * (shift @ X[:3, 3]) / max(float(shift @ shift), 1e-9)
    return moved(X, step)


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
