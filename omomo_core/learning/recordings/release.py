"""The OMOMO release's processed files: people with the objects they moved, on our skeleton."""

from collections.abc import Iterator
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.release_sequences import ReleaseSequence, read_release
from omomo_core.learning.recordings.smpl_person import ClipOrigin, person_clip, size_of

LICENCE = "OMOMO data (github.com/lijiaman/omomo_release): its authors state no licence"


def release_clips(
    path: Path, body: BodyModel, *, object_split: bool = False
) -> Iterator[Clip | InputError]:
    """Every sequence of a release file as a clip, or what is wrong with it.

    Args:
        path: as for `read_release`.
        body: whose proportions the clips get.
        object_split: as for `read_release`.

    Raises:
        InputError: as `read_release`.
    """
    for found in read_release(path, object_split=object_split):
        try:
            yield found if isinstance(found, InputError) else _clip(found, body)
        except InputError as problem:
            yield problem


def _clip(sequence: ReleaseSequence, body: BodyModel) -> Clip:
    moved = sequence.moved(size_of(sequence, body))
    return person_clip(sequence, moved, ClipOrigin(sequence.name, "omomo", LICENCE), body)
