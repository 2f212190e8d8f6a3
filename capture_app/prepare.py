"""Everything that a run reads and checks before the slow part starts."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture_app.commands.run import RunRequest
from capture_app.inspection import Inspection, Verdict, findings, look_over, usable_take
from capture_app.known_person import KnownPerson, known_person
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
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMotion
from omomo_core.stages.stage import Stages
from omomo_core.weights.load import load_stages


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
    person: KnownPerson
    """What is said of the person."""
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
        person=known_person(request, motion, mount, segment),
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
