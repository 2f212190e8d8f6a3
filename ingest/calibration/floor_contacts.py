"""Rests on the floor: flat sides of the object, which one it stands on, and the level of the floor."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float64
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from ingest.distributions import chi2_quantile
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.gravity import known_up, upright
from ingest.trajectory.plane import depth_points, fit_plane
from ingest.trajectory.rests import find_rests, is_steady, standing_sides
from ingest.trajectory.segments import check_rate, find_breaks
from ingest.trajectory.smooth import resample, smooth
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import apply
from omomo_core.motion import FPS, ObjectMesh

_WINDOW = round(FPS)
_LEVEL, _UPRIGHT = 0.012, np.radians(1.2)
"""Metres and rad by which a pushed phone's height and tilt change within a second; a carried one
bobs by 2 cm with every step, and a world that leans by half a degree rises by 1 cm in a metre."""
_PUSHED = 0.3
"""Metres that a thing is pushed at least."""
_CLIMB = 0.03
"""Metres that its height may change from one end of a push to the other: tracking drifts."""


@dataclass(frozen=True)
class Contact:
    """A stretch in which the object seems to stand, or to be pushed over the floor."""

    kind: Literal["rest", "push"]
    start: int
    stop: int
    """Frames at 30 fps."""
    down: Float64[np.ndarray, "3"]
    """Unit vector of gravity in the phone's axes, of the poses."""
    sway: Float64[np.ndarray, "3 2"]
    """How `down` changes with gravity's x and y in the world; a phone that turns sways less."""
    place: Float64[np.ndarray, "3"]
    """Place of the camera, in the session's world turned z up, metres."""
    path: float
    """Metres the phone had gone by then."""

    @property
    def height(self) -> float:
        """Height of the camera over the origin of the session's world, metres."""
        return float(self.place[2])

    @property
    def when(self) -> str:
        """In seconds from the start of the take."""
        return f"{self.start / FPS:.1f} to {self.stop / FPS:.1f} s"


@dataclass(frozen=True)
class PhoneTrack:
    """The poses of a session's phone, resampled and turned z up."""

    T_zup_phone: Float64[np.ndarray, "frames 4 4"]
    """30 fps, in the session's world turned z up."""
    valid: Bool[np.ndarray, " frames"]
    T_zup_session: Float64[np.ndarray, "4 4"]


def track(session: CaptureSession) -> PhoneTrack:
    """The phone over time, where the log or the accelerometer says which way is up.

    Raises:
        InputError: "rate-too-low", "floor-gravity", "gravity-wrong".
    """
    check_rate(session)
    up = known_up(session)
    if up is None:
        raise InputError(
            "floor-gravity",
            f"{session.app} does not log which way is up, and there is no accelerometer: the floor "
            "says nothing then.",
            where=str(session.source),
            fix="Record with an app whose world is gravity aligned, such as Stray Scanner.",
        )
    broken = find_breaks(session).any
    calm = smooth(session, broken)
    T, valid = resample(calm.times, calm.T_world_phone, broken)
    T_zup_session = upright(up)
    return PhoneTrack(T_zup_session @ T, valid, T_zup_session)


def find_contacts(seen: PhoneTrack) -> list[Contact]:
    """The rests that are too steady for hands, and the level stretches between them, in order.

    A thing on a table, or carried with a steady hand, looks alike: heights tell it later.
    """
    T = seen.T_zup_phone
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    rests = find_rests(T, seen.valid)
    steady = [_contact("rest", T, gone, *span) for span in rests if is_steady(T[slice(*span)])]
    moving = seen.valid.copy()
    for start, stop in rests:
        moving[start:stop] = False
    pushed = [
        _contact("push", T, gone, start, stop)
        for start, stop in _level(T, moving)
        if np.linalg.norm(np.ptp(T[start:stop, :2, 3], axis=0)) > _PUSHED
        and np.ptp(T[start:stop, 2, 3]) < _CLIMB
    ]
    return sorted(steady + pushed, key=lambda contact: contact.start)


