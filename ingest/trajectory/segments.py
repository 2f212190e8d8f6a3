"""Breaks of the tracking: jumps, gaps and frozen poses split a take; what fits again is stitched."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import BREAKS, FROZEN, JUMPS
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion


def segments(motion: ObjectMotion) -> list[tuple[int, int]]:
    """(start, stop) of each run of valid frames that lasts at least a second."""
    return [(a, b) for a, b in runs(motion.valid) if b - a >= BREAKS.shortest_segment * FPS]


def within(stretches: list[tuple[int, int]], count: int) -> Bool[np.ndarray, " frames"]:
    """Which of `count` frames lie in one of the stretches."""
    mask = np.zeros(count, bool)
    for start, stop in stretches:
        mask[start:stop] = True
    return mask


def choose(stretches: Sequence[tuple[int, int]], wanted: int | None, where: str) -> int:
    """Which stretch is used, counted from 0: the wanted one, or the first of the longest.

    Args:
        stretches: (start, stop) of each, at least one.
        wanted: counted from 1; None takes the longest.
        where: what they are stretches of, for messages.

    Raises:
        InputError: "segment-missing".
    """
    if wanted is None:
        return int(np.argmax([stop - start for start, stop in stretches]))
    if not 1 <= wanted <= len(stretches):
        raise InputError(
            "segment-missing",
            f"There is no segment {wanted}: the take has {len(stretches)}.",
            where=where,
            fix=f"Give ‹segment› a number from 1 to {len(stretches)}, or leave it out for the longest.",
        )
    return wanted - 1


def cut(motion: ObjectMotion, start: int, stop: int) -> ObjectMotion:
    """Frames start to stop of a motion, in the same world."""
    return replace(
        motion,
        T_world_object=motion.T_world_object[start:stop],
        valid=motion.valid[start:stop],
        start_time=motion.start_time + start / FPS,
    )


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


def repeated_runs(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> list[tuple[int, int]]:
    """First and last pose of each run of equal poses that lasts 0.25 s or more."""
    same = (np.diff(T, axis=0) == 0).all(axis=(1, 2))
    return [(a, b) for a, b in runs(same) if times[b] - times[a] >= FROZEN.shortest]


def find_frozen(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Mark the steps of repeated runs that start or end in full motion, and the step out of them.

    A run that the phone eases into and out of is an object standing still in a log without noise
    (a synthetic one): it stays.
    """
    frozen = np.zeros(len(T) - 1, bool)
    repeated = repeated_runs(times, T)
    if not repeated:
        return frozen
    linear, angular = velocities(T, np.diff(times)[:, None])
    abrupt = (np.linalg.norm(linear, axis=1) > FROZEN.abrupt_speed) | (
        np.linalg.norm(angular, axis=1) > FROZEN.abrupt_turn
    )
    for first, last in repeated:
        borders = [step for step in (first - 1, last) if 0 <= step < len(frozen)]
        if abrupt[borders].any():
            frozen[first : last + 1] = True
    return frozen


@dataclass(frozen=True)
class Breaks:
    """Marks on the steps of a log; step i goes from pose i to pose i+1."""

    gaps: Bool[np.ndarray, " steps"]
    jumps: Bool[np.ndarray, " steps"]
    frozen: Bool[np.ndarray, " steps"]
    untracked: Bool[np.ndarray, " steps"]
    holes: Bool[np.ndarray, " steps"]
    """Long steps that are bridged, for the motion is smooth there: no faults."""

    @property
    def any(self) -> Bool[np.ndarray, " steps"]:
        """Steps with any of the faults."""
        return self.gaps | self.jumps | self.frozen | self.untracked

    def named(self) -> list[tuple[str, Bool[np.ndarray, " steps"]]]:
        """Each fault with the words for it."""
        return [
            ("gap in the log", self.gaps),
            ("tracking jump", self.jumps),
            ("frozen tracking", self.frozen),
            ("limited tracking", self.untracked),
        ]


def find_breaks(session: CaptureSession) -> Breaks:
    """All the steps of a session that its motion must be split at.

    A jump is one step; the step out of a gap or a freeze is not counted as a jump again.
    """
    times, T = session.times, session.T_world_phone
    long = np.diff(times) > BREAKS.longest_gap
    frozen = find_frozen(times, T)
    ok = session.tracking_ok
    untracked = np.zeros(len(long), bool) if ok is None else ~(ok[1:] & ok[:-1])
    jumps = find_jumps(times, T)
    holes = long & ~jumps & ~frozen & ~untracked & _is_smooth(times, T)
    gaps = long & ~holes
    jumps &= ~gaps & ~frozen & ~untracked
    return Breaks(gaps=gaps, jumps=jumps, frozen=frozen, untracked=untracked, holes=holes)


