"""Training clips on our skeleton from a folder of recordings."""

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.calibration import calibrate
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.mocap import METRES_PER_BVH_UNIT, SourceMotion, is_share_alike
from omomo_core.learning.recordings.object_recordings import ObjectRecording, object_clips
from omomo_core.learning.recordings.recordings import motion_files, read_recordings
from omomo_core.learning.recordings.retargeting import (
    leg_scale,
    mocap_clips,
    retargeted,
    standing_clips,
)
from omomo_core.learning.recordings.smpl import RecordedMotion

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
