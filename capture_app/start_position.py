"""Where the person stood when a take began, as a user says it."""

import math
from collections.abc import Iterator

import numpy as np
import torch
from jaxtyping import Bool, Float

from capture_app.commands.run import RunRequest
from capture_app.commands.text_values import Place
from capture_app.manifest import Segment
from ingest.mount import Mount
from omomo_core.errors import InputError
from omomo_core.geometry.distance_field import distance_field
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import apply, to_local
from omomo_core.motion import FPS, HumanMotion, ObjectMotion

FARTHEST = 3.0
"""Metres from the object: who is farther away takes seconds to come."""
NEAREST = 0.05
"""Metres from what is lower than HEAD: nobody stands in it."""
HEAD = 1.2
ASTRAY = 0.5
"""Metres from the place beyond which a person is not where they stood."""
BEFORE_SCREEN = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Metres from the phone at which somebody taps its screen; the first that is clear of the object."""
LATE = 2.0
"""Seconds into the recording in which who tapped the phone is still there: the object is to rest."""
FREE, ASIDE = 0.3, 0.08
"""Metres before a screen, and to its sides, in which nothing is where somebody taps it."""
UPRIGHT = 0.3
"""How far (sine of the angle) a screen must be from level to be seen from one side."""


def start_position(
    request: RunRequest, motion: ObjectMotion, mount: Mount, segment: Segment
) -> Place | None:
    """Where somebody stood; None where it is not said.

    Args:
        request: `stood` says it, as a place or as "phone", before the phone's screen.
        motion: the object's, the chosen segment of the take.
        mount: of the phone.
        segment: which that is.

    Raises:
        InputError: "stood-unused", "stood-invalid", "stood-far", "stood-inside", "stood-no-phone",
            "stood-level", "stood-hidden" or "stood-later": nobody can have stood there, or it does
            not say where.
    """
    if request.stood is None:
        return None
    if request.configuration == "paper":
        raise _wrong("unused", "The published model finds its own place for the person.", "--stood")
    points = apply(motion.T_world_object[:1], sample_surface(motion.mesh).points)[0]
    if request.stood == "phone":
        _check_phone(request, segment)
        return _before_screen(mount, motion, points)
    x, y = request.stood
    where = f"--stood {x:g},{y:g}"
    if not (math.isfinite(x) and math.isfinite(y)):
        raise _wrong("invalid", "The place where the person stood is no number.", where)
    off = float(np.linalg.norm(points[:, :2] - (x, y), axis=1).min())
    if off > FARTHEST:
        raise _wrong("far", f"This is {off:.1f} m from the object as the take begins.", where)
    if not _clear(np.array([[x, y]]), motion)[0]:
        raise _wrong("inside", "The object is there as the take begins.", where)
    return x, y


def start_position_note(place: Place | None, human: HumanMotion) -> Iterator[str]:
    """What to know where somebody does not begin where they were said to."""
    off = 0.0 if place is None else float(np.linalg.norm(human.root[0, :2] - place))
    if off > ASTRAY:
        yield (
            f"The person begins {off:.1f} m from where --stood says: too far to come from in the time "
            "before they take the object."
        )


def _check_phone(request: RunRequest, segment: Segment) -> None:
    if request.animated:
        raise _wrong("no-phone", "An object's own motion has no phone.", "--stood phone")
    if segment.start > LATE * FPS:
        raise _wrong(
            "later",
            "The stretch that is used does not begin with the recording: nobody taps the screen then.",
            "--stood phone",
        )


def _before_screen(
    mount: Mount, motion: ObjectMotion, points: Float[np.ndarray, "points 3"]
) -> Place:
    """As near before the phone's screen as the object lets somebody stand."""
    T_world_phone = motion.T_world_object[0] @ np.linalg.inv(mount.T_phone_object)
    toward = T_world_phone[:2, 2]
    if np.linalg.norm(toward) < UPRIGHT:
        raise _wrong(
            "level", "The phone's screen faces up or down: it has no side.", "--stood phone"
        )
    seen = apply(np.linalg.inv(T_world_phone)[None], points)[0]
    before = (seen[:, 2] > 0) & (seen[:, 2] < FREE)
    if (before & (np.abs(seen[:, :2]) < ASIDE).all(axis=1)).any():
        raise _wrong(
            "hidden",
            "The object is right before the phone's screen: nobody taps it there.",
            "--stood phone",
        )
    ways = np.outer(BEFORE_SCREEN, toward / np.linalg.norm(toward))
    places = T_world_phone[:2, 3] + ways
    clear = places[_clear(places, motion)]
    if not len(clear):
        raise _wrong(
            "hidden", "The object fills the place before the phone's screen.", "--stood phone"
        )
    x, y = clear[0].tolist()
    return x, y


def _clear(
    places: Float[np.ndarray, "places 2"], motion: ObjectMotion
) -> Bool[np.ndarray, " places"]:
    """Where a post as high as HEAD is outside the object as the take begins."""
    height = np.arange(0, HEAD, NEAREST)
    posts = np.concatenate(
        [np.repeat(places, len(height), axis=0), np.tile(height, len(places))[:, None]], axis=1
    )
    local = to_local(motion.T_world_object[:1], posts[None])[0]
    far = distance_field(motion.mesh).at(torch.from_numpy(local).float())
    return (far.reshape(len(places), -1).amin(dim=1) > NEAREST).numpy()


def _wrong(code: str, what: str, where: str) -> InputError:
    fix = "Give x,y in metres on the floor of the result's world, at most 3 m from the object."
    if where == "--stood phone":
        fix = "Leave it out, and if the result has the person on the wrong side, give --stood x,y."
    return InputError(
        f"stood-{code}", what, where=where, fix="Leave it out." if code == "unused" else fix
    )