def _is_smooth(
    times: Float64[np.ndarray, " frames"], T: Float64[np.ndarray, "frames 4 4"]
) -> Bool[np.ndarray, " steps"]:
    """Whether a straight way over each step is near the true one: short, or hardly bent.

    What changes its velocity by v within t seconds is v t / 8 off the straight way in the middle.
    """
    dt = np.diff(times)
    bent, turned = (change * dt / 8 for change in velocity_changes(times, T))
    return (
        (dt < BREAKS.longest_hole)
        & (bent < BREAKS.hole_bend)
        & (turned < np.radians(BREAKS.hole_turn))
    )


def same_world(
    times: Float64[np.ndarray, " frames"], breaks: Breaks, stretch: tuple[int, int], count: int
) -> Bool[np.ndarray, " grid"]:
    """Which frames at 30 fps have the world of a stretch: no jump or loss of tracking lies between.

    Args:
        times: of the logged poses, seconds.
        breaks: between them.
        stretch: (start, stop), frames at 30 fps.
        count: of all frames.
    """
    moved = breaks.jumps | breaks.frozen | breaks.untracked | (np.diff(times) > BREAKS.pause)
    world = np.concatenate([[0], np.cumsum(moved)])
    grid = times[0] + np.arange(count) / FPS
    of_frame = world[(np.searchsorted(times, grid + 1e-6, side="right") - 1).clip(0)]
    return of_frame == of_frame[(stretch[0] + stretch[1]) // 2]


def check_rate(session: CaptureSession) -> None:
    """Refuse a log of 10 poses a second or fewer: every step of it is a gap.

    Raises:
        InputError: "rate-too-low".
    """
    period = float(np.median(np.diff(session.times)))
    if period > BREAKS.longest_period:
        raise InputError(
            "rate-too-low",
            f"The log has {1 / period:.3g} poses a second; how the object moved in between is not "
            "known.",
            where=str(session.source),
            fix="Set the app to 30 or 60 poses a second and record again.",
        )


@dataclass(frozen=True)
class Stitch:
    """A jump that was taken out."""

    step: int
    """From pose `step` to the next."""
    metres: float
    radians: float


def stitch_jumps(
    session: CaptureSession, breaks: Breaks
) -> tuple[CaptureSession, Breaks, list[Stitch]]:
    """Move everything after each single-step jump so that the velocity continues through it.

    ARKit corrects itself by one rigid transform of everything that follows, so the motion within
    the later part is right. The step that the phone really made is the mean of its velocity in the
    five steps before and after, in its own axes, which the correction leaves alone. Jumps of
    several steps, or beside another break, stay.

    Returns:
        The session with its poses moved, the breaks that remain, and the jumps taken out.
    """
    T = session.T_world_phone.copy()
    jumps = breaks.jumps.copy()
    found: list[Stitch] = []
    for first, last in runs(breaks.any):
        if last - first > 1 or not jumps[first]:
            continue
        T_phone_next = _true_step(session.times, session.T_world_phone, breaks.any, first)
        if T_phone_next is None:
            continue
        correction = T[first] @ T_phone_next @ inverse(T[first + 1])
        metres = np.linalg.norm((correction @ T[first + 1] - T[first + 1])[:3, 3])
        turn = Rotation.from_matrix(correction[:3, :3]).magnitude()
        T[first + 1 :] = correction @ T[first + 1 :]
        jumps[first] = False
        found.append(Stitch(first, float(metres), float(turn)))
    return replace(session, T_world_phone=T), replace(breaks, jumps=jumps), found


def _true_step(
    times: Float64[np.ndarray, " frames"],
    T: Float64[np.ndarray, "frames 4 4"],
    broken: Bool[np.ndarray, " steps"],
    step: int,
) -> Float64[np.ndarray, "4 4"] | None:
    """The motion of the phone in a step, in its own axes; None when too few steps around tell."""
    sides = (
        np.arange(step - 1, step - 1 - JUMPS.stitch_window, -1),
        np.arange(step + 1, step + 1 + JUMPS.stitch_window),
    )
    rates: list[Float64[np.ndarray, " twist"]] = []
    for side in sides:
        inside = side[(side >= 0) & (side < len(broken))]
        clean = inside[np.cumsum(broken[inside]) == 0]
        if len(clean) < JUMPS.fewest_stitch_steps:
            return None
        moved = inverse(T[clean]) @ T[clean + 1]
        turned = Rotation.from_matrix(moved[:, :3, :3]).as_rotvec()
        seconds = times[clean + 1] - times[clean]
        rates.append(np.concatenate([turned, moved[:, :3, 3]], axis=1).sum(0) / seconds.sum())
    out = np.eye(4)
    both = (rates[0] + rates[1]) / 2 * (times[step + 1] - times[step])
    out[:3, :3] = Rotation.from_rotvec(both[:3]).as_matrix()
    out[:3, 3] = both[3:]
    return out
