"""Whether the poses and the IMU saw the same motion: clocks, rotation, translation, scale.

Gravity alone cannot tell a mirrored world or a wrong scale; angular velocity and acceleration can.
On a real log the correlations are 0.98 and more, the scale 0.92 (both are smoothed).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import uniform_filter1d
from scipy.signal import correlate, savgol_filter
from scipy.spatial.transform import Rotation, Slerp

from ingest.report.check import Check, grade, graded
from ingest.report.look import Look
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog

_RATE = 100.0
_SMOOTH = 41
"""Samples of the cubic that is fitted for derivatives: 0.4 s."""
_MAX_LAG = 2.0
"""Seconds by which two clocks are looked for apart."""
_MIN_SECONDS = 2.0
_MIN_TURNING, _MIN_MOVING = 0.05, 0.15
"""rad/s and m/s^2 (standard deviation) of an axis that says something."""
_SURE = 0.7
"""Correlation that makes a lag or a scale believable."""
_FIX = (
    "Give the log and the IMU of one take, in the app's own axes and units; nothing mirrored, "
    "reordered or rescaled."
)


@dataclass(frozen=True)
class Agreement:
    """What the poses and the IMU have in common; None where too little moved to tell."""

    covered: float
    """Part of the take during which the IMU ran."""
    lag: float | None = None
    """Seconds by which the IMU's stamps are late."""
    turning: float | None = None
    """Correlation of the angular velocities, on the axis where it is worst."""
    moving: float | None = None
    """The same for the accelerations."""
    scale: float | None = None
    """Acceleration of the poses in units of the accelerometer's."""


def agreement_checks(look: Look) -> list[Check]:
    """A check each of the clocks, the rotation, the translation and the scale."""
    session = look.session
    if session.imu is None:
        return []
    found = measure_agreement(session, session.imu, look.used)
    return [_clocks(found), _correlation("turning", found.turning, "gyroscope"),
            _correlation("moving", found.moving, "accelerometer"), _scale(found.scale)]  # fmt: skip


def _clocks(found: Agreement) -> Check:
    message = f"the IMU ran during {found.covered:.0%} of the take"
    late = abs(found.lag or 0.0)
    if found.lag is not None:
        message += f"; its clock is {1000 * found.lag:+.0f} ms off"
    fix = "Give the IMU's log of this very take, on the clock of the poses."
    severity = "warn" if found.covered < 0.8 or late > 0.05 else "ok"
    return graded("clocks", severity, message, fix)


def _correlation(name: str, value: float | None, sensor: str) -> Check:
    if value is None:
        return Check(name, "ok", f"too little of it to compare with the {sensor}")
    severity = grade(1 - value, 1 - _SURE, 0.6)
    return graded(name, severity, f"correlation {value:.2f} with the {sensor}", _FIX)


def _scale(scale: float | None) -> Check:
    if scale is None:
        return Check("scale", "ok", "too little acceleration to compare")
    severity = grade(abs(float(np.log(scale))), np.log(1.35), np.log(2.0))
    message = f"a metre of the poses is {scale:.2f} m of the accelerometer"
    return graded("scale", severity, message, "Give the positions in metres as the app wrote them.")


def measure_agreement(
    session: CaptureSession, imu: ImuLog, used: Bool[np.ndarray, " steps"]
) -> Agreement:
    """Compare the poses' derivatives with the IMU, at 100 Hz, over the steps that are used."""
    start, stop = max(session.times[0], imu.times[0]), min(session.times[-1], imu.times[-1])
    covered = max(0.0, (stop - start) / np.ptp(session.times))
    if stop - start < _MIN_SECONDS or len(imu.times) < 3:
        return Agreement(covered)
    clock = np.arange(start, stop, 1 / _RATE)
    use = _usable(session, used, clock)
    if use.sum() < _MIN_SECONDS * _RATE:
        return Agreement(covered)
    R, turning, moving = _derivatives(session, clock)
    lag = _lag(turning, _imu_at(imu.times, imu.gyro, clock), use)
    at = clock + (lag or 0.0)
    gyro, accel = (_imu_at(imu.times, values, at) for values in (imu.gyro, imu.accel))
    felt = np.array([0.0, -GRAVITY, 0.0]) - R.apply(accel)
    agreed = _worst_axis(moving, felt, use, _MIN_MOVING)
    return Agreement(
        covered,
        lag,
        _worst_axis(turning, gyro, use, _MIN_TURNING),
        agreed,
        _gain(moving, felt, use) if agreed is not None and agreed > _SURE else None,
    )


