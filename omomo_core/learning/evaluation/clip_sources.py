"""Clips to evaluate on, from any source, and the windows that the paper evaluates."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.real_clips import (
    AXES,
    RealClip,
    body_of,
    clip_paths,
    our_rotations,
    read_clip,
)
from omomo_core.learning.recordings.clips import Clip, clip_files, load_clips, read_index
from omomo_core.learning.recordings.omomo_release import ReleaseSequence, read_release
from omomo_core.stages.stage import WINDOW


@dataclass(frozen=True)
class Recorded:
    """Recorded clips, and the files or sequences that could not be used, each with its reason."""

    clips: list[RealClip] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)


def read_recorded(sources: Sequence[Path], body: BodyModel) -> Recorded:
    """Read clips of every kind.

    Args:
        sources: folders of recorded clips or single ones (see `clips`), data sets or files of training clips
            (their people stand on our body), files of the OMOMO release.
        body: whose surface and rotations people get.

    Raises:
        InputError: ``no-clips`` when a source is missing or empty; ``no-usable-clips`` when not one
            clip can be used; ``clip-named-twice``.
    """
    recorded = Recorded()
    for source in sources:
        for found in _read(source, body):
            if isinstance(found, RealClip):
                recorded.clips.append(found)
            else:
                recorded.skipped[found.where] = str(found)
    if not recorded.clips:
        reason = next(iter(recorded.skipped.values()), "None of them has an object.")
        raise InputError(
            "no-usable-clips",
            f"Not one clip can be used. {reason}",
            where=", ".join(str(source) for source in sources),
            fix="See docs/evaluation.md for what can be read.",
        )
    _refuse_duplicates(recorded.clips)
    return recorded


def check_sources(sources: Sequence[Path]) -> None:
    """Refuse at once what `read_recorded` could not read.

    Raises:
        InputError: ``no-clips`` when a source is not there.
    """
    for source in sources:
        if not source.exists():
            raise InputError(
                "no-clips",
                "There is no such folder or file of clips.",
                where=str(source),
                fix="Give clips as docs/evaluation.md describes them.",
            )


def of_our_body(clip: Clip, body: BodyModel) -> RealClip | None:
    """Return a training clip as a recorded one; None when it has no object."""
    if clip.object_motion is None:
        return None
    root, R = clip.root.astype(np.float64), clip.rotations.astype(np.float64)
    joints = joints_of(body, root, R)
    return RealClip(clip.name, "", clip.object_motion, root, R, joints, body)


def _read(source: Path, body: BodyModel) -> Iterator[RealClip | InputError]:
    if source.suffix == ".p" and source.is_file():
        yield from read_truth(source, body)
    elif _holds_training_clips(source):
        for file in clip_files(source):
            # The recordings that a data set was made from lie beside it: large, and without objects.
            if any(row["object"] is not None for row in read_index(file)[0]):
                found = (of_our_body(clip, body) for clip in load_clips(file))
                yield from (clip for clip in found if clip is not None)
    else:
        for path in [source] if source.is_file() else clip_paths(source):
            try:
                yield read_clip(path, body)
            except InputError as problem:
                yield problem


def _holds_training_clips(source: Path) -> bool:
    files = [source] if source.is_file() else sorted(source.glob("[!.]*.npz"))[:1]
    try:
        return bool(files) and bool(read_index(files[0]))
    except InputError:
        return False


def _refuse_duplicates(clips: Sequence[RealClip]) -> None:
    """Refuse clips of one name, because results are stored by clip name."""
    names = [clip.name for clip in clips]
    duplicates = sorted({name for name in names if names.count(name) > 1})
    if duplicates:
        raise InputError(
            "clip-named-twice",
            f"{len(duplicates)} clips are there twice, {duplicates[0]} among them.",
            fix="Give each source once, and data sets of different people or seeds.",
        )


def read_truth(
    path: Path, body: BodyModel, *, object_split: bool = False
) -> Iterator[RealClip | InputError]:
    """Yield every sequence of a release file on its own bones, as recorded, or what is wrong with it.

    Args:
        path: as for `read_release`.
        body: whose surface the people get, fitted to their bones.
        object_split: as for `read_release`.

    Raises:
        InputError: as `read_release`.
    """
    for found in read_release(path, object_split=object_split):
        try:
            yield found if isinstance(found, InputError) else _truth(found, body)
        except InputError as problem:
            yield problem


def _truth(sequence: ReleaseSequence, body: BodyModel) -> RealClip:
    # `evaluation.person` knows people by a rest pose with x forward and z up.
    offsets = sequence.bones @ AXES.T
    offsets[0] = 0.0
    joints = sequence.joints()
    return RealClip(
        name=sequence.name,
        text="",
        motion=sequence.moved(),
        root=sequence.pelvis,
        rotations=our_rotations(sequence.rotations @ AXES.T, offsets, body),
        joints=joints,
        body=body_of(offsets, body, joints),
    )


STRIDE = WINDOW // 2
SHORTEST = 30
"""Frames: a rest that is shorter is left out."""


def windows_of(clip: RealClip) -> list[RealClip]:
    """Windows of 120 frames that overlap by half; those at the end are shorter, 30 frames at least.

    Each is called ``<clip>@<its first frame>``.

    Raises:
        InputError: ``clip-too-short`` when there is not one window in the clip.
    """
    frames = len(clip.root)
    if frames < SHORTEST:
        raise InputError(
            "clip-too-short",
            f"It has {frames} frames; a window has {SHORTEST} at least.",
            where=clip.name,
            fix="Leave the clip out.",
        )
    return [_cut(clip, start) for start in range(0, frames - SHORTEST + 1, STRIDE)]


def clip_of(window: str) -> str:
    """The clip that a window was cut from, by their names."""
    return window.rsplit("@", 1)[0]


def _cut(clip: RealClip, start: int) -> RealClip:
    here = slice(start, start + WINDOW)
    motion = replace(
        clip.motion,
        T_world_object=clip.motion.T_world_object[here].astype(np.float64),
        valid=clip.motion.valid[here],
    )
    return replace(
        clip,
        name=f"{clip.name}@{start}",
        motion=motion,
        root=clip.root[here],
        rotations=clip.rotations[here],
        joints=clip.joints[here],
    )
