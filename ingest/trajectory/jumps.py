"""Steps between two poses that no hand makes: the tracker corrected itself."""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

MAX_SPEED = 3.0
"""m/s; hand-held phones reach 1.5."""
MAX_SPEED_ERROR, MIN_SHIFT = 1.0, 0.04
"""m/s between a step's velocity and that of its neighbours, and the metres it must amount to.

ARKit corrects itself by 2 to 3 cm in ordinary takes: not worth splitting them.
"""
MAX_TURN_ERROR, MIN_TURN = 5.0, 0.05
"""rad/s and rad, the same for the rotation."""
_WINDOW = 5
_RELATIVE = 10.0


def find_jumps(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Mark the steps (pose i to pose i+1) that are jumps.

    A step is a jump when it is faster than MAX_SPEED, or when neither the five steps before it
    nor the five after it predict its velocity (the constant-velocity test of LaMAR's capture
    tools, made two-sided so that putting an object down hard is not a jump).
    """
    dt = np.diff(times)[:, None]
    linear, angular = velocities(T, dt)
    too_fast = np.linalg.norm(linear, axis=1) > MAX_SPEED
    shifted = _surprising(linear, np.maximum(MAX_SPEED_ERROR, MIN_SHIFT / dt[:, 0]))
    turned = _surprising(angular, np.maximum(MAX_TURN_ERROR, MIN_TURN / dt[:, 0]))
    return too_fast | shifted | turned


def velocity_changes(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> tuple[Float64[np.ndarray, " steps"], Float64[np.ndarray, " steps"]]:
    """How much linear (m/s) and angular (rad/s) velocity differ before and after each step.

    Both are medians of up to five steps, so that noise does not count.
    """
    linear, angular = velocities(T, np.diff(times)[:, None])
    return _change(linear), _change(angular)


def _change(velocity: Float64[np.ndarray, "steps 3"]) -> Float64[np.ndarray, " steps"]:
    after = _median_before(velocity[::-1])[::-1]
    return np.linalg.norm(after - _median_before(velocity), axis=1)


def velocities(
    T: Float64[np.ndarray, "frames 4 4"], dt: Float64[np.ndarray, "steps 1"]
) -> tuple[Float64[np.ndarray, "steps 3"], Float64[np.ndarray, "steps 3"]]:
    """Linear (m/s) and angular (rad/s) velocity of each step, in the world."""
    R = Rotation.from_matrix(T[:, :3, :3])
    return np.diff(T[:, :3, 3], axis=0) / dt, (R[1:] * R[:-1].inv()).as_rotvec() / dt


def _surprising(
    velocity: Float64[np.ndarray, "steps 3"], threshold: Float64[np.ndarray, " steps"]
) -> Bool[np.ndarray, " steps"]:
    error = np.minimum(
        np.linalg.norm(velocity - _median_before(velocity), axis=1),
        np.linalg.norm(velocity - _median_before(velocity[::-1])[::-1], axis=1),
    )
    median = np.median(error)
    spread = np.median(np.abs(error - median))
    return (error > threshold) & (error > median + _RELATIVE * spread)


def _median_before(velocity: Float64[np.ndarray, "steps 3"]) -> Float64[np.ndarray, "steps 3"]:
    """Median velocity of up to five steps before each step (the first borrows its successor)."""
    first = velocity[1:2] if len(velocity) > 1 else velocity
    padded = np.concatenate([np.repeat(first, _WINDOW, axis=0), velocity[:-1]])
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, _WINDOW, axis=0), axis=-1)