def _usable(
    session: CaptureSession,
    used: Bool[np.ndarray, " steps"],
    clock: Float64[np.ndarray, " samples"],
) -> Bool[np.ndarray, " samples"]:
    """Samples whose window of smoothing lies within what is used."""
    step = np.clip(np.searchsorted(session.times, clock, "right") - 1, 0, len(used) - 1)
    # Two samples more than the window: a velocity is made of two.
    good = uniform_filter1d(used[step].astype(float), _SMOOTH + 4) > 1 - 1e-6
    good[: _SMOOTH // 2] = good[-(_SMOOTH // 2) :] = False
    return good


def _derivatives(
    session: CaptureSession, clock: Float64[np.ndarray, " samples"]
) -> tuple[Rotation, Float64[np.ndarray, "samples 3"], Float64[np.ndarray, "samples 3"]]:
    """Rotation, angular velocity (camera axes) and acceleration (world) of the poses."""
    T = session.T_world_phone
    R = Slerp(session.times, Rotation.from_matrix(T[:, :3, :3]))(clock)
    place = np.stack([np.interp(clock, session.times, axis) for axis in T[:, :3, 3].T], axis=1)
    steps = (R[:-1].inv() * R[1:]).as_rotvec() * _RATE
    turning = savgol_filter(np.concatenate([steps, steps[-1:]]), _SMOOTH, 3, axis=0)
    moving = savgol_filter(place, _SMOOTH, 3, deriv=2, delta=1 / _RATE, axis=0)
    return R, np.asarray(turning), np.asarray(moving)


def _imu_at(
    times: Float64[np.ndarray, " readings"],
    values: Float64[np.ndarray, "readings 3"],
    clock: Float64[np.ndarray, " samples"],
) -> Float64[np.ndarray, "samples 3"]:
    """Readings smoothed as the poses are, in camera axes."""
    values = np.stack([np.interp(clock, times, axis) for axis in values.T], axis=1)
    return savgol_filter(values, _SMOOTH, 3, axis=0) @ R_CAMERA_DEVICE.T


def _lag(
    poses: Float64[np.ndarray, "samples 3"],
    gyro: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
) -> float | None:
    """Shift at which the speeds of rotation agree best, whatever the axes; None if nowhere."""
    ours, theirs = np.linalg.norm(poses, axis=1), np.linalg.norm(gyro, axis=1)
    if min(ours[use].std(), theirs[use].std()) < _MIN_TURNING:
        return None
    x, y = np.where(use, ours - ours[use].mean(), 0.0), theirs - theirs.mean()
    power = correlate(y**2, use.astype(float), "full").clip(1e-12)
    scores = correlate(y, x, "full") / np.sqrt((x @ x) * power)
    shifts = np.arange(1 - len(x), len(x))
    scores[np.abs(shifts) > min(_MAX_LAG * _RATE, len(x) / 3)] = 0.0
    best = int(np.argmax(scores))
    return float(shifts[best] / _RATE) if scores[best] > _SURE else None


def _correlate(x: Float64[np.ndarray, " samples"], y: Float64[np.ndarray, " samples"]) -> float:
    x, y = x - x.mean(), y - y.mean()
    return float(x @ y / max(np.linalg.norm(x) * np.linalg.norm(y), 1e-12))


def _worst_axis(
    ours: Float64[np.ndarray, "samples 3"],
    theirs: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
    least: float,
) -> float | None:
    """Lowest correlation among the axes on which enough happens."""
    if not np.ptp(theirs, axis=0).any():  # the app writes zeros for a sensor that is off
        return None
    busy = [k for k in range(3) if max(ours[use, k].std(), theirs[use, k].std()) > least]
    return min((_correlate(ours[use, k], theirs[use, k]) for k in busy), default=None)


def _gain(
    ours: Float64[np.ndarray, "samples 3"],
    theirs: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
) -> float:
    x, y = (values[use] - values[use].mean(axis=0) for values in (ours, theirs))
    return float((x**2).sum() / (x * y).sum())
