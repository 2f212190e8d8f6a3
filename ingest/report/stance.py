"""Checks from the rests of the object: floor, drift, a mount that slipped."""

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.report.checked_session import CheckedSession
from ingest.report.clamp_checks import GroundRest, slip
from ingest.report.take_report import Check, Severity, grade, graded, worst
from ingest.session import GRAVITY
from ingest.trajectory.object_motion import ObjectTake
from ingest.trajectory.rests import (
    find_rests,
    is_steady,
    standing_sides,
    tilt_from_standing,
)
from ingest.trajectory.trajectory_config import RESTS, STANDING
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import frame_noise
from omomo_core.motion import FPS

_ON_FLOOR = 0.06
"""Metres of the lowest point above the floor of an object that stands on it."""
_NEAR_FLOOR = 0.4
"""The same under a mount that slipped: half a metre of arm and a steep turn."""
_BELOW_FLOOR, _FAR_BELOW = -0.1, -0.3
"""Metres by which a thing may seem to go into the floor, and by which none does."""
_WRONG_TILT = 20.0
"""Degrees from standing by itself from which on the mount, the mesh or the log's axes are wrong."""
_LIFTED, _TOO_HIGH = 2.1, 2.3
"""Metres of the lowest point over the floor that few reach, and nobody without a ladder."""
_SHELF = 1.8
"""Metres over the floor at which hardly anything stands that a person puts things on."""
_FALL_WINDOW = 7
"""Frames over which an acceleration is taken."""
_FREE = 3.0
"""How far from gravity's an acceleration may be in a free fall, m/s^2: people lower things at less."""
_FALL_SECONDS = 0.1
"""Shortest time of a fall."""
_DROP = 0.1
"""Shortest way of a fall, metres."""
_UPRIGHT = np.cos(np.radians(25.0))
"""Cosine between an axis of the mesh and up where that axis points up."""
_ON_MARK, _MARK_TURN = 0.3, 20.0
"""Metres and degrees within which an object was meant to be back where it started."""
_DRIFT = 0.05
_FIX_REST = (
    "Start and end the take with the object on the floor for a second, or give the floor's height "
    "(‹floor›)."
)
_FIX_MOUNT = (
    "Look at the clamp, then calibrate the mount again; if the object did lean against something, "
    "all is well."
)
_FIX_AXES = (
    "Check that mount and mesh belong together (‹mount› maps points of the mesh into the phone's axes, "
    "not the other way round), that the mesh lacks no leg, and which way is up in the log (‹up›). If the "
    "object did lean against something, add ‹force›."
)


def rests(look: CheckedSession) -> Check:
    """Check of the intervals in which the phone stands still."""
    if not look.rests:
        return Check("rests", "ok", "none of half a second")
    spans = [f"{start / FPS:.1f} to {stop / FPS:.1f} s" for start, stop in look.rests]
    more = f" and {len(spans) - 4} more" if len(spans) > 4 else ""
    message = f"still at {', '.join(spans[:4])}{more}"
    first, last = look.rests[0][0], look.rests[-1][1]
    return Check("rests", "ok", message, look.logged(first, last))


def floor(look: CheckedSession) -> Check:
    """Whether the floor is known, and the object stays above it."""
    take = look.object_take
    if take is None:
        return _floor_of_phone(look)
    lowest = float(np.percentile(bottom(take)[take.motion.valid], 1))
    if lowest < _BELOW_FLOOR:
        message = f"the object goes {-lowest:.2f} m below the floor"
        severity = "bad" if lowest < _FAR_BELOW else "warn"
        return Check("floor", severity, message, fix="Correct ‹floor›, or the mount.")
    severity = "ok" if take.floor.certain else "bad"
    return graded("floor", severity, take.floor.message, _FIX_REST)


