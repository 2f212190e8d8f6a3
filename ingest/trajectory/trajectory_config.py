"""Numbers of the trajectory, and what the user knows better than the log."""

from dataclasses import dataclass
from typing import Literal

from omomo_core.config import setting


@dataclass(frozen=True)
class BreakConfig:
    """Gaps in a log that must not be bridged, and holes that may be."""

    longest_gap: float = setting(
        0.1, "s", "Longest time between two poses that is bridged, whatever moves."
    )
    longest_hole: float = setting(
        0.155,
        "s",
        "Longest time between two poses that is bridged where the motion goes on smoothly: "
        "0.15 s, and the jitter of stamps.",
    )
    hole_bend: float = setting(
        0.01, "m", "Distance of a smooth motion from the straight way over a hole."
    )
    hole_turn: float = setting(
        2.0, "deg", "Angle of a smooth motion from the straight way over a hole."
    )
    pause: float = setting(
        1.0, "s", "Time without a pose after which the app may have started tracking anew."
    )
    longest_period: float = setting(
        0.095,
        "s",
        "Longest usual time between poses; closer to the longest gap, its jitter makes a "
        "gap of every "
        "other step.",
    )
    shortest_segment: float = setting(
        1.0, "s", "Shortest stretch between breaks that can become a motion."
    )


@dataclass(frozen=True)
class JumpConfig:
    """Steps that no hand makes: the tracker corrected itself."""

    fastest: float = setting(3.0, "m/s", "Speed of a jump; hand-held phones reach 1.5.")
    velocity_error: float = setting(
        1.0, "m/s", "Difference of a step's velocity from that of its neighbours that is a jump."
    )
    smallest_shift: float = setting(
        0.04,
        "m",
        "Smallest shift of such a step that is a jump: ARKit corrects itself by 2 to 3 cm "
        "in ordinary takes.",
    )
    turn_error: float = setting(
        5.0, "rad/s", "Difference of a step's angular velocity from that of its neighbours."
    )
    smallest_turn: float = setting(0.05, "rad", "Smallest turn of such a step that is a jump.")
    window: int = setting(5, "poses", "Steps before and after a step that predict its velocity.")
    outlier: float = setting(
        10.0, "share", "Deviations from the log's median error beyond which a step is a jump."
    )
    stitch_window: int = setting(
        5, "poses", "Steps before and after a jump that tell the step that the phone really made."
    )
    fewest_stitch_steps: int = setting(
        2, "poses", "Fewest steps on each side of a jump that is taken out."
    )


@dataclass(frozen=True)
class FrozenConfig:
    """Repeated poses: the tracker had lost the room."""

    shortest: float = setting(0.25, "s", "Shortest run of equal poses.")
    abrupt_speed: float = setting(
        0.2, "m/s", "Speed beyond which a phone does not come to rest within one step."
    )
    abrupt_turn: float = setting(
        0.35, "rad/s", "Angular speed beyond which a phone does not come to rest within one step."
    )


@dataclass(frozen=True)
class SmoothingConfig:
    """The tracker's noise, which is taken out, and no more than that.

    Three ARKit logs have 0.10 to 0.13 mm and 0.003 to 0.006 degrees. Taking out the former brings their
    accelerations at 30 fps nearer to the accelerometer's (1.71 to 1.48 m/s^2 rms); the latter is nothing.
    """

    least_noise: float = setting(5e-5, "m", "Noise of positions below which they stay as they are.")
    least_turn_noise: float = setting(
        0.02, "deg", "Noise of rotations below which they stay as they are."
    )
    largest_shift: float = setting(
        2e-3, "m", "Farthest move of a position, however noisy the log is."
    )
    largest_turn: float = setting(
        0.3, "deg", "Largest turn of a rotation, however noisy the log is."
    )
    sigmas: float = setting(
        2.0, "share", "Standard deviations of the noise by which a pose may move: more is motion."
    )
    longest_period: float = setting(
        0.025,
        "s",
        "Longest time between poses; in a log of 30 Hz a hand's tremor (8 to 12 Hz) looks "
        "like noise.",
    )
    half_window: int = setting(
        3, "poses", "Poses before and after each that the parabola is fitted to."
    )


