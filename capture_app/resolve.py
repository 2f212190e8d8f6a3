"""A result with corrected contacts becomes another one: only what the correction touches is solved."""

from pathlib import Path

from capture_app.chosen import write_chosen
from capture_app.describe import describe_correction
from capture_app.manifest import write_manifest
from capture_app.progress import Progress, StageClock
from capture_app.request import ResolveRequest
from capture_app.rerun import unchanged
from capture_app.result import (
    CONTACTS,
    MANIFEST,
    MOTION,
    Result,
    body_of,
    load_result,
    save_corrected,
)
from capture_app.staging import staged_folder
from omomo_core.body.model import BodyModel
from omomo_core.contact.file import read_contacts
from omomo_core.contact.segment import Span
from omomo_core.errors import InputError
from omomo_core.generation.person import Person
from omomo_core.generation.resolve import changed, resolve
from omomo_core.generation.scene import Thing
from omomo_core.generation.scores import score


def resolve_result(request: ResolveRequest, progress: Progress) -> Result:
    """Correct the chosen sample of a result; nothing is left behind when it fails.

    Args:
        request: the result and its corrected contacts.
        progress: told each stage ("read", "solve", "export", "video") and how far it is.

    Returns:
        The new result, of that one sample, as it is on the disk.

    Raises:
        InputError: the result or the contacts cannot be read or hold nothing to correct, or the
            output folder cannot be made.
        AssetError: the body is missing or damaged.
    """
    clock = StageClock(progress)
    clock("read", 0.0)
    before = load_result(request.result)
    _check(before, request.output)
    body, thing = _body(before), Thing(before.object_motion.mesh, scale=1.0)
    scene = thing.scene(before.object_motion.T_world_object)
    person = before.people[before.manifest.chosen]
    edited = _edited(request.contacts, person, thing)
    with staged_folder(request.output, replace=request.replace) as folder:
        clock("read", 1.0)
        clock("solve", 0.0)
        person = resolve(person, edited, scene, thing, body)
        clock("solve", 1.0)
        save_corrected(folder / MOTION, before, person)
        write_chosen(
            folder,
            person,
            before.object_motion,
            body,
            clock,
            contacts=True,
            video_size=request.video_size,
        )
        files = tuple(sorted(path.name for path in folder.iterdir()))
        scores = score(person, scene.must_hold)
        manifest = describe_correction(request, before, person, scores, clock.seconds, files)
        write_manifest(folder / MANIFEST, manifest)
    return load_result(request.output)


def _check(before: Result, output: Path) -> None:
    if CONTACTS not in before.manifest.files:
        raise InputError(
            "result-without-contacts",
            "The hands of this result follow the published rule; it has no contacts to correct.",
            where=str(before.folder),
            fix="Run the take again without --contact paper and --config paper.",
        )
    if output.resolve() == before.folder.resolve():
        raise InputError(
            "output-is-input",
            "The corrected result would take the place of the one it is made from.",
            where=str(output),
            fix="Give another folder with -o.",
        )


def _body(before: Result) -> BodyModel:
    """The body of the result; a file that has changed since does not fit its motion."""
    for item in before.manifest.inputs:
        if item.role == "body":
            unchanged(item)
    return body_of(before)


def _edited(contacts: Path, person: Person, thing: Thing) -> tuple[Span, ...]:
    edited = read_contacts(contacts, len(person.miss), thing.surface)
    if not changed(person.segments, edited):
        raise InputError(
            "contacts-same",
            "The contacts are those of the result: there is nothing to solve again.",
            where=str(contacts),
            fix="Move, add or take out a segment, or change an anchor, and save the file.",
        )
    return edited
