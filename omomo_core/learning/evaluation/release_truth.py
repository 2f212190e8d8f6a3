"""The release's people on their own bones, as they were recorded: what generated people are judged by."""

from collections.abc import Iterator
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.person import AXES, body_of, our_rotations
from omomo_core.learning.recordings.release_sequences import ReleaseSequence, read_release


def read_truth(
    path: Path, body: BodyModel, *, object_split: bool = False
) -> Iterator[RealClip | InputError]:
    """Every sequence of a release file, unchanged, or what is wrong with it.

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
    return RealClip(
        name=sequence.name,
        text="",
        motion=sequence.moved(),
        root=sequence.pelvis,
        rotations=our_rotations(sequence.rotations @ AXES.T, offsets, body),
        joints=sequence.joints(),
        body=body_of(offsets, body),
    )