@dataclass(frozen=True)
class RestConfig:
    """When something stands still, and when it does so on something."""

    shortest: float = setting(0.5, "s", "Shortest rest.")
    largest_spread: float = setting(0.005, "m", "Way within a rest, in the mean.")
    largest_turn: float = setting(1.0, "deg", "Turn within a rest, in the mean.")
    quiet_share: float = setting(
        0.2, "share", "Share of the frames, the quietest, that tell a log's noise."
    )
    kept_noise: float = setting(
        0.0005, "m", "Noise of positions on each axis that an average may keep."
    )
    kept_turn_noise: float = setting(
        0.1, "deg", "Noise of rotations on each axis that an average may keep."
    )
    most_averaged: int = setting(
        15, "frames", "Longest average: over half a second it still shows the border of a rest."
    )
    shaking: float = setting(
        2.5,
        "share",
        "Noise of a rest over that of the log: what moves to and fro by more is no rest.",
    )
    steady_shift: float = setting(
        0.0015,
        "m",
        "Standard deviation of a phone on a thing that nobody holds; hands tremble more.",
    )
    steady_turn: float = setting(
        0.25, "deg", "Standard deviation of the attitude of a phone on a thing that nobody holds."
    )
    steady_noise: float = setting(
        2.2, "share", "Deviations of the log's noise that are no trembling of hands."
    )
    creep_shift: float = setting(
        0.008, "m", "Standard deviation of a tracker that wanders slowly while nothing moves."
    )
    creep_pace: float = setting(
        0.012, "m/s", "Pace of such wandering, in the mean; hands that go as far are faster."
    )
    creep_window: float = setting(0.3, "s", "Time over which that pace is taken.")


@dataclass(frozen=True)
class StandingConfig:
    """On which sides an object can stand."""

    lean: float = setting(
        8.0,
        "deg",
        "Lean of an object that stands: a rough mesh, a soft carpet, a bent clamp.",
    )
    flatness: float = setting(
        0.01, "share", "Part of the object's size by which feet that stand may differ in height."
    )
    same_direction: float = setting(
        15.0, "deg", "Directions nearer than this count as one: a rough mesh has many stable sides."
    )
    dip: float = setting(
        0.1,
        "m",
        "Way below its rests that no object goes whose up is right, and as much again for each metre of its "
        "size.",
    )
    reach: float = setting(2.4, "m", "Height over its rests that nobody lifts an object to.")
    floor_distance: float = setting(
        0.06, "m", "Distance of a plane of depth points from the object that stands on it."
    )


@dataclass(frozen=True)
class GravityConfig:
    """Which way is up."""

    window: float = setting(2.0, "s", "Time over which the accelerometer is averaged.")
    noted: float = setting(
        5.0, "deg", "Angle between the accelerometer and the log's up that a report mentions."
    )
    refused: float = setting(
        15.0,
        "deg",
        "Angle between the accelerometer and the log's up from which on a log is refused.",
    )
    rest_spread: float = setting(
        10.0, "deg", "Angle between the object's own up in any rest and in all of them."
    )
    steady_axis: float = setting(
        0.1,
        "share",
        "Length of the mean of an axis of the object over the take below which it has no direction.",
    )
    floor_tilt: float = setting(
        45.0,
        "deg",
        "Angle between the floor's normal and the object's own up over the take: it keeps "
        "walls out.",
    )


