"""Everything that a run reads and checks before the slow part starts, the start position included."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float

from capture_app.commands.run import RunRequest
from capture_app.commands.text_values import Place
from capture_app.inspection import Inspection, Verdict, findings, look_over, usable_take
from capture_app.manifest import Segment, TakeFinding
from ingest.animated.animated_take import AnimatedTake, to_animated_take
from ingest.animated.detect import read_animation
from ingest.formats.registry import read_session
from ingest.mesh import load_mesh
from ingest.mount import Mount, identity_mount
from ingest.mount_file import load_mount
from ingest.trajectory.object_motion import ObjectTake
from ingest.trajectory.segments import choose, cut
from ingest.trajectory.trajectory_config import Reading
from omomo_core.body.model import BodyModel, load_body, with_height
from omomo_core.contact.contact_file import read_contacts
from omomo_core.contact.segment import ContactSpan
from omomo_core.errors import InputError
from omomo_core.geometry.distance_field import distance_field
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import apply, to_local
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.stages.stage import Stages
from omomo_core.weights.load import load_stages

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


def start_position(
    request: RunRequest, motion: ObjectMotion, mount: Mount, segment: Segment
) -> Place | None:
    """Return the place where somebody stood; None where it is not said.

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
        raise _wrong("unused", "The published model finds its own place for the person.", "‹stood›")
    points = apply(motion.T_world_object[:1], sample_surface(motion.mesh).points)[0]
    if request.stood == "phone":
        _check_phone(request, segment)
        return _before_screen(mount, motion, points)
    x, y = request.stood
    where = f"‹stood› {x:g},{y:g}"
    if not (math.isfinite(x) and math.isfinite(y)):
        raise _wrong("invalid", "The place where the person stood is no number.", where)
    off = float(np.linalg.norm(points[:, :2] - (x, y), axis=1).min())
    if off > FARTHEST:
        raise _wrong("far", f"This is {off:.1f} m from the object as the take begins.", where)
    if not _clear(np.array([[x, y]]), motion)[0]:
        raise _wrong("inside", "The object is there as the take begins.", where)
    return x, y


def start_position_note(place: Place | None, human: HumanMotion) -> Iterator[str]:
    """Return what to know where somebody does not begin where they were said to."""
    off = 0.0 if place is None else float(np.linalg.norm(human.root[0, :2] - place))
    if off > ASTRAY:
        yield (
            f"The person begins {off:.1f} m from where ‹stood› says: too far to come from in the time "
            "before they take the object."
        )


