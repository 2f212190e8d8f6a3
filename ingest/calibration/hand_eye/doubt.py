"""What makes two trackers' motions doubtful, and what is said then."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ingest.calibration.hand_eye.drift import check_drift, drift_of, undrifted
from ingest.calibration.hand_eye.guess import first_guess, motions
from ingest.calibration.hand_eye.model import Fit
from ingest.calibration.hand_eye.readings import READINGS, OtherReading
from ingest.calibration.hand_eye.samples import Samples
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.calibration.hand_eye.timing import Offset
from omomo_core.errors import InputError

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
    """Too little was seen by both."""
    return InputError(
        "calibration-short",
        f"Both trackers saw the object together in fewer than {LEAST_SAMPLES} poses.",
        fix="Record 20 seconds or more in which the witness camera sees the board.",
    )


def other_motion(offset: Offset) -> InputError:
    """They followed different motions."""
    return InputError(
        "calibration-clocks",
        "The phone and the other tracker never turn alike, whatever the offset of their clocks "
        f"(best correlation {offset.correlation:.2f}, it should be above 0.9).",
        fix="Use recordings of one and the same motion; turn the object briskly a few times, about "
        "different directions, while both record.",
    )


def moves_as_one(fit: Fit) -> bool:
    """Whether the mount explains most of the samples, and closely."""
    mm, deg = rms(fit)
    close = deg < _LOOSE_DEG and mm < _LOOSE_MM
    return bool(1 - fit.kept.mean() < _MOST_WILD and close and (fit.walk < _MOST_WALK).all())


def rms(fit: Fit) -> tuple[float, float]:
    """mm, deg over the samples kept."""
    square = (fit.errors[fit.kept] ** 2).reshape(-1, 2, 3).sum(axis=-1).mean(axis=0)
    return 1e3 * float(np.sqrt(square[1])), float(np.degrees(np.sqrt(square[0])))


def check_fit(
    fit: Fit, samples: Samples, streams: tuple[PoseStream, PoseStream], gather: Gather
) -> None:
    """Refuse trackers that do not move as one thing, and say why if another reading explains it."""
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


def _apart(fit: Fit) -> InputError:
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
    if len(moved.A) < LEAST_SAMPLES:
        return np.inf
    X = first_guess(moved, rng)
    left, right = moved.A @ X, X @ moved.B
    turn = left[:, :3, :3] @ right[:, :3, :3].swapaxes(-1, -2)
    shift = np.linalg.norm(left[:, :3, 3] - right[:, :3, 3], axis=1)
    return float(np.median(Rotation.from_matrix(turn).magnitude() + shift))
