"""From what a user names to the motions to compare: results, samples and other files."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float

from capture_app.manifest import MANIFEST
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, load_result
from capture_app.solve_samples import solved_result
from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel, load_body
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.resolve_contacts import changed, resolve
from omomo_core.geometry.runs import runs
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.evaluation.real_clips import read_clip
from omomo_core.learning.evaluation.truth import POINTS, Touching, recorded_person
from omomo_core.learning.recordings.clips import Clip, load_clips
from omomo_core.motion import HumanMotion, ObjectMotion
from omomo_core.stages.hands_paper import constrain


@dataclass(frozen=True)
class Choice:
    """A path, and what follows its "#"."""

    path: Path
    which: str | None = None
    """A sample's number from 1, or a clip's number or name; None for the chosen or only one."""

    def __str__(self) -> str:
        return str(self.path) if self.which is None else f"{self.path}#{self.which}"


def choice(text: str) -> Choice:
    """The path and the part of "result#3"; a path that really contains "#" is taken as it is.

    Raises:
        InputError: there is no such file or folder.
    """
    named = re.fullmatch(r"(.+)#([^#/]+)", text)
    found = Choice(Path(text)) if named is None else Choice(Path(named[1]), named[2])
    for option in (Choice(Path(text)), found):
        if option.path.exists():
            return option
    raise InputError(
        "motion-missing",
        "There is no such result or clip.",
        where=str(found.path),
        fix="Give a result folder, RESULT#3 for its third sample, or a file of clips.",
    )


def number(which: str, count: int, choice: Choice, things: str) -> int:
    """Index of the motion with a number from 1.

    Raises:
        InputError: it is no number, or there are fewer.
    """
    if which.isdecimal() and 1 <= int(which) <= count:
        return int(which) - 1
    raise InputError(
        "sample-missing",
        f"There is no {which!r} among the {count} {things}.",
        where=str(choice),
        fix=f"Write # and a number from 1 to {count}.",
    )


@dataclass(frozen=True)
class Motion:
    """A person and the object they move, at 30 fps."""

    label: str
    human: HumanMotion
    object_motion: ObjectMotion
    body: BodyModel
    contact: Bool[np.ndarray, "frames 2"]
    """When the left, right hand holds, as the result says or the clip's palms are near enough."""
    truth: bool = False
    """A recorded person."""


def moved(motion: Motion, T: Float[np.ndarray, "4 4"]) -> Motion:
    """The same motion elsewhere in the world; T turns about the vertical and shifts."""
    if np.array_equal(T, np.eye(4)):
        return motion
    R, t = T[:3, :3], T[:3, 3]
    human, thing = motion.human, motion.object_motion
    return replace(
        motion,
        human=replace(
            human,
            root=human.root @ R.T + t,
            rotations=R @ human.rotations,
            joints=human.joints @ R.T + t,
        ),
        object_motion=replace(thing, T_world_object=T @ thing.T_world_object),
    )


def stretch(motion: Motion, start: int, stop: int) -> Motion:
    """Frames `start` .. `stop` of a motion."""
    human, thing, part = motion.human, motion.object_motion, slice(start, stop)
    return replace(
        motion,
        human=HumanMotion(**{k: getattr(human, k)[part] for k in HumanMotion.__dataclass_fields__}),
        object_motion=replace(
            thing,
            T_world_object=thing.T_world_object[part],
            valid=thing.valid[part],
            start_time=thing.start_time,
        ),
        contact=motion.contact[part],
    )


def by_the_paper(result: Result, sample: int) -> Person:
    """Solve a sample again with the contacts that the paper's rule gives its palms.

    The rule measures to the mesh's vertices; points on its faces are added, lest a box of eight
    vertices is never touched. A sample whose hands never come near enough, or that obeys the rule
    already, is returned as it is.

    Args:
        result: with `segments` contacts or any other.
        sample: its index.
    """
    person, moved = result.people[sample], result.object_motion
    T, palms = moved.T_world_object, person.human.joints[:, 22:].astype(np.float64)
    points = [moved.mesh.vertices, sample_surface(moved.mesh, POINTS).points]
    ruled = constrain(palms, np.concatenate(points), T)
    places = to_local(T, palms)
    segments = tuple(
        ContactSegment(hand, start, stop, places[start, hand])
        for hand in range(2)
        for start, stop in runs(ruled.contact[:, hand] > 0.5)
    )
    if not changed(person.segments, segments):
        return person
    thing = ObjectModel(moved.mesh, scale=1.0)
    solved = resolve(person, segments, thing.clip(T), thing, body_of(result))
    return replace(solved, human=replace(solved.human, hand_contact=ruled.contact))


