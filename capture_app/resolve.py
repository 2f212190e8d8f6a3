"""A result with corrected contacts becomes another one: only what the correction touches is solved."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from capture_app.commands.run import ResolveRequest
from capture_app.generated_sample import GeneratedSample
from capture_app.manifest import CONTACTS, MOTION, Manifest
from capture_app.manifest_builder import correction_manifest
from capture_app.progress import Progress, silent
from capture_app.rerun import unchanged
from capture_app.result import Result, body_of, load_result, sample_index, save_corrected
from capture_app.solve_samples import solved_result
from capture_app.staged_result import StagedResult, draw_video, run_stages
from omomo_core.body.model import BodyModel
from omomo_core.contact.contact_file import read_contacts
from omomo_core.contact.segment import ContactSpan
from omomo_core.errors import InputError
from omomo_core.generation.generation_options import notes_of
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.resolve_contacts import changed, resolve
from omomo_core.generation.selection.ranking import score
from omomo_core.motion import ObjectMotion


def resolve_result(request: ResolveRequest, progress: Progress = silent) -> Result:
    """Correct one sample of a result, and draw the video if one is asked for.

    Args:
        request: the result and its corrected contacts.
        progress: called with each stage (those of `corrected_motion`, then "video") and how far it is.

    Returns:
        The new result, of that one sample, as it is on the disk.

    Raises:
        InputError, AssetError: see `corrected_motion`.
    """
    made = corrected_motion(request, progress)
    draw_video(request, progress)
    return made


def corrected_motion(request: ResolveRequest, progress: Progress = silent) -> Result:
    """Correct one sample of a result, without a video; nothing is left when it fails.

    Args:
        request: the result and its corrected contacts.
        progress: called with each stage ("read", "solve", "export") and how far it is.

    Returns:
        The new result, of that one sample, as it is on the disk.

    Raises:
        InputError: the result or the contacts cannot be read or hold nothing to correct, or the
            output folder cannot be made.
        AssetError: the body is missing or damaged.
    """
    return run_stages(StagedCorrection(request, progress))


def tried_correction(request: ResolveRequest) -> Result:
    """Return the result with one sample corrected, of which nothing is written.

    Raises:
        InputError, AssetError: see `corrected_motion`.
    """
    return StagedCorrection(request, silent).tried()


class StagedCorrection(StagedResult[ResolveRequest]):
    """A result on its way to a corrected one."""

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Read, solve, export, finish."""
        return {
            "read": self.read,
            "solve": self.solve,
            "export": self.export,
            "finish": self.finish,
        }

    def read(self) -> None:
        """Check the result and the contacts, and that the new result can be written."""
        self.clock("read", 0.0)
        _check(self._before, self.request.output)
        _ = self.body, self._edited
        self.staging.open()
        self.clock("read", 1.0)

    def solve(self) -> None:
        """Solve again what the contacts touch, and write motion.npz."""
        self.clock("solve", 0.0)
        scene, person = self._solved()
        self.clock("solve", 1.0)
        save_corrected(self.staging.folder / MOTION, self._before, self._index, person)
        scores = score(person, scene.must_hold)
        self.keep(GeneratedSample(person, 0, (scores,), notes_of(scores)))

    def tried(self) -> Result:
        """Return the whole result with the corrected sample in its place."""
        before, k = self._before, self._index
        return replace(
            before, people=(*before.people[:k], self._solved()[1], *before.people[k + 1 :])
        )

    def _solved(self) -> tuple[ObjectClip, Person]:
        scene = self._thing.clip(self.object_motion.T_world_object)
        return scene, resolve(self._person, self._edited, scene, self._thing, self.body)

    @property
    def inputs(self) -> Mapping[str, Path]:
        """The result and its contacts."""
        return {"result": self.request.result, "contacts": self.request.contacts}

    @property
    def object_motion(self) -> ObjectMotion:
        """The object of the result."""
        return self._before.object_motion

    @property
    def body(self) -> BodyModel:
        """The body of the result."""
        return self._body

    @property
    def has_contacts(self) -> bool:
        """True: a correction is all about contacts."""
        return True

    def manifest(self, files: tuple[str, ...]) -> Manifest:
        """Return the manifest of the new result."""
        timings = self.clock.seconds
        return correction_manifest(
            self.request, self._before, self._index, self.sample, timings, files
        )

    @cached_property
    def _before(self) -> Result:
        result = load_result(self.request.result)
        return solved_result(result, [sample_index(result, self.request.sample)], self.clock)

    @cached_property
    def _body(self) -> BodyModel:
        return _unchanged_body(self._before)

    @cached_property
    def _index(self) -> int:
        return sample_index(self._before, self.request.sample)

    @property
    def _person(self) -> Person:
        return self._before.people[self._index]

    @cached_property
    def _thing(self) -> ObjectModel:
        return ObjectModel(self.object_motion.mesh, scale=1.0)

    @cached_property
    def _edited(self) -> tuple[ContactSpan, ...]:
        return _read_edited(self.request.contacts, self._person, self._thing)


def _check(before: Result, output: Path) -> None:
    if CONTACTS not in before.manifest.files:
        raise InputError(
            "result-without-contacts",
            "The hands of this result follow the published rule; it has no contacts to correct.",
            where=str(before.folder),
            fix="Run the take again without ‹contact› paper and ‹configuration› paper.",
        )
    if output.resolve() == before.folder.resolve():
        raise InputError(
            "output-is-input",
            "The corrected result would take the place of the one it is made from.",
            where=str(output),
            fix="Give another folder with ‹output›.",
        )


def _unchanged_body(before: Result) -> BodyModel:
    """The body of the result; a file that has changed since does not fit its motion."""
    for item in before.manifest.inputs:
        if item.role == "body":
            unchanged(item)
    return body_of(before)


def _read_edited(contacts: Path, person: Person, thing: ObjectModel) -> tuple[ContactSpan, ...]:
    edited = read_contacts(contacts, len(person.miss), thing.surface)
    if not changed(person.segments, edited):
        raise InputError(
            "contacts-same",
            "The contacts are those of the result: there is nothing to solve again.",
            where=str(contacts),
            fix="Move, add or take out a segment, or change an anchor, and save the file.",
        )
    return edited
