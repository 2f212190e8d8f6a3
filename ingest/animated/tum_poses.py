"""TUM text as the object's own pose: `t x y z qx qy qz qw` in seconds and metres.

The axes are the object's and the world's; a comment line `# up: y` says that the world is not z up.
"""

from pathlib import Path

import numpy as np

from ingest.animated.animation import (
    Animation,
    check_times,
    checked,
    rigid,
    sampled,
    stated_up,
)
from ingest.formats import tum
from ingest.formats.pose_columns import IN_ORDER, read_pose_rows

NAME = "TUM"
FILES = "TUM text with lines of t x y z qx qy qz qw"

_MAX_GAP = 0.1
"""Seconds; a log of fewer than ten poses a second may have three times its usual step."""


def detect(path: Path) -> bool:
    """Whether lines are eight numbers between blanks, the last four a rotation."""
    return tum.detect(path)


def read(path: Path) -> Animation:
    """Read a recorded motion; its gaps are not bridged.

    Raises:
        InputError: "row-damaged", "pose-not-finite", "comment-unknown", "animation-one-key",
            "time-backwards", "quaternion-not-unit" or "animation-long".
    """
    rows = read_pose_rows(path, IN_ORDER)
    times = rows.clock.times
    check_times(times, rows.place, path)
    steps = np.diff(times)
    gaps = steps > max(_MAX_GAP, 3 * float(np.median(steps)))
    xyzw = checked(rows.xyzw, rows.place)
    return sampled(path, times, rigid(rows.positions, xyzw), stated_up(path), gaps)