def lifted(look: CheckedSession) -> list[Check]:
    """Whether a person can lift the object as high as it goes; none without the object."""
    take = look.object_take
    if take is None:
        return []
    start, stop = look.chosen
    heights = bottom(take)
    at = start + int(heights[start:stop].argmax())
    message = f"the object's lowest point goes up to {heights[at]:.2f} m above the floor"
    severity = grade(float(heights[at]), _LIFTED, _TOO_HIGH)
    fix = (
        "Check which way is up in the log (‹up›), that positions and mesh are in metres, and the floor "
        "(‹floor›)."
    )
    unheld = _highest_unheld(take, heights, start, stop)
    if unheld is not None and unheld[0] > _NEAR_FLOOR:
        level, at = unheld
        message = f"it stands still {level:.2f} m above the floor, with nobody holding it"
        severity = "bad" if level > _SHELF else worst([severity, "warn"])
        fix = (
            f"If it stood on a table or a shelf there, all is well. Else: {fix[0].lower()}{fix[1:]}"
        )
    return [graded("height", severity, message, fix, look.logged(at, at + 1))]


def _highest_unheld(
    take: ObjectTake, heights: Float64[np.ndarray, " frames"], start: int, stop: int
) -> tuple[float, int] | None:
    """Height and first frame of the highest rest that no hand holds; None where there is none."""
    T, valid = take.motion.T_world_object, take.motion.valid
    noise = frame_noise(T, valid, RESTS.quiet_share)
    levels = [
        (float(np.median(heights[start + a : start + b])), start + a)
        for a, b in find_rests(T[start:stop], valid[start:stop])
        if is_steady(T[start + a : start + b], noise)
    ]
    return max(levels, default=None)


def falls(look: CheckedSession) -> list[Check]:
    """Amber where the object falls freely: nobody holds it then, and the person is a guess."""
    take = look.object_take
    if take is None or len(take.motion.valid) < _FALL_WINDOW:
        return []
    height = take.motion.T_world_object[:, 2] @ np.append(
        sample_surface(take.motion.mesh).centre, 1
    )
    pulled = _second_difference(height)
    free = (np.abs(pulled + GRAVITY) < _FREE) & take.motion.valid
    drops = [
        (a, b, height[a] - height[b - 1]) for a, b in runs(free) if b - a >= _FALL_SECONDS * FPS
    ]
    drops = [drop for drop in drops if drop[2] > _DROP]
    if not drops:
        return [Check("fall", "ok", "it never falls freely")]
    start, stop, metres = max(drops, key=lambda drop: drop[2])
    message = (
        f"it falls freely from {start / FPS:.1f} to {stop / FPS:.1f} s, by {metres:.2f} m and more"
    )
    fix = "Nobody holds what falls: cut the take before it, or put the object down."
    return [Check("fall", "warn", message, look.logged(start, stop), fix)]


def _second_difference(height: Float64[np.ndarray, " frames"]) -> Float64[np.ndarray, " frames"]:
    """Vertical acceleration, m/s^2, by a parabola through a fifth of a second about each frame."""
    half = _FALL_WINDOW // 2
    across = np.arange(-half, half + 1) / FPS
    weights = 2 * np.linalg.pinv(np.stack([across**0, across, across**2], axis=1))[2]
    return np.convolve(np.pad(height, half, mode="edge"), weights[::-1], mode="valid")


def _floor_of_phone(look: CheckedSession) -> Check:
    if not look.rests:
        message = "nothing stands still for half a second: the floor would be a guess"
        return Check("floor", "warn", message, fix=_FIX_REST)
    heights = look.poses[0][:, 2, 3]
    start, stop = min(look.rests, key=lambda rest: float(np.median(heights[slice(*rest)])))
    message = f"from where the object stands still, {start / FPS:.1f} to {stop / FPS:.1f} s"
    return Check("floor", "ok", message, look.logged(start, stop))


def closure(look: CheckedSession) -> Check:
    """How far from its first rest the object ends, if it seems to have been brought back to it."""
    ends = None if look.take is None else look.take.closure
    if ends is None:
        message = "drift is not measured: the object does not rest at both ends"
        return Check("closure", "ok", message)
    away = ends.translation
    if away > _ON_MARK or ends.rotation > _MARK_TURN:
        message = f"drift is not measured: the object ends {away:.2f} m from where it began"
        return Check("closure", "ok", message)
    message = f"back within {100 * away:.1f} cm and {ends.rotation:.1f} deg of where it began"
    if away > _DRIFT:
        message += "; if it was put back on its mark, tracking drifted by that"
    return Check("closure", "ok", message)


