"""Checks of the clamp: the mount's place, gravity, and whether the clamp slipped."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.distributions import chi2_quantile, normal_from_tail
from ingest.mount import Mount, object_id
from ingest.report.checked_session import CheckedSession
from ingest.report.phone_place import place_check
from ingest.report.take_report import Check, grade, graded, worst
from ingest.session import GRAVITY, CaptureSession
from ingest.trajectory.gravity import measured_up
from ingest.trajectory.trajectory_config import VERTICAL
from ingest.uncertainty import bounds_95
from omomo_core.motion import FPS, ObjectMesh

_LIMITS = {"mm": (35.0, 100.0), "m": (0.035, 0.1), "deg": (3.0, 15.0)}
"""Residuals to warn of, and not to believe; good calibrations leave 5 to 30 mm, 0.4 to 2 deg."""
_WIDE_MM, _WIDE_DEG = 30.0, 5.0
"""95 % bounds of a mount beyond which hands are seen to miss the object."""
_CALIBRATE_AGAIN = (
    "Calibrate the mount again; written by hand, it maps points of the mesh into the camera's "
    "axes (not the other way round), in metres."
)


def mount_checks(mesh: ObjectMesh, mount: Mount) -> list[Check]:
    """Return checks of the mount: the phone's place on the object, residuals and covariance.

    Args:
        mesh: the object, in metres: the mount's `object_scale` is in it already.
        mount: the mount of the take.
    """
    return [place_check(mesh, mount), _residuals(mount), *_object(mesh, mount), *_sureness(mount)]


def _residuals(mount: Mount) -> Check:
    """Judge residuals by the unit at the end of their names, e.g. rms_mm; show those of other units.

    Drift is not judged either: it has been taken out, and it grows with the walk.
    """
    if not mount.residuals:
        # Measured by benchmarks/take_checks.py: what passes as good is nearly always one of these.
        unseen = (
            "a log does not show whether it is turned about the vertical or moved along a flat side"
        )
        message = f"{mount.method}; its file tells no residuals, and {unseen}: look at the picture"
        return Check("mount", "ok", message)
    severity = worst(
        [
            grade(abs(value), *_LIMITS[unit])
            for name, value in mount.residuals.items()
            if (unit := name.rpartition("_")[2]) in _LIMITS and not name.startswith("drift")
        ]
    )
    facts = ", ".join(f"{name} {value:.3g}" for name, value in mount.residuals.items())
    return graded("mount", severity, f"{mount.method}; {facts}", _CALIBRATE_AGAIN)


def _object(mesh: ObjectMesh, mount: Mount) -> list[Check]:
    """Check that the mount was calibrated for this mesh, if its file names the mesh."""
    if not mount.object_id:
        return []
    given = object_id(mesh, mount.object_scale)
    if _box_of(given) == _box_of(mount.object_id):
        return [Check("mount's object", "ok", given)]
    message = f"the mount was found for another mesh: {mount.object_id}; this one is {given}"
    fix = (
        "Give the mesh it was found for, or calibrate with this one: a mesh in another frame, or of "
        "another size, needs a mount of its own."
    )
    return [Check("mount's object", "bad", message, fix=fix)]


def _box_of(name: str) -> str:
    """The part of an id that is not the mesh's name: a file may be renamed."""
    return name.rpartition(", ")[2]


def _sureness(mount: Mount) -> list[Check]:
    """Check of the mount's covariance, if it has one, and of the directions that stayed open."""
    if mount.covariance is None and not mount.free:
        return []
    facts: list[str] = []
    wide = bool(mount.free)
    if mount.covariance is not None:
        bounds = bounds_95(mount.covariance)
        wide |= bounds.mm > _WIDE_MM or bounds.deg > _WIDE_DEG
        facts.append(f"right within {bounds.mm:.0f} mm and {bounds.deg:.1f} deg (95 %)")
    if mount.free:
        facts.append(f"a guess: {', '.join(mount.free)}")
    fix = (
        "Calibrate in another way too and combine the two (omocap calibrate combine), or let the "
        "floor refine it (omocap calibrate floor)."
    )
    return [graded("mount's error", "warn" if wide else "ok", "; ".join(facts), fix)]


_WINDOW_NOTED = 12.0
"""Degrees that one window may be off: brisk motion does not average out in two seconds."""
_FIX_AXES = (
    "The log's axes are not the app's usual ones, or its clocks differ: check that the files "
    "belong to one take."
)


def gravity(look: CheckedSession) -> Check:
    """Whether up is up, as far as the log tells."""
    session = look.session
    if session.imu is None:
        return _unchecked(look)
    times, angles = gravity_angles(session, look.up)
    if len(times) == 0:
        fix = "Give the accelerometer's log of this take."
        message = "the accelerometer ran too short a time to check the axes"
        return Check("gravity", "warn", message, fix=fix)
    return _direction(
        look, times, angles, float(np.median(np.linalg.norm(session.imu.accel, axis=1)))
    )