def load_motions(
    choices: Sequence[Choice],
    *,
    all_samples: bool = False,
    paper_rule: bool = False,
    progress: Progress = silent,
) -> list[Motion]:
    """The motions of some choices, in their order, each under a label of its own.

    Args:
        choices: result folders, recorded clips (npz files as `omocap evaluate` reads them) or
            training clips.
        all_samples: all samples of each result that is named without a number.
        paper_rule: after each motion of a result, the same person with their contacts solved again
            by the paper's rule.
        progress: told the stage "solve" where samples were not solved yet.

    Raises:
        InputError: one cannot be read, or has no such motion.
    """
    motions = [m for c in choices for m in _load(c, all_samples, paper_rule, progress)]
    return _distinct(motions, [str(c) for c in choices])


def _load(choice: Choice, all_samples: bool, paper_rule: bool, progress: Progress) -> list[Motion]:
    if (choice.path / MANIFEST).is_file():
        return _of_result(choice, all_samples, paper_rule, progress)
    if choice.path.is_file() and _is_recording(choice.path):
        return [_recorded(choice.path)]
    if choice.path.is_dir() and not any(choice.path.glob("*.npz")):
        raise InputError(
            "motion-missing",
            "This folder is neither a result nor a folder of clips.",
            where=str(choice.path),
            fix="Give the folder that ‹omocap run› wrote, or a clip's npz file.",
        )
    return [_from_training(choice)]


def _of_result(
    choice: Choice, all_samples: bool, paper_rule: bool, progress: Progress
) -> list[Motion]:
    result = load_result(choice.path)
    count = len(result.people)
    if choice.which is not None:
        chosen = [number(choice.which, count, choice, "samples")]
    else:
        chosen = list(range(count)) if all_samples else [result.manifest.chosen]
    result, name = solved_result(result, chosen, progress), choice.path.resolve().name
    found: list[Motion] = []
    for k in chosen:
        label = name if choice.which is None and not all_samples else f"{name} #{k + 1}"
        found.append(_sample(result, k, label))
        if paper_rule:
            person = by_the_paper(result, k)
            found.append(_shown(result, person.human, f"{label}, paper's rule"))
    return found


def _sample(result: Result, k: int, label: str) -> Motion:
    return _shown(result, result.people[k].human, label)


def _shown(result: Result, human: HumanMotion, label: str) -> Motion:
    held = human.hand_contact > 0.5
    return Motion(label, human, result.object_motion, body_of(result), held)


def _is_recording(path: Path) -> bool:
    """Whether a file holds one recorded clip and not a set of training clips."""
    try:
        with path.open("rb") as handle, np.load(handle, allow_pickle=False) as file:
            return "index" not in file.files
    except Exception:  # read_clip says what is wrong with it
        return True


def _recorded(path: Path) -> Motion:
    clip = read_clip(path, load_body())
    human = recorded_person(clip, clip.body)
    held = Touching(clip.motion).palms(clip.joints[:, 22:])
    human = replace(human, hand_contact=held.astype(float))
    return Motion(f"{clip.name} (recorded)", human, clip.motion, clip.body, held, truth=True)


def _from_training(choice: Choice) -> Motion:
    clips = load_clips(choice.path)
    clip = clips[_which(choice, clips)]
    if clip.object_motion is None:
        raise InputError(
            "clip-without-object",
            "This clip has no object.",
            where=f"{choice.path}#{clip.name}",
            fix="Choose a clip of somebody who moves something.",
        )
    body = load_body()
    root, rotations = clip.root.astype(np.float64), clip.rotations.astype(np.float64)
    human = HumanMotion(
        root=root,
        rotations=rotations,
        fingers=torch.tile(body.relaxed_fingers.double(), (len(root), 1, 1, 1)).numpy(),
        joints=joints_of(body, root, rotations),
        hand_contact=clip.hand_contact,
        foot_contact=clip.foot_contact,
    )
    held = clip.hand_contact > 0.5
    return Motion(f"{clip.name} (clip)", human, clip.object_motion, body, held, truth=True)


def _which(choice: Choice, clips: Sequence[Clip]) -> int:
    if choice.which is None and len(clips) == 1:
        return 0
    if choice.which is None:
        raise InputError(
            "clip-not-named",
            f"There are {len(clips)} clips; it is not said which.",
            where=str(choice.path),
            fix=f"Write # and a number from 1 to {len(clips)}, or a name such as {clips[0].name}.",
        )
    names = [clip.name for clip in clips]
    if choice.which in names:
        return names.index(choice.which)
    return number(choice.which, len(clips), choice, "clips")


def _distinct(motions: Sequence[Motion], given: Sequence[str]) -> list[Motion]:
    """Return labels that differ: paths where names are the same, and numbers where even paths are."""
    labels = [m.label for m in motions]
    if len(given) == len(motions):
        labels = [
            g if labels.count(label) > 1 else label for g, label in zip(given, labels, strict=True)
        ]
    counts: dict[str, int] = {}
    for k, label in enumerate(labels):
        counts[label] = counts.get(label, 0) + 1
        if counts[label] > 1:
            labels[k] = f"{label} ({counts[label]})"
    return [replace(m, label=label) for m, label in zip(motions, labels, strict=True)]
