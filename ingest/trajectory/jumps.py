"""Jumps: steps between two poses that no hand makes, because the tracker corrected itself."""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.trajectory.config import JUMPS


def find_jumps(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Mark the steps (pose i to pose i+1) that are jumps.

    A step is a jump when it is faster than any hand, or when neither the five steps before it
    nor the five after it predict its velocity (the constant-velocity test of LaMAR's capture
    tools, made two-sided so that putting an object down hard is not a jump).
    """
    dt = np.diff(times)[:, None]
    linear, angular = velocities(T, dt)
    too_fast = np.linalg.norm(linear, axis=1) > JUMPS.fastest
    shifted = _surprising(linear, np.maximum(JUMPS.velocity_error, JUMPS.smallest_shift / dt[:, 0]))
    turned = _surprising(angular, np.maximum(JUMPS.turn_error, JUMPS.smallest_turn / dt[:, 0]))
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
    return (error > threshold) & (error > median + JUMPS.outlier * spread)


def _median_before(velocity: Float64[np.ndarray, "steps 3"]) -> Float64[np.ndarray, "steps 3"]:
    """Median velocity of up to five steps before each step (the first borrows its successor)."""
    first = velocity[1:2] if len(velocity) > 1 else velocity
    padded = np.concatenate([np.repeat(first, JUMPS.window, axis=0), velocity[:-1]])
    return np.median(
        np.lib.stride_tricks.sliding_window_view(padded, JUMPS.window, axis=0), axis=-1
    )