def object_checks(look: CheckedSession) -> list[Check]:
    """How the object stands, and whether it stands alike each time; none without the object."""
    take = look.object_take
    if take is None or look.mesh is None:
        return []
    sides = standing_sides(look.mesh)
    standing = _standing_rests(take) if len(sides) else []
    grounded = [rest for rest in standing if rest.on_floor]
    if not grounded:
        message = "not checked: the object does not rest on the floor"
        return [Check(name, "ok", message) for name in ("standing", "which way up", "mount slip")]
    return [_standing(look, grounded, sides), _right_way_up(standing), slip(look, standing)]


def _right_way_up(standing: list[GroundRest]) -> Check:
    """Say which axis of the mesh points up where the object stands: a turned mount may show there alone."""
    ups = np.stack([rest.T_world_object[2, :3] for rest in standing])
    axis = int(np.abs(ups[0]).argmax())
    name = f"{'-' if ups[0, axis] < 0 else ''}{'xyz'[axis]}"
    if (ups[:, axis] * np.sign(ups[0, axis]) > _UPRIGHT).all():
        return Check("which way up", "ok", f"the mesh's {name} axis points up where it stands")
    return Check("which way up", "ok", "it stands on several sides, or leans")


def _standing_rests(take: ObjectTake) -> list[GroundRest]:
    """The rests at the floor, and others near it that no hand holds so still."""
    T, heights = take.motion.T_world_object, bottom(take)
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    noise = frame_noise(T, take.motion.valid, RESTS.quiet_share)
    found: list[GroundRest] = []
    for start, stop in find_rests(T, take.motion.valid):
        height = float(np.median(heights[start:stop]))
        on_floor, steady = abs(height) < _ON_FLOOR, is_steady(T[start:stop], noise)
        if on_floor or (abs(height) < _NEAR_FLOOR and steady):
            pose = _mean_pose(T[start:stop])
            path = float(gone[start])
            found.append(GroundRest(start, stop, pose, height, on_floor, steady, path))
    return found


def _standing(
    look: CheckedSession, grounded: list[GroundRest], sides: Float64[np.ndarray, "sides 3"]
) -> Check:
    """Red where the object rests unheld as it cannot stand; a hand may hold a mop upright."""
    tilts = [tilt_from_standing(rest.T_world_object[:3, :3], sides)[0] for rest in grounded]
    severities: list[Severity] = [
        grade(tilt, STANDING.lean, _WRONG_TILT if rest.steady else 180.0)
        for tilt, rest in zip(tilts, grounded, strict=True)
    ]
    severity = worst(severities)
    most = max((k for k, one in enumerate(severities) if one == severity), key=lambda k: tilts[k])
    message = f"it rests {tilts[most]:.1f} deg from standing by itself"
    place = look.logged(grounded[most].start, grounded[most].stop)
    if severity != "bad":
        return graded("standing", severity, message, _FIX_MOUNT, place)
    return Check("standing", "bad", message, place, _FIX_AXES)


def bottom(take: ObjectTake) -> Float64[np.ndarray, " frames"]:
    """Height of the object's lowest point over the floor in each frame, metres."""
    corners = sample_surface(take.motion.mesh).outline
    T = take.motion.T_world_object
    return (T[:, 2, :3] @ corners.T).min(axis=1) + T[:, 2, 3]


def _mean_pose(T: Float64[np.ndarray, "frames 4 4"]) -> Float64[np.ndarray, "4 4"]:
    mean = np.eye(4)
    mean[:3, :3] = Rotation.from_matrix(T[:, :3, :3]).mean().as_matrix()
    mean[:3, 3] = T[:, :3, 3].mean(axis=0)
    return mean
