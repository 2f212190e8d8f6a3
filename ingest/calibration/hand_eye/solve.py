"""The mount from two trackers of one motion: closed form, refinement, checks."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ingest.calibration.hand_eye.doubt import (
    LEAST_SAMPLES,
    Gather,
    check_fit,
    check_turns,
    moves_as_one,
    other_motion,
    rms,
    short,
)
from ingest.calibration.hand_eye.drift import Drift, drift_of, undrifted
from ingest.calibration.hand_eye.guess import first_guess, motions
from ingest.calibration.hand_eye.model import HandEyeFit, world
from ingest.calibration.hand_eye.refine import mount_covariance, refine
from ingest.calibration.hand_eye.samples import Samples, matched, paired
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.calibration.hand_eye.timing import Offset, find_offsets
from ingest.calibration.observable import TILT_IT, OpenDirection, open_directions
from ingest.uncertainty import moved
from omomo_core.errors import InputError

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
    """Where the tracked target is in the phone's frame, and how it is known."""

    T_phone_target: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Rotation (rad), translation (m) in the phone's axes; wide along `open`."""
    open: tuple[OpenDirection, ...]
    """What the motion did not show."""
    T_world_camera: Float64[np.ndarray, "n 4 4"]
    """Where the other tracker stands in the phone's world, which drifts, at each sample."""
    offset: float
    """Seconds to add to the target's times to get the phone's."""
    correlation: float
    """Of the turning speeds at that offset; 1 for poses that belong together one by one."""
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