@dataclass(frozen=True)
class DepthConfig:
    """Points of depth maps, and the planes among them."""

    maps: int = setting(8, "count", "Depth maps that are read, spread over the take.")
    points_per_map: int = setting(1000, "count", "Points that are taken of each.")
    nearest: float = setting(0.1, "m", "Nearest depth that is used.")
    farthest: float = setting(
        5.0, "m", "Farthest depth that is used: a phone's LiDAR measures nothing beyond."
    )
    plane_trials: int = setting(400, "count", "Triples of points that are tried (RANSAC).")
    plane_thickness: float = setting(
        0.02, "m", "Distance of a plane's points from it; phones measure depth to a centimetre."
    )
    smallest_plane: float = setting(
        0.1, "share", "Part of the points that a plane must hold: a smaller one may be anything."
    )
    fewest_points: int = setting(100, "count", "Fewest points in which a plane is looked for.")


@dataclass(frozen=True)
class FloorConfig:
    """Numbers of finding the floor."""

    assumed_height: float = setting(
        1.0, "m", "Height of the object's centre above the floor when nothing tells."
    )
    same_level: float = setting(
        0.03,
        "m",
        "Rests within this height of the lowest one stand on the same floor; tracking drifts.",
    )
    largest_dip: float = setting(
        0.05,
        "m",
        "Way of an object below its rest that is no error of tracking, and as much again "
        "for each metre "
        "of its size.",
    )
    largest_tilt: float = setting(
        5.0, "deg", "Tilt of a floor that depth maps show: beyond it is no floor, or up is wrong."
    )
    agreement: float = setting(
        0.1, "m", "Difference of depth and rest about the floor that mean the same one."
    )


@dataclass(frozen=True)
class ClosureConfig:
    """What counts as drift between the rests at both ends of a take."""

    near_end: float = setting(
        5.0, "s", "Time from an end of the usable frames within which the rest there must lie."
    )
    largest_shift: float = setting(
        0.1, "m", "Largest drift: ARKit drifts by about a percent; more is another place."
    )
    largest_share: float = setting(0.05, "share", "Largest drift, as a part of the path.")
    largest_turn: float = setting(15.0, "deg", "Largest drift of the heading.")
    least_step: float = setting(
        1e-6, "m", "Added to each step, so that an object turned on the spot has a path too."
    )


BREAKS = BreakConfig()
JUMPS = JumpConfig()
FROZEN = FrozenConfig()
SMOOTHING = SmoothingConfig()
RESTS = RestConfig()
STANDING = StandingConfig()
VERTICAL = GravityConfig()
DEPTH = DepthConfig()
FLOOR = FloorConfig()
CLOSURE = ClosureConfig()


@dataclass(frozen=True)
class TrajectoryConfig:
    """All numbers of the trajectory."""

    breaks: BreakConfig = BREAKS
    jumps: JumpConfig = JUMPS
    frozen: FrozenConfig = FROZEN
    smoothing: SmoothingConfig = SMOOTHING
    rests: RestConfig = RESTS
    standing: StandingConfig = STANDING
    gravity: GravityConfig = VERTICAL
    depth: DepthConfig = DEPTH
    floor: FloorConfig = FLOOR
    closure: ClosureConfig = CLOSURE


TRAJECTORY = TrajectoryConfig()


Top = Literal["object:x", "object:y", "object:z", "object:-x", "object:-y", "object:-z"]
"""Axis of the object's mesh that points up wherever the object rests."""


@dataclass(frozen=True)
class Reading:
    """What whoever recorded a take knows better than its log."""

    floor: float | None = None
    """Height of the floor above the session's origin, metres, along up (negative when it is below
    the place where the session started); None finds it."""
    up: tuple[float, float, float] | Top | None = None
    """Up in the session's world, or the axis of the mesh that is up where the object rests; None trusts
    the log or finds it."""
    stitch: bool = False
    """Move what follows a tracking jump back to where it belongs, instead of splitting there."""
    closure: bool = False
    """The object ends on the mark where it began: the drift in between is taken out."""
    segment: int | None = None
    """Which stretch between tracking failures is used, counted from 1; None is the longest."""
    format: str | None = None
    """Name of the format to read the log as; None tells it by what it holds."""


AS_LOGGED = Reading()
"""Nothing is said."""
