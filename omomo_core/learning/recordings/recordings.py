"""Files of human motion of every kind that can be read, recognised by their content."""

import os
from collections.abc import Iterator
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.ball import is_ball, read_ball
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.core4d import core4d_clips, is_core4d
from omomo_core.learning.recordings.mocap import SourceMotion, read_bvh_motion, read_mocap_npz
from omomo_core.learning.recordings.object_recordings import ObjectRecording
from omomo_core.learning.recordings.release import release_clips
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