def _unchecked(look: CheckedSession) -> Check:
    """Most apps log no accelerometer: that is said, and is no fault of a take."""
    session, take = look.session, look.take
    if session.gravity_aligned:
        message = (
            "no accelerometer in the log: the poses' own up, handedness and metres are believed, and "
            "checked only by how the object rests"
        )
        return Check("gravity", "ok", message)
    message = f"{session.app} does not log which way is up, and there is no accelerometer"
    if take is None:
        fix = "Give the object and its mount, so that up can be found where it rests, or give up (‹up›)."
        return Check("gravity", "warn", message, fix=fix)
    known = "up is as given" if take.up.source == "given" else take.up.note.rstrip(".")
    return Check("gravity", "ok", f"{message}; {known[0].lower()}{known[1:]}")


def _direction(
    look: CheckedSession,
    times: Float64[np.ndarray, " windows"],
    angles: Float64[np.ndarray, " windows"],
    size: float,
) -> Check:
    start, stop = look.chosen
    used = angles[(times > start / FPS) & (times < stop / FPS)]
    off, most = float(np.median(used if len(used) else angles)), int(np.argmax(angles))
    if not 0.8 < size / GRAVITY < 1.2:
        fix = "Log the raw accelerometer (gravity included), in g or m/s^2, or leave it out."
        message = f"the accelerometer reads {size:.3g} m/s^2 as a rule instead of {GRAVITY:.2f}"
        return Check("gravity", "bad" if off > VERTICAL.refused else "warn", message, fix=fix)
    severity = worst(
        [
            grade(off, VERTICAL.noted, VERTICAL.refused),
            grade(float(angles[most]), _WINDOW_NOTED, 180.0),
        ]
    )
    logged = look.session.times
    edges = logged[0] + times[most] + np.array([-0.5, 0.5]) * VERTICAL.window
    first, last = np.searchsorted(logged, edges)
    message = (
        f"the accelerometer agrees with the poses' down within {off:.1f} deg (median of "
        f"the stretch that is used; at most {angles[most]:.1f} deg anywhere)"
    )
    place = (int(first), int(last)) if off <= VERTICAL.noted else (0, len(logged))
    return graded("gravity", severity, message, _FIX_AXES, place)


def gravity_angles(
    session: CaptureSession, up: Float64[np.ndarray, "3"]
) -> tuple[Float64[np.ndarray, " windows"], Float64[np.ndarray, " windows"]]:
    """Seconds from the start of the take, and degrees between up and the mean of each window.

    Args:
        session: with an accelerometer, or there are no windows.
        up: unit vector in the session's world.
    """
    measured = measured_up(session)
    angles = np.degrees(np.arccos(np.clip(measured @ up, -1, 1)))
    began = 0.0 if session.imu is None else max(0.0, session.imu.times[0] - session.times[0])
    return began + (np.arange(len(angles)) + 0.5) * VERTICAL.window, angles


_SURE = 0.999
"""Share of the takes with a clamp that held which passes."""
_LEAN, _WANDER, _UNEVEN = 0.4, 0.3, 0.3
"""Degrees (standard deviation, each axis): of ARKit's world, of its gravity from rest to rest, of floors."""
_HEIGHT = 0.004
_DRIFT = 0.004
"""Metres: of the height of a rest, and of what tracking adds to it per metre of path."""
_SAME_SIDE = 45.0
"""Degrees between two rests on one side of the object."""
_DOUBT = 0.5
"""Seconds by which the time of a slip may fit worse and still be the right one."""
_SHARP = 1.5
"""Seconds within which a slip must be placed to be told as a moment."""
_LOOK_AT_CLAMP = (
    "Look at the clamp, then calibrate the mount again; if the object did lean against something, "
    "all is well."
)


@dataclass(frozen=True)
class GroundRest:
    """A stretch in which the object stands on the floor, or on a table, or seems to after a slip."""

    start: int
    stop: int
    """Frames at 30 fps."""
    T_world_object: Float64[np.ndarray, "4 4"]
    """Its mean pose."""
    height: float
    """Height of the object's lowest point over the floor, metres."""
    on_floor: bool
    """Whether that is next to nothing."""
    steady: bool
    """Whether it is too still to be held."""
    path: float
    """Metres that the object had gone by then."""


class _Pair(NamedTuple):
    """Two rests on one side, and how much more they differ than they may."""

    first: GroundRest
    second: GroundRest
    tilt: float
    tilt_limit: float
    rise: float
    rise_limit: float

    @property
    def excess(self) -> float:
        return max(self.tilt / self.tilt_limit, self.rise / self.rise_limit)


