"""Folders of human motion of every kind that can be read become training clips."""

import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.core4d import core4d_clips, is_core4d
from omomo_core.learning.recordings.mocap import (
    METRES_PER_BVH_UNIT,
    SourceMotion,
    is_share_alike,
    read_bvh_motion,
    read_mocap_npz,
)
from omomo_core.learning.recordings.object_recordings import (
    ObjectRecording,
    is_ball,
    object_clips,
    read_ball,
)
from omomo_core.learning.recordings.omomo_release import release_clips
from omomo_core.learning.recordings.retargeting import (
    calibrate,
    leg_scale,
    mocap_clips,
    retargeted,
    standing_clips,
)
from omomo_core.learning.recordings.smpl import RecordedMotion, is_smpl, read_smpl

_RELEASE = (".p", ".pkl", ".joblib")
_SUFFIXES = (".bvh", ".npz", *_RELEASE)
_NO_MOTION = ("shape.npz", "_stagei.npz")
"""How AMASS names files that hold a body's shape alone."""
_TEST_SPLIT = "test_"


def motion_files(source: Path) -> list[Path]:
    """The motion files of a folder and the folders in it, by path; or the one file given.

    Links to folders are followed.
    The OMOMO release's test split is not taken from a folder: it must be given by name.

    Raises:
        InputError: ``mocap-folder`` when there is none.
    """
    if source.is_file():
        files = [source]
    else:
        files = sorted(f for f in _files_below(source) if f.suffix.lower() in _SUFFIXES)
        files = [f for f in files if f.is_file() and not f.name.endswith(_NO_MOTION)]
        files = [f for f in files if not (f.suffix in _RELEASE and f.name.startswith(_TEST_SPLIT))]
    if not files:
        raise InputError(
            "mocap-folder",
            "There are no motion files here.",
            where=str(source),
            fix="Give a folder of .bvh, .npz (joints, AMASS) or the OMOMO release's .p files.",
        )
    return files


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield the files of a folder and of the folders in it; a folder that is linked twice counts once."""
    seen = set[str]()
    for place, folders, names in os.walk(folder, followlinks=True):
        real = os.path.realpath(place)
        folders[:] = [] if real in seen else sorted(folders)
        if real not in seen:
            yield from (Path(place) / name for name in names)
        seen.add(real)


def read_recordings(
    path: Path, body: BodyModel, metres_per_unit: float, *, object_split: bool = False
) -> Iterator[SourceMotion | ObjectRecording | RecordedMotion | Clip | InputError]:
    """What is in a motion file: recordings, or the errors of those that cannot be used.

    Args:
        path: BVH; npz of joints (`read_mocap_npz`), with a ball or AMASS; a person of a CORE4D take; a
            file of the OMOMO release.
        body: whose proportions motion without a skeleton of its own gets.
        metres_per_unit: of BVH.
        object_split: of the release, only the paper's ten objects of training.
    """
    suffix = path.suffix.lower()
    try:
        if suffix in _RELEASE:
            yield from release_clips(path, body, object_split=object_split)
        elif suffix == ".bvh":
            yield read_bvh_motion(path, metres_per_unit)
        elif is_core4d(path):
            yield from core4d_clips(path, body)
        elif suffix == ".npz":
            yield _read_npz(path, body)
        else:
            raise InputError("mocap-file", "This is no motion file.", where=str(path))
    except InputError as problem:
        yield problem


def _read_npz(path: Path, body: BodyModel) -> SourceMotion | ObjectRecording | RecordedMotion:
    if is_smpl(path):
        return read_smpl(path, body)
    return read_ball(path) if is_ball(path) else read_mocap_npz(path)


Progress = Callable[[int, int], None]
"""Called with files done and files in all."""


def build_mocap(
    folder: Path,
    body: BodyModel,
    *,
    share_alike: bool = True,
    progress: Progress | None = None,
    dropped: Counter[str] | None = None,
    skipped: list[InputError] | None = None,
    metres_per_unit: float = METRES_PER_BVH_UNIT,
    object_split: bool = False,
) -> list[Clip]:
    """Read, retarget and ground every usable stretch of human motion below a folder.

    Args:
        folder: recordings of any kind `read_recordings` knows, or one of them.
        body: whose proportions the clips get.
        share_alike: False leaves out motion under share-alike licences (HDM05).
        progress: called after each recording.
        dropped: counts what was left out by reason.
        skipped: gets the error of each file that was left out.
        metres_per_unit: of the BVH files.
        object_split: of the OMOMO release, only the paper's ten objects of training.

    Returns:
        Clips at least 0.8 s long, standing on the floor; with objects where
        the recording has them.

    Raises:
        InputError: ``mocap-folder`` when the folder holds no motion file, ``mocap-unusable`` when
            none of them can be used.
    """
    refused: list[InputError] = [] if skipped is None else skipped
    counts = Counter[str]() if dropped is None else dropped
    clips: list[Clip] = []
    motions: list[SourceMotion | ObjectRecording] = []
    files = motion_files(folder)
    for done, path in enumerate(files, start=1):
        for found in read_recordings(path, body, metres_per_unit, object_split=object_split):
            if isinstance(found, InputError):
                refused.append(found)
                counts[found.code] += 1
            elif isinstance(found, SourceMotion | ObjectRecording):
                if share_alike or not is_share_alike(_motion(found)):
                    motions.append(found)
            elif isinstance(found, RecordedMotion):
                clips += standing_clips(found, body, counts)
            else:
                clips.append(found)
        if progress is not None:
            progress(done, len(files))
    clips += _retargeted(motions, body, counts)
    if not clips:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in counts.most_common())
        raise InputError(
            "mocap-unusable",
            f"None of {len(files)} motion files can be used ({reasons or 'none is asked for'}).",
            where=str(folder),
            fix=str(refused[0]) if refused else "Give recordings of people who stand and walk.",
        )
    return clips


def _motion(recording: SourceMotion | ObjectRecording) -> SourceMotion:
    return recording.motion if isinstance(recording, ObjectRecording) else recording


def _retargeted(
    recordings: Sequence[SourceMotion | ObjectRecording], body: BodyModel, dropped: Counter[str]
) -> list[Clip]:
    """Clips of recordings on skeletons that must be calibrated, each from all its recordings."""
    families: dict[str, list[SourceMotion]] = defaultdict(list)
    for motion in map(_motion, recordings):
        families[motion.skeleton.name].append(motion)
    corrections = {name: calibrate(family, body) for name, family in families.items()}
    clips: list[Clip] = []
    for found in recordings:
        motion = _motion(found)
        turns = corrections[motion.skeleton.name]
        if isinstance(found, ObjectRecording):
            person = retargeted(motion, turns, body)
            clips += object_clips(person, found.held, leg_scale(motion, body), body, dropped)
        else:
            clips += mocap_clips(motion, turns, body, dropped)
    return clips