def _contact(
    kind: Literal["rest", "push"],
    T: Float64[np.ndarray, "frames 4 4"],
    gone: Float64[np.ndarray, " frames"],
    start: int,
    stop: int,
) -> Contact:
    world = T[start:stop, :3, :3].mean(axis=0).T
    down = -world[:, 2]
    return Contact(
        kind=kind,
        start=start,
        stop=stop,
        down=down / np.linalg.norm(down),
        sway=world[:, :2],
        place=T[start:stop, :3, 3].mean(axis=0),
        path=float(gone[(start + stop) // 2]),
    )


def _level(
    T: Float64[np.ndarray, "frames 4 4"], moving: Bool[np.ndarray, " frames"]
) -> list[tuple[int, int]]:
    """(start, stop) of the moving stretches in which height and tilt hardly change in any second."""
    if len(T) < _WINDOW:
        return []
    windows = np.lib.stride_tricks.sliding_window_view
    level = np.ptp(windows(T[:, 2, 3], _WINDOW), axis=-1) < _LEVEL
    level &= (
        np.linalg.norm(np.ptp(windows(T[:, 2, :3], _WINDOW, axis=0), axis=-1), axis=1) < _UPRIGHT
    )
    level &= windows(moving, _WINDOW).all(axis=-1)
    found = np.zeros(len(T), bool)
    for k in range(_WINDOW):
        found[np.flatnonzero(level) + k] = True
    return runs(found)


_ONE_SIDE = np.radians(4.0)
"""Facets of the hull that differ by less, one to the next, are one side of a rough mesh."""
_APART = np.radians(15.0)
"""A side that has another one nearer than this is part of something round."""
_SLACK = 0.01
"""Part of the object's size by which feet may differ in height and still all stand."""
_MESH_TILT = np.radians(0.3)
"""A scan's feet are out by a millimetre or two over half a metre."""
_NARROW = 0.02
"""Part of the object's size: feet nearer to one line than this bear no plane."""


@dataclass(frozen=True)
class Side:
    """The points by which the object touches the floor when it stands on this side."""

    down: Float64[np.ndarray, "3"]
    """Unit vector in the object's frame that points down then."""
    centre: Float64[np.ndarray, "3"]
    """Point of that plane amid the feet, object frame, metres."""
    sd: float
    """How well `down` is known in each direction, rad."""


def flat_sides(mesh: ObjectMesh) -> list[Side]:
    """The sides on which the object stands so firmly that they tell how it is tilted.

    Round things and flat meshes have none.
    """
    normals = standing_sides(mesh)
    if len(normals) == 0:
        return []
    corners = mesh.vertices.astype(np.float64)
    corners = corners[ConvexHull(corners).vertices]
    count, label = connected_components(normals @ normals.T > np.cos(_ONE_SIDE), directed=False)
    found: list[Side] = []
    for side in range(count):
        own, others = normals[label == side], normals[label != side]
        mean = own.mean(axis=0) / np.linalg.norm(own.mean(axis=0))
        near_own, near_others = (own @ mean).min(), (others @ mean).max(initial=-1.0)
        if near_own > np.cos(_ONE_SIDE) and near_others < np.cos(_APART):
            plane = _plane(corners, mean)
            found += [plane] if plane else []
    return found


def _plane(
    corners: Float64[np.ndarray, "corners 3"], down: Float64[np.ndarray, "3"]
) -> Side | None:
    """The plane through the feet of one side."""
    depth = corners @ down
    size = float(np.ptp(corners, axis=0).max())
    feet = corners[depth > depth.max() - _SLACK * size]
    centre = feet.mean(axis=0)
    spread, axes = np.linalg.svd(feet - centre, full_matrices=True)[1:]
    if len(feet) < 3 or spread[1] < _NARROW * size:
        return None
    normal = axes[2] * np.sign(axes[2] @ down)
    rough = spread[2] if len(spread) > 2 else 0.0
    return Side(normal, centre, float(np.hypot(_MESH_TILT, rough / spread[1])))


_TILT = np.radians(8.0)
"""Lean from the nearest side of a thing that stands on it, under a mount that is about right."""
_MOST_TILT = np.radians(20.0)
"""However unsure the mount is: the next side is not much farther."""
_TIGHT = float(np.sqrt(chi2_quantile(0.999, 3)))
_ALIKE = np.radians(3.7)
"""Gravity in the phone's axes when the object stands on one side again, turned round: ARKit keeps it
to a degree, floors are as uneven."""
_SAME_LEVEL = 0.03
"""Metres; one side's contacts within this of its lowest are on one floor, others on a table."""


class StandingContact(NamedTuple):
    """A contact with the floor, and the side on which the object stands in it."""

    contact: Contact
    side: Side
    on_floor: bool
    """False when it is higher than another one of the same side: its tilt counts, its height not."""


def standings(
    contacts: Sequence[Contact], sides: Sequence[Side], mount: Mount, where: str
) -> list[StandingContact]:
    """Give each contact the side that its tilt under the mount is nearest to.

    Args:
        contacts: of one take, in order.
        sides: of the object.
        mount: with a covariance: the surer it is of its tilt, the less a side may differ.
        where: the session, for errors.

    Raises:
        InputError: "floor-no-contact", "floor-no-side", "floor-rests-disagree".
    """
    if not contacts:
        raise _nothing(where)
    if not sides:
        raise InputError(
            "floor-no-side",
            "The object has no flat side or feet to stand on, so the floor tells nothing of its "
            "tilt.",
            where=where,
            fix="Refine the mount in another way.",
        )
    R_object_phone = mount.T_phone_object[:3, :3].T
    downs = np.stack([side.down for side in sides])
    cosines = np.stack([downs @ R_object_phone @ contact.down for contact in contacts])
    nearest, lean = cosines.argmax(axis=1), np.arccos(cosines.max(axis=1).clip(-1, 1))
    limit = _limit(mount)
    if lean.min() > limit:
        raise _leaning(contacts[int(lean.argmin())], float(lean.min()), limit, where)
    found: list[StandingContact] = []
    for k, side in enumerate(sides):
        own = [
            c for c, n, off in zip(contacts, nearest, lean, strict=True) if n == k and off < limit
        ]
        found += _levelled(_alike(own, where), side)
    if not found:
        raise _nothing(where)
    return sorted(found, key=lambda standing: standing.contact.start)


def _levelled(contacts: list[Contact], side: Side) -> list[StandingContact]:
    """Rests, and pushes at the level of the lowest of them: what is level elsewhere may be carried."""
    rests = [contact.height for contact in contacts if contact.kind == "rest"]
    if not rests:
        return []
    found = [StandingContact(c, side, abs(c.height - min(rests)) < _SAME_LEVEL) for c in contacts]
    return [standing for standing in found if standing.on_floor or standing.contact.kind == "rest"]


def _nothing(where: str) -> InputError:
    return InputError(
        "floor-no-contact",
        "The object never stands still on the floor for half a second with nobody touching it.",
        where=where,
        fix="Record two seconds with the object at rest on the floor, before and after you move it.",
    )


def _limit(mount: Mount) -> float:
    """The lean that a wrong mount may give a thing that stands."""
    assert mount.covariance is not None
    unsure = float(np.sqrt(np.linalg.eigvalsh(mount.covariance[:3, :3])[-1]))
    return min(max(_TILT, _TIGHT * unsure), _MOST_TILT)


def _leaning(contact: Contact, lean: float, limit: float, where: str) -> InputError:
    return InputError(
        "floor-no-side",
        f"No side of the object is under it where it stands: it leans by {np.degrees(lean):.0f} deg "
        f"from the nearest one at {contact.when}, and the mount allows {np.degrees(limit):.0f}.",
        where=where,
        fix="Rest the object upright on its own feet. If it did, the mount is wrong, or the mesh has "
        "no such side (castors, a curved base): then the floor cannot refine it.",
    )


def _alike(contacts: list[Contact], where: str) -> list[Contact]:
    """The contacts of one side without the few in which gravity is another than in most.

    The mount has no part in this: a phone that is clamped to a thing that stands on one side feels
    the same gravity each time.
    """
    if not contacts:
        return []
    downs = np.stack([contact.down for contact in contacts])
    alike = np.arccos((downs @ downs.T).clip(-1, 1)) < _ALIKE
    kept = alike[int(alike.sum(axis=1).argmax())]
    if 3 * kept.sum() >= 2 * len(kept):
        return [contact for contact, keep in zip(contacts, kept, strict=True) if keep]
    most = float(np.degrees(np.arccos((downs @ downs.T).clip(-1, 1).min())))
    raise InputError(
        "floor-rests-disagree",
        f"The object stands {most:.1f} deg differently from one time to the next "
        f"({', '.join(contact.when for contact in contacts[:4])}): the mount slipped, or the object "
        "leaned against something.",
        where=where,
        fix="Look at the clamp, and record rests on a level floor with nothing near the object.",
    )


_TAPE = 0.005
"""Metres by which a height measured by hand is off."""
_DEPTH = 0.01
_UNKNOWN = 10.0
_MAX_TILT = np.radians(5)
_LOWEST, _HIGHEST = 0.02, 3.0
"""Metres of a camera over the floor on a thing that stands on it."""


@dataclass(frozen=True)
class FloorLevel:
    """The floor's height in the session's world turned z up."""

    height: float
    sd: float
    """Metres; ten where nothing tells."""
    source: Literal["given", "tape", "depth", "unknown"]
    place: Float64[np.ndarray, "2"]
    """x and y where it is so high; elsewhere a tilted world makes it another height."""
    path: float
    """Metres the phone had gone by then; tracking drifts from there."""


def floor_level(
    session: CaptureSession,
    seen: PhoneTrack,
    contacts: Sequence[Contact],
    phone_height: float | None,
    floor: float | None,
) -> FloorLevel:
    """The floor as given, as measured from the camera down, or as depth maps show it.

    Args:
        session: what the phone logged.
        seen: the same at 30 fps.
        contacts: at least one; the camera's height is that of the first rest among them.
        phone_height: metres of the lens over the floor then.
        floor: its height in the session's world, metres.

    Raises:
        InputError: "floor-twice", "floor-height".
    """
    if phone_height is not None and floor is not None:
        raise InputError(
            "floor-twice",
            "The floor is given twice: by the phone's height over it, and in the session's world.",
            where="‹phone_height›, ‹floor›",
            fix="Give the one you measured.",
        )
    if floor is not None:
        return FloorLevel(floor, _TAPE, "given", np.zeros(2), 0.0)
    first = min(contacts, key=lambda contact: (contact.kind != "rest", contact.start))
    if phone_height is not None:
        if not _LOWEST <= phone_height <= _HIGHEST:
            raise InputError(
                "floor-height",
                f"The phone cannot be {phone_height:g} m over the floor.",
                field="phone_height",
                fix="Measure from the floor up to the lens of the wide camera, in metres.",
            )
        height = first.height - phone_height
        return FloorLevel(height, _TAPE, "tape", first.place[:2], first.path)
    shown = _shown(session, seen, first)
    if shown is not None:
        return FloorLevel(shown, _DEPTH, "depth", first.place[:2], first.path)
    return FloorLevel(first.height, _UNKNOWN, "unknown", first.place[:2], first.path)


def _shown(session: CaptureSession, seen: PhoneTrack, first: Contact) -> float | None:
    """Height, at the first contact, of the largest level plane below the phone."""
    points = depth_points(session, seen.valid)
    if points is None:
        return None
    upright = apply(seen.T_zup_session[None], points)[0]
    below = upright[upright[:, 2] < first.height - _LOWEST]
    plane = fit_plane(below, np.array([0.0, 0.0, 1.0]), _MAX_TILT)
    if plane is None:
        return None
    return float((plane.offset - plane.normal[:2] @ first.place[:2]) / plane.normal[2])
