"""Which pictures are worth matching with each other: by where they were taken, or by what they show."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64

from ingest.calibration.scan.features import match, unit
from ingest.colmap import pycolmap
from ingest.scan.cameras.quiet import THREADS, quiet
from ingest.scan.types import Frame, Progress

_NEIGHBOURS = 12
"""Pictures that each one is matched with, at least."""
_FORWARD = 0.7
"""Metres that a turn of one radian counts as."""
_TURNED = np.cos(np.radians(75.0))
"""Pictures that look more differently show different things."""
_STRONGEST, _ALIKE = 500, 6
"""Features of a picture that are compared to see whether two show the same, and how many must."""
_IN_A_ROW = 4
"""Pictures before and after each in time that are matched anyway."""
_BATCH = 60

Pair = tuple[int, int]


def by_place(T_world_camera: Float64[np.ndarray, "pictures 4 4"]) -> list[Pair]:
    """The pictures whose cameras are nearest to each one, looking the same way."""
    ahead = T_world_camera[:, :3, 2]
    where = np.concatenate([T_world_camera[:, :3, 3], _FORWARD * ahead], axis=1)
    apart = np.linalg.norm(where[:, None] - where, axis=-1)
    apart[ahead @ ahead.T < _TURNED] = np.inf
    np.fill_diagonal(apart, np.inf)
    nearest = np.argsort(apart, axis=1)[:, :_NEIGHBOURS]
    pairs = {
        (min(a, b), max(a, b))
        for a, row in enumerate(nearest.tolist())
        for b in row
        if np.isfinite(apart[a, b])
    }
    return sorted(pairs)


def by_look(database: Path, numbers: Sequence[int], progress: Progress) -> list[Pair]:
    """Pictures of which some of the strongest features look alike, and those next to each other."""
    with pycolmap.Database.open(database) as opened:
        features = [_strongest(opened, number) for number in numbers]
    count = len(features)
    pairs = {(a, b) for a in range(count) for b in range(a + 1, min(a + 1 + _IN_A_ROW, count))}
    for a in range(count):
        for b in range(a + 1, count):
            if len(match(features[a], features[b])[0]) >= _ALIKE:
                pairs.add((a, b))
        progress("compare", (a + 1) / count)
    return sorted(pairs)


def _strongest(opened: pycolmap.Database, number: int) -> Float32[np.ndarray, "features 128"]:
    """Descriptors of the largest features: they are seen from near and far."""
    keypoints = opened.read_keypoints(number)
    descriptors = unit(opened.read_descriptors(number).data)
    if keypoints.shape[1] >= 6:  # x, y and the affine shape
        size = np.abs(keypoints[:, 2] * keypoints[:, 5] - keypoints[:, 3] * keypoints[:, 4])
    else:
        size = keypoints[:, 2]
    return descriptors[np.argsort(-size)[:_STRONGEST]]


def match_pairs(
    database: Path, frames: Sequence[Frame], pairs: Sequence[Pair], progress: Progress
) -> None:
    """Match and verify pairs of pictures; those that the database has are not matched again."""
    quiet()
    matching = pycolmap.FeatureMatchingOptions()
    matching.num_threads = THREADS
    pairing = pycolmap.ImportedPairingOptions()
    listed = database.with_suffix(".pairs.txt")
    pairing.match_list_path = str(listed)
    left = _unmatched(database, frames, pairs)
    try:
        for start in range(0, len(left), _BATCH):
            batch = left[start : start + _BATCH]
            lines = (f"{frames[a].name} {frames[b].name}" for a, b in batch)
            listed.write_text("\n".join(lines) + "\n", encoding="utf-8")
            pycolmap.match_image_pairs(
                database,
                matching_options=matching,
                pairing_options=pairing,
                device=pycolmap.Device.cpu,
            )
            progress("match", (start + len(batch)) / len(left))
    finally:
        listed.unlink(missing_ok=True)


def _unmatched(database: Path, frames: Sequence[Frame], pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs that the database does not know yet."""
    with pycolmap.Database.open(database) as opened:
        number = {image.name: image.image_id for image in opened.read_all_images()}
        numbers = [number[frame.name] for frame in frames]
        return [
            (a, b) for a, b in pairs if not opened.exists_two_view_geometry(numbers[a], numbers[b])
        ]