def slip(look: CheckedSession, rests: Sequence[GroundRest]) -> Check:
    """Compare each rest with the last one before it on the same side of the object.

    A slip about the vertical or along the floor changes neither tilt nor height: it does not show.
    """
    pairs = _pairs(rests)
    if not pairs:
        message = "not checked: the object rests on one side of it only once"
        return Check("mount slip", "ok", message)
    worst = max(pairs, key=lambda pair: pair.excess)
    if worst.excess < 1:
        message = (
            f"from rest to rest its tilt differs by {worst.tilt:.1f} deg and its height by "
            f"{100 * worst.rise:.1f} cm (a slip of {worst.tilt_limit:.1f} deg or "
            f"{100 * worst.rise_limit:.0f} cm would show)"
        )
        return Check("mount slip", "ok", message)
    if worst.tilt < worst.tilt_limit:
        return _risen(look, worst)
    start, stop = _when(look, worst)
    if (stop - start) / FPS < _SHARP:
        moment = f"at about {(start + stop) / 2 / FPS:.1f} s"
    else:
        moment = f"between {start / FPS:.1f} and {stop / FPS:.1f} s"
    message = (
        f"its tilt differs by {worst.tilt:.1f} deg from one rest to the next, by gravity's noise and "
        f"floors at most {worst.tilt_limit:.1f}; it changes {moment}"
    )
    return Check("mount slip", "warn", message, look.logged(start, stop), _LOOK_AT_CLAMP)


def _risen(look: CheckedSession, pair: _Pair) -> Check:
    message = (
        f"its lowest point is {100 * pair.rise:.1f} cm higher or lower in one rest than in the "
        f"last, by drift at most {100 * pair.rise_limit:.1f}"
    )
    frames = look.logged(pair.first.stop - 1, pair.second.start + 1)
    fix = f"{_LOOK_AT_CLAMP} It also looks so when the two places are not equally high."
    return Check("mount slip", "warn", message, frames, fix)


def _pairs(rests: Sequence[GroundRest]) -> list[_Pair]:
    found: list[_Pair] = []
    for k, second in enumerate(rests):
        for first in reversed(rests[:k]):
            pair = _pair(first, second)
            if pair.tilt < _SAME_SIDE:
                found.append(pair)
                break
    return found


def _pair(first: GroundRest, second: GroundRest) -> _Pair:
    """How two rests differ, and how far honest ones differ at most."""
    turned = second.T_world_object[:3, :3] @ first.T_world_object[:3, :3].T
    ups = first.T_world_object[2, :3] @ second.T_world_object[2, :3]
    half = np.arctan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1]) / 2
    # A world that leans tilts an object the other way when it has turned round.
    sd = np.sqrt(2 * (_WANDER**2 + _UNEVEN**2) + (2 * _LEAN * np.sin(half)) ** 2)
    apart = np.linalg.norm(second.T_world_object[:2, 3] - first.T_world_object[:2, 3])
    gone = second.path - first.path
    height = np.sqrt(_HEIGHT**2 + (_DRIFT * gone) ** 2 + (np.radians(_LEAN) * apart) ** 2)
    return _Pair(
        first,
        second,
        tilt=float(np.degrees(np.arccos(np.clip(ups, -1, 1)))),
        tilt_limit=float(np.sqrt(chi2_quantile(_SURE, 2)) * sd),
        rise=abs(second.height - first.height) if _both_stand(first, second) else 0.0,
        rise_limit=float(normal_from_tail((1 - _SURE) / 2) * height),
    )


def _both_stand(first: GroundRest, second: GroundRest) -> bool:
    """Whether what holds the object up in two rests is no hand."""
    return (first.on_floor and second.on_floor) or (first.steady and second.steady)


def _when(look: CheckedSession, pair: _Pair) -> tuple[int, int]:
    """(start, stop) of the frames at which the tilt may have gone from that of the one rest to the other's.

    The moment that leaves the least difference from the first rest before it and from the second
    after it; differences count no more than the slip's own, so that tilts of the carry do not matter.
    """
    assert look.take is not None
    first, last = pair.first.stop, pair.second.start
    ups = look.take.motion.T_world_object[first:last, 2, :3]
    ends = [rest.T_world_object[2, :3] for rest in (pair.first, pair.second)]
    most = float(np.linalg.norm(ends[1] - ends[0]))
    before, after = (np.minimum(np.linalg.norm(ups - end, axis=1), most) ** 2 for end in ends)
    left = np.concatenate([[0.0], np.cumsum(before)]) + np.concatenate(
        [np.cumsum(after[::-1])[::-1], [0.0]]
    )
    likely = np.flatnonzero(left <= left.min() + _DOUBT * FPS * most**2)
    return first + int(likely[0]), first + int(likely[-1]) + 1
