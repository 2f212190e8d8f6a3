"""What a request says of the person: where they stood, on which side they held, with which hands."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float

from capture_app.commands.run import RunRequest
from capture_app.commands.text_values import Place
from capture_app.manifest import Segment
from ingest.mount import Mount
from omomo_core.contact.decode import HandChoice
from omomo_core.contact.segment import ContactSpan
from omomo_core.contact.static_stability import middle_of_hold, must_be_held
from omomo_core.errors import InputError
from omomo_core.generation.conditioning import Conditioning, PlaceInTime
from omomo_core.generation.selection.person_constraint import (
    SideWord,
    side_off,
)
from omomo_core.generation.selection.plausibility import has_front
from omomo_core.generation.selection.selection_config import PERSON_CONSTRAINT
from omomo_core.geometry.distance_field import distance_field
from omomo_core.geometry.object_features import object_features
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
FREE = 0.3
"""Room before a screen in which nothing is where somebody taps it, metres."""
ASIDE = 0.08
"""The same to each side of its middle, metres."""
UPRIGHT = 0.3
"""How far (sine of the angle) a screen must be from level to be seen from one side."""


OTHER_SIDE = 60.0
"""Degrees from the side that is said beyond which a person is on another."""
OTHER_HAND = 0.1
"""Share of the frames in which a hand holds that must not."""


@dataclass(frozen=True)
class KnownPerson:
    """What is said of the person, checked; None where nothing is."""

    start: Place | None
    """Place at which they stood when the take began, world, metres."""
    end: Place | None
    """Place at which they stand as it ends, world, metres."""
    side: SideWord | PlaceInTime | None
    """Side on which they hold the object."""
    hands: HandChoice | None

    def conditioning(self, contacts: tuple[ContactSpan, ...] | None) -> Conditioning:
        """Return this and the contacts as the generator takes them."""
        return Conditioning(
            contacts=contacts,
            start_position=None if self.start is None else np.array(self.start),
            end_position=None if self.end is None else np.array(self.end),
            side=self.side,
            held_with=self.hands,
        )

    def notes(self, human: HumanMotion, motion: ObjectMotion) -> Iterator[str]:
        """Yield what to know where a person does not do what is said."""
        if (off := _away(self.start, human, 0)) > ASTRAY:
            yield (
                f"The person begins {off:.1f} m from where ‹stood› says: too far to come from in the time "
                "before they take the object."
            )
        if (off := _away(self.end, human, -1)) > ASTRAY:
            yield (
                f"The person ends {off:.1f} m from where ‹ends› says: too far to go to in the time after "
                "they let go of the object."
            )
        if self.side is not None and self._off_side(human, motion) > OTHER_SIDE:
            yield (
                "The person is on another side of the object than ‹side› says: no sample could hold it "
                "from there, or that time is not within the first 20 s."
            )
        wrong = {"left": (1,), "right": (0,)}.get(self.hands or "", ())
        held = human.hand_contact > 0.5
        if any(held[:, hand].mean() > OTHER_HAND for hand in wrong):
            yield "The other hand than ‹hands› says holds the object, too: contacts can be corrected."

    def _off_side(self, human: HumanMotion, motion: ObjectMotion) -> float:
        take, side = object_features(motion), self.side
        place = human.root[None, :, :2] - take.centre[:, :2]
        if isinstance(side, PlaceInTime):
            said = side.place - take.centre[side.frame, :2]
            return abs(float(side_off(place, said, take.velocity, side.frame)[0]))
        assert side is not None
        return abs(float(side_off(place, side, take.velocity, 0)[0]))


def _away(place: Place | None, human: HumanMotion, frame: int) -> float:
    """Return how far the person is from a place in a frame, metres; 0 where none is given."""
    return 0.0 if place is None else float(np.linalg.norm(human.root[frame, :2] - place))


def known_person(
    request: RunRequest, motion: ObjectMotion, mount: Mount, segment: Segment
) -> KnownPerson:
    """Return what a request says of the person.

    Args:
        request: `stood`, `ends`, `side` and `hands` say it.
        motion: the object's, the chosen segment of the take.
        mount: of the phone.
        segment: which that is.

    Raises:
        InputError: "NAME-unused", "NAME-far" or "NAME-inside", where NAME is the field; "stood-no-phone",
            "stood-level", "stood-hidden", "stood-later", "side-middle", "side-no-way", "hands-unused":
            nobody can have been there, or it does not say where.
    """
    said = {"stood": request.stood, "ends": request.ends, "side": request.side}
    said["hands"] = None if request.hands == "auto" else request.hands
    for name in (name for name, value in said.items() if value is not None):
        _check_used(name, request)
    side = _side(request.side, motion)
    if request.ends is not None:
        _check_place("ends", request.ends, motion, len(motion.valid) - 1)
    hands = None if request.hands == "auto" else request.hands
    start = _start_position(request, motion, mount, segment)
    return KnownPerson(start, request.ends, side, hands)


def _check_used(name: str, request: RunRequest) -> None:
    """Refuse what nothing would heed."""
    if request.configuration == "paper":
        what = "The published model finds its own place and hands for the person."
        raise _wrong(name, "unused", what, f"‹{name}›")
    if name == "hands" and request.contacts is not None:
        what = "The contacts that are given say which hand holds the object."
        raise _wrong(name, "unused", what, "‹hands›")
    if name == "hands" and not request.has_segments:
        what = "By the published contact rule each hand holds from its first touch to the end."
        raise _wrong(name, "unused", what, "‹hands›")


def _side(said: SideWord | Place | None, motion: ObjectMotion) -> SideWord | PlaceInTime | None:
    """Return the side on which the person holds the object, checked."""
    if said is None:
        return None
    take = object_features(motion)
    if isinstance(said, str):
        if has_front(take.velocity):
            return said
        raise InputError(
            "side-no-way",
            "The object stays about where it is, or goes to and fro: it has no front and no back.",
            where=f"‹side› {said}",
            fix="Give the place x,y on the floor where the person was as they held it.",
        )
    middle = middle_of_hold(must_be_held(take))
    _check_place("side", said, motion, middle)
    if np.linalg.norm(np.array(said) - take.centre[middle, :2]) < PERSON_CONSTRAINT.nearest_side:
        what = f"That is the middle of the object {_WHEN['side']}: no side of it."
        raise _wrong("side", "middle", what, f"‹side› {said[0]:g},{said[1]:g}")
    return PlaceInTime(np.array(said), middle)


def _start_position(
    request: RunRequest, motion: ObjectMotion, mount: Mount, segment: Segment
) -> Place | None:
    """Return the place where somebody stood; None where it is not said.

    Args:
        request: `stood` says it, as a place or as "phone", before the phone's screen.
        motion: the object's, the chosen segment of the take.
        mount: of the phone.
        segment: which that is.

    Raises:
        InputError: as `known_person`.
    """
    if request.stood == "phone":
        _check_phone(request, segment)
        points = apply(motion.T_world_object[:1], sample_surface(motion.mesh).points)[0]
        return _before_screen(mount, motion, points)
    if request.stood is not None:
        _check_place("stood", request.stood, motion, 0)
    return request.stood


_WHEN = {
    "stood": "as the take begins",
    "ends": "as the take ends",
    "side": "in the middle of the time that it is held",
}


def _check_place(name: str, place: Place, motion: ObjectMotion, frame: int) -> None:
    """Refuse a place where nobody who moves the object can be in a frame."""
    x, y = place
    where = f"‹{name}› {x:g},{y:g}"
    if not (math.isfinite(x) and math.isfinite(y)):
        raise _wrong(name, "invalid", "The place where the person stood is no number.", where)
    points = apply(motion.T_world_object[frame : frame + 1], sample_surface(motion.mesh).points)[0]
    off = float(np.linalg.norm(points[:, :2] - (x, y), axis=1).min())
    if off > FARTHEST:
        at = ",".join(f"{v:.1f}" for v in points[:, :2].mean(axis=0))
        what = f"This is {off:.1f} m from the object {_WHEN[name]}; that is about {at} then."
        raise _wrong(name, "far", what, where)
    if not _clear(np.array([[x, y]]), motion, frame)[0]:
        raise _wrong(name, "inside", f"The object is there {_WHEN[name]}.", where)


def _check_phone(request: RunRequest, segment: Segment) -> None:
    if request.animated:
        raise _wrong("stood", "no-phone", "An object's own motion has no phone.", "‹stood› phone")
    if segment.start > LATE * FPS:
        raise _wrong(
            "stood",
            "later",
            "The stretch that is used does not begin with the recording: nobody taps the screen then.",
            "‹stood› phone",
        )


def _before_screen(
    mount: Mount, motion: ObjectMotion, points: Float[np.ndarray, "points 3"]
) -> Place:
    """Return the place before the phone's screen that is as near as the object lets somebody stand."""
    T_world_phone = motion.T_world_object[0] @ np.linalg.inv(mount.T_phone_object)
    toward = T_world_phone[:2, 2]
    if np.linalg.norm(toward) < UPRIGHT:
        what = "The phone's screen faces up or down: it has no side."
        raise _wrong("stood", "level", what, "‹stood› phone")
    local = apply(np.linalg.inv(T_world_phone)[None], points)[0]
    before = (local[:, 2] > 0) & (local[:, 2] < FREE)
    if (before & (np.abs(local[:, :2]) < ASIDE).all(axis=1)).any():
        what = "The object is right before the phone's screen: nobody taps it there."
        raise _wrong("stood", "hidden", what, "‹stood› phone")
    ways = np.outer(BEFORE_SCREEN, toward / np.linalg.norm(toward))
    places = T_world_phone[:2, 3] + ways
    clear = places[_clear(places, motion)]
    if not len(clear):
        what = "The object fills the place before the phone's screen."
        raise _wrong("stood", "hidden", what, "‹stood› phone")
    x, y = clear[0].tolist()
    return x, y


def _clear(
    places: Float[np.ndarray, "places 2"], motion: ObjectMotion, frame: int = 0
) -> Bool[np.ndarray, " places"]:
    """Return the mask of places at which a post as high as HEAD is outside the object in a frame."""
    height = np.arange(0, HEAD, NEAREST)
    posts = np.concatenate(
        [np.repeat(places, len(height), axis=0), np.tile(height, len(places))[:, None]], axis=1
    )
    local = to_local(motion.T_world_object[frame : frame + 1], posts[None])[0]
    far = distance_field(motion.mesh).at(torch.from_numpy(local).float())
    return (far.reshape(len(places), -1).amin(dim=1) > NEAREST).numpy()


def _wrong(name: str, code: str, what: str, where: str) -> InputError:
    fix = "Give x,y in metres on the floor of the result's world, at most 3 m from the object."
    if where == "‹stood› phone":
        fix = "Leave it out, and if the result has the person on the wrong side, give ‹stood› x,y."
    return InputError(
        f"{name}-{code}", what, where=where, fix="Leave it out." if code == "unused" else fix
    )