def _check_phone(request: RunRequest, segment: Segment) -> None:
    if request.animated:
        raise _wrong("no-phone", "An object's own motion has no phone.", "‹stood› phone")
    if segment.start > LATE * FPS:
        raise _wrong(
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
        raise _wrong(
            "level", "The phone's screen faces up or down: it has no side.", "‹stood› phone"
        )
    local = apply(np.linalg.inv(T_world_phone)[None], points)[0]
    before = (local[:, 2] > 0) & (local[:, 2] < FREE)
    if (before & (np.abs(local[:, :2]) < ASIDE).all(axis=1)).any():
        raise _wrong(
            "hidden",
            "The object is right before the phone's screen: nobody taps it there.",
            "‹stood› phone",
        )
    ways = np.outer(BEFORE_SCREEN, toward / np.linalg.norm(toward))
    places = T_world_phone[:2, 3] + ways
    clear = places[_clear(places, motion)]
    if not len(clear):
        raise _wrong(
            "hidden", "The object fills the place before the phone's screen.", "‹stood› phone"
        )
    x, y = clear[0].tolist()
    return x, y


def _clear(
    places: Float[np.ndarray, "places 2"], motion: ObjectMotion
) -> Bool[np.ndarray, " places"]:
    """Return the mask of places at which a post as high as HEAD is outside the object as the take begins."""
    height = np.arange(0, HEAD, NEAREST)
    posts = np.concatenate(
        [np.repeat(places, len(height), axis=0), np.tile(height, len(places))[:, None]], axis=1
    )
    local = to_local(motion.T_world_object[:1], posts[None])[0]
    far = distance_field(motion.mesh).at(torch.from_numpy(local).float())
    return (far.reshape(len(places), -1).amin(dim=1) > NEAREST).numpy()


def _wrong(code: str, what: str, where: str) -> InputError:
    fix = "Give x,y in metres on the floor of the result's world, at most 3 m from the object."
    if where == "‹stood› phone":
        fix = "Leave it out, and if the result has the person on the wrong side, give ‹stood› x,y."
    return InputError(
        f"stood-{code}", what, where=where, fix="Leave it out." if code == "unused" else fix
    )


@dataclass(frozen=True)
class PreparedTake:
    """The moving object and who moves it: all that is known before a person is generated."""

    motion: ObjectMotion
    """The chosen segment of the take."""
    take: ObjectTake | AnimatedTake
    segment: Segment
    mount: Mount
    """Mount of the phone; where there is none, the identity."""
    contacts: tuple[ContactSpan, ...] | None
    """What each hand holds, where that is given."""
    stood: Place | None
    """Place where the person stood, if it is given."""
    body: BodyModel
    stages: Stages
    verdict: Verdict | None
    """On what the phone recorded; an object's own motion is not judged."""
    findings: tuple[TakeFinding, ...]
    """What is to be looked at in it."""


def prepare_take(request: RunRequest) -> PreparedTake:
    """Read and check every input of a request.

    Raises:
        InputError, AssetError: see `capture_app.pipeline.run_take`.
    """
    _check_contact_rule(request)
    mount = load_mount(request.mount) if request.mount else _no_mount(request)
    if request.animated:
        take, verdict, seen = _animated(request), None, ()
    else:
        inspection = _inspected(request, mount)
        take = usable_take(inspection, force=request.force, strict=request.strict)
        verdict, seen = inspection.verdict, findings(inspection)
    segment = _choose(take, request.reading.segment, request.session)
    motion = cut(take.motion, segment.start, segment.stop)
    body = load_body(request.body)
    return PreparedTake(
        motion=motion,
        take=take,
        segment=segment,
        mount=mount,
        contacts=_contacts(request, motion),
        stood=start_position(request, motion, mount, segment),
        body=with_height(body, request.height) if request.height else body,
        stages=_stages(request),
        verdict=verdict,
        findings=seen,
    )


def _inspected(request: RunRequest, mount: Mount) -> Inspection:
    """Return what a phone that is clamped to the object recorded, looked over."""
    if request.object is None:
        raise InputError(
            "object-needed",
            "The object's mesh is not given; a phone's log has none.",
            field="object",
            fix="Give the mesh of what the phone is clamped to: ‹object› FILE (OBJ, PLY, STL or GLB, "
            "in metres).",
        )
    if request.node is not None:
        raise InputError(
            "node-unused",
            "A phone's log has no nodes.",
            field="node",
            fix="Leave out ‹node›.",
        )
    mesh = load_mesh(request.object, scale=request.mesh_scale * mount.object_scale)
    session = read_session(request.session, request.reading.format)
    return look_over(session, mesh, mount, request.reading, mesh_file=request.object)


def _animated(request: RunRequest) -> AnimatedTake:
    """The object's own motion."""
    floor = request.reading.floor
    if request.reading != Reading(floor, segment=request.reading.segment):
        raise InputError(
            "tracking-unused",
            "An object's own motion was tracked by no phone.",
            where="‹up›, ‹stitch›, ‹closure›, ‹format›",
            fix="Leave them out; the file says which way is up.",
        )
    animation = read_animation(request.session, request.node)
    return to_animated_take(animation, request.object, scale=request.mesh_scale, floor=floor)


def _no_mount(request: RunRequest) -> Mount:
    return Mount(np.eye(4), "none") if request.animated else identity_mount()


def _check_contact_rule(request: RunRequest) -> None:
    if request.contacts and not request.has_segments:
        raise InputError(
            "contacts-unused",
            "The published contact rule and model find the contacts themselves; they take none that "
            "are given.",
            where=str(request.contacts),
            fix="Leave out ‹contact› paper and ‹configuration› paper, or leave out ‹contacts›.",
        )


def _contacts(request: RunRequest, motion: ObjectMotion) -> tuple[ContactSpan, ...] | None:
    if request.contacts is None:
        return None
    return read_contacts(request.contacts, len(motion.valid), sample_surface(motion.mesh))


def _choose(take: ObjectTake | AnimatedTake, segment: int | None, session: Path) -> Segment:
    """The wanted segment, or the longest."""
    chosen = choose(take.segments, segment, str(session))
    start, stop = take.segments[chosen]
    return Segment(index=chosen + 1, count=len(take.segments), start=start, stop=stop)


def _stages(request: RunRequest) -> Stages:
    stages = load_stages(request.configuration, request.weights, request.device)
    trained = stages.hands.config.configuration
    if trained != request.configuration:
        raise InputError(
            "weights-configuration",
            f"The weights are of the configuration {trained}, not {request.configuration}.",
            where=str(request.weights),
            fix=f"Add ‹configuration› {trained}.",
        )
    return stages
