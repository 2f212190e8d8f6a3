"""Which images of a take to compare: taken apart, yet of the same things."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from ingest.report.look import Look
from ingest.session_images import image_times
from omomo_core.geometry.transforms import inverse

_PAIRS = 8
_STARTS = 64
"""Images that a partner is looked for."""
_WITHIN = 5.0
"""Seconds; the poses drift over longer."""
_AT_ONCE = 0.02
"""Seconds between an image and the pose that it is taken to have: half a period at 30 Hz."""
_BASELINE = 0.05, 0.8
"""Metres; less says nothing about positions, more shows other things."""
_SHIFT = np.radians([4.0, 25.0])
"""Rough shift of the picture."""
_BEST_SHIFT = np.radians(12.0)
_DEPTH = 2.0
"""Metres to what is filmed, as far as that matters for the shift."""


@dataclass(frozen=True)
class ImagePair:
    """Two images and their poses."""

    images: tuple[int, int]
    """Places in `image_times`."""
    poses: tuple[int, int]


def pick_pairs(look: Look) -> list[ImagePair]:
    """Up to eight pairs, spread over the clean stretches; none if the phone hardly moved."""
    images, poses = _posed(look)
    starts = np.unique(np.linspace(0, len(images) - 1, _STARTS).astype(int)) if len(images) else []
    stretch = _stretch(look)
    found: list[ImagePair] = []
    for start in starts:
        partner = _partner(look, poses, stretch, int(start))
        if partner is not None:
            chosen = [int(start), partner]
            found.append(ImagePair(_two(images[chosen]), _two(poses[chosen])))
    chosen = np.unique(np.linspace(0, len(found) - 1, _PAIRS).astype(int)) if found else []
    return [found[k] for k in chosen]


def _posed(look: Look) -> tuple[Int64[np.ndarray, " posed"], Int64[np.ndarray, " posed"]]:
    """The images taken at a pose, and that pose of each."""
    times, taken = look.session.times, image_times(look.session)
    after = np.searchsorted(times, taken).clip(1, len(times) - 1)
    nearest = after - (taken - times[after - 1] < times[after] - taken)
    at_once = np.flatnonzero(np.abs(times[nearest] - taken) <= _AT_ONCE)
    return at_once, nearest[at_once]


def _stretch(look: Look) -> Int64[np.ndarray, " frames"]:
    """A number for each pose, the same where nothing came between two of them."""
    # Gaps are no fault here: some apps log a picture a second.
    faults = look.breaks.jumps | look.breaks.frozen | look.breaks.untracked
    return np.concatenate([[0], np.cumsum(faults)])


def _partner(
    look: Look,
    poses: Int64[np.ndarray, " posed"],
    stretch: Int64[np.ndarray, " frames"],
    start: int,
) -> int | None:
    """The later image that shows the same things best shifted, None without one."""
    times, first = look.session.times, poses[start]
    stop = int(np.searchsorted(times[poses], times[first] + _WITHIN, "right"))
    later = poses[start:stop]
    baseline, shift = _moved(look.session.T_world_phone[first], look.session.T_world_phone[later])
    fits = (
        (baseline > _BASELINE[0]) & (baseline < _BASELINE[1]) & (stretch[later] == stretch[first])
    )
    fits &= (shift > _SHIFT[0]) & (shift < _SHIFT[1])
    if not fits.any():
        return None
    return start + int(np.argmin(np.where(fits, np.abs(shift - _BEST_SHIFT), np.inf)))


def _moved(
    first: Float64[np.ndarray, "4 4"], later: Float64[np.ndarray, "later 4 4"]
) -> tuple[Float64[np.ndarray, " later"], Float64[np.ndarray, " later"]]:
    """Metres between poses, and roughly by what angle the picture shifted (rad)."""
    relative = inverse(first) @ later
    cosine = (np.trace(relative[:, :3, :3], axis1=1, axis2=2) - 1) / 2
    baseline = np.linalg.norm(relative[:, :3, 3], axis=1)
    return baseline, np.arccos(cosine.clip(-1, 1)) + baseline / _DEPTH


def _two(values: Int64[np.ndarray, "2"]) -> tuple[int, int]:
    return int(values[0]), int(values[1])
