"""From where the target is in the phone's frame to the mount of the object that carries it."""

import numpy as np
from jaxtyping import Float64

from ingest.calibration.hand_eye.solve import HandEye, free_in_words, solve
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.calibration.slip import refuse_slip
from ingest.mount import Mount
from ingest.uncertainty import of_product
from omomo_core.errors import InputError

_HALF_SECONDS = 8.0
"""A recording is halved to look for a slip if each half lasts this long."""


def calibrate_by_motion(
    phone: PoseStream,
    target: PoseStream,
    T_target_object: Float64[np.ndarray, "4 4"],
    target_object_covariance: Float64[np.ndarray, "6 6"],
    method: str,
) -> Mount:
    """The mount from a phone's log and another tracker's log of a target fixed to the object.

    The two halves of a recording that lasts long enough must give one mount.

    Args:
        phone: T_world_phone.
        target: T_camera_target.
        T_target_object: the object in the target's frame.
        target_object_covariance: of that.
        method: for the mount file.

    Raises:
        InputError: those of `solve`, and "mount-slipped".
    """
    found = solve(phone, target)
    _refuse_slip(phone, target, found)
    return Mount(
        found.T_phone_target @ T_target_object,
        method,
        covariance=of_product(
            found.T_phone_target, found.covariance, T_target_object, target_object_covariance
        ),
        residuals={
            "rms_mm": round(found.rms_mm, 3),
            "rms_deg": round(found.rms_deg, 4),
            "world held still_mm": round(found.rest_mm, 3),
            "world held still_deg": round(found.rest_deg, 4),
            "drift taken out_m": round(found.drift.metres, 4),
            "drift per metre walked_mm": round(1e3 * found.drift.per_metre, 2),
            "phone's lengths too short by_%": round(100 * found.scale, 2),
            "clock offset_s": round(found.offset, 4),
            "moments used_%": round(100 * float(found.kept.mean()), 1),
        },
        free=free_in_words(found.open),
    )


def _refuse_slip(phone: PoseStream, target: PoseStream, whole: HandEye) -> None:
    """Solve both halves by themselves, where they show enough, and compare."""
    if float(np.ptp(whole.times)) < 2 * _HALF_SECONDS:
        return
    middle = np.median(whole.times)
    halves = [
        _half(phone, target, target.times < middle),
        _half(phone, target, target.times >= middle),
    ]
    first, second = halves
    if first is not None and second is not None:
        refuse_slip(first, second)


def _half(phone: PoseStream, target: PoseStream, which: np.ndarray) -> Mount | None:
    covariance = None if target.covariance is None else target.covariance[which]
    try:
        found = solve(phone, PoseStream(target.times[which], target.T[which], covariance))
    except InputError:
        return None  # it shows too little by itself, and the whole has been solved
    return Mount(found.T_phone_target, "half", covariance=found.covariance)
