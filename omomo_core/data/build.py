"""A folder of recordings becomes training clips on our skeleton."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from omomo_core.body.model import BodyModel
from omomo_core.data.calibration import Corrections, calibrate
from omomo_core.data.clips import Clip
from omomo_core.data.grounding import Grounded, ground, runs, sole_points
from omomo_core.data.mocap import SourceMotion, read_mocap_folder
from omomo_core.data.retarget import joints_of, retarget
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_SHORTEST = round(0.8 * FPS)
_STEP_HEIGHT = 0.09
"""The level stood on may differ this much from the clip's usual one, metres; more is climbing."""
_DEEPEST_SOLE = -0.08
_LOWEST_PELVIS = 0.22
_LOWEST_HEAD = 0.45
"""Lower is lying, rolling, standing on the hands: nothing anybody does while carrying."""
_WORST_SKATING = 0.3
_EDGE = round(0.1 * FPS)
"""Frames also dropped around a bad one."""

Progress = Callable[[int, int], None]
"""Called with clips done and clips in all."""


def build_mocap(
    folder: Path,
    body: BodyModel,
    *,
    share_alike: bool = True,
    progress: Progress | None = None,
    dropped: Counter[str] | None = None,
) -> list[Clip]:
    """Read, retarget and ground every usable stretch of human motion below a folder.

    Args:
        folder: BVH and npz files (see `read_mocap_folder`).
        body: whose proportions the clips get.
        share_alike: False leaves out motion under share-alike licences (HDM05).
        progress: called after each recording.
        dropped: counts what was left out by reason.

    Returns:
        Clips without objects, at least 0.8 s long, standing on the floor.

    Raises:
        InputError: ``mocap-folder`` when the folder holds no motion file.
    """
    motions = list(read_mocap_folder(folder, share_alike=share_alike, skipped=dropped))
    families: dict[str, list[SourceMotion]] = defaultdict(list)
    for motion in motions:
        families[motion.skeleton.name].append(motion)
    corrections = {name: calibrate(family, body) for name, family in families.items()}
    clips: list[Clip] = []
    for done, motion in enumerate(motions, start=1):
        clips += mocap_clips(motion, corrections[motion.skeleton.name], body, dropped)
        if progress is not None:
            progress(done, len(motions))
    return clips


def mocap_clips(
    motion: SourceMotion,
    corrections: Corrections,
    body: BodyModel,
    dropped: Counter[str] | None = None,
) -> Iterator[Clip]:
    """The stretches of one recording in which somebody stands or moves on one level floor.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions the clips get.
        dropped: counts recordings that skate (``skating``) or have no good stretch (``no-floor``).
    """
    root, rotations = retarget(motion, corrections, body)
    grounded = ground(body, root, rotations)
    reason = "skating" if grounded.skating > _WORST_SKATING else "no-floor"
    stretches = [] if reason == "skating" else runs(_usable(body, grounded))
    stretches = [(a, b) for a, b in stretches if b - a >= _SHORTEST]
    if not stretches and dropped is not None:
        dropped[reason] += 1
    for k, (first, last) in enumerate(stretches):
        part = slice(first, last)
        yield Clip(
            name=motion.name if len(stretches) == 1 else f"{motion.name}#{k}",
            source=motion.skeleton.name,
            licence=motion.licence,
            root=grounded.root[part],
            rotations=grounded.rotations[part],
            hand_contact=np.zeros((last - first, 2)),
            foot_contact=grounded.foot_contact[part],
            object_motion=None,
        )


def _usable(body: BodyModel, grounded: Grounded) -> Bool[np.ndarray, " frames"]:
    joints = joints_of(body, grounded.root, grounded.rotations)
    soles = sole_points(body, grounded.root, grounded.rotations)
    bad = np.abs(grounded.level - np.median(grounded.level)) > _STEP_HEIGHT
    bad |= soles[..., 2].min(axis=1) < _DEEPEST_SOLE
    bad |= joints[:, 0, 2] < _LOWEST_PELVIS
    bad |= joints[:, joint("head"), 2] < _LOWEST_HEAD
    spread = np.convolve(bad, np.ones(2 * _EDGE + 1), mode="same") > 0
    return ~spread
