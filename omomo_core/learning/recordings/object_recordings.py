"""Recordings of people together with the object they hold, SkillMimic's ball among them.

The whole scene (way, object, palms) is scaled to our legs. Then our arms are solved to the recorded palms,
so that hands stay where they were on the object.

SkillMimic's recordings of a person with a ball (Wang et al. 2024), where it is held or rests.

A file is an npz as `read_mocap_npz` reads, with the ball besides: ``obj_pos`` (T, 3), ``obj_radius`` and
``contact`` (T,), which says that some hand holds. Of the 4.1 published minutes (101 takes), 2.4 remain (55
takes), with a hand on the ball in 1.5. Left out are flight, bounces, rolling and dribbling: there the ball
moves and no hand is on it, and a network would learn that objects move by themselves.

The recordings lack how the ball turns. It is taken to turn with the hands that hold it.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import trimesh
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d

from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import nearest_rotation
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.learning.recordings.mocap import (
    R_ZUP,
    UNREADABLE,
    SourceMotion,
    not_a_motion,
    read_mocap_npz,
    resample,
)
from omomo_core.learning.recordings.retargeting import SHORTEST, WORST_SKATING, usable_frames
from omomo_core.learning.recordings.smpl import RecordedMotion
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion

LEAST_CONTACT = 10
"""Frames of contact without which a stretch says nothing about holding."""


@dataclass(frozen=True)
class RecordedObject:
    """An object and the hands on it, as large as they were recorded; world z up, floor 0, 30 fps."""

    mesh: ObjectMesh
    T_world_object: Float[np.ndarray, "frames 4 4"]
    palms: Float[np.ndarray, "frames 2 3"]
    """Goals of the bases of the middle fingers, left and right, metres."""
    contact: Bool[np.ndarray, "frames 2"]
    """Whether the left, right hand touches the object."""
    usable: Bool[np.ndarray, " frames"]
    """False where no hand moves the object that moves."""


@dataclass(frozen=True)
class ObjectRecording:
    """A recording on a skeleton of its own, and the object in it."""

    motion: SourceMotion
    held: RecordedObject


def object_clips(
    person: RecordedMotion,
    held: RecordedObject,
    scale: float,
    body: BodyModel,
    dropped: Counter[str] | None = None,
) -> Iterator[Clip]:
    """Yield the stretches in which the person stands and the object rests or is held.

    Args:
        person: on our skeleton, scaled to our legs.
        held: as recorded.
        scale: our legs to theirs.
        body: whose proportions the clips get.
        dropped: counts recordings that skate (``skating``) or in which no stretch of 0.8 s shows a
            hand on the object (``no-contact``).
    """
    grounded = ground(body, person.root, person.rotations)
    if grounded.skating > WORST_SKATING:
        if dropped is not None:
            dropped["skating"] += 1
        return
    palms = torch.from_numpy(held.palms * scale)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, palms[:, side])
    T = held.T_world_object.copy()
    T[:, :3, 3] *= scale
    mesh = ObjectMesh(
        (held.mesh.vertices * scale).astype(np.float32), held.mesh.faces, held.mesh.name
    )
    stretches = _stretches(held, usable_frames(body, grounded))
    if not stretches and dropped is not None:
        dropped["no-contact"] += 1
    for k, part in enumerate(stretches):
        yield Clip(
            name=person.name if len(stretches) == 1 else f"{person.name}#{k}",
            source=person.source,
            licence=person.licence,
            root=grounded.root[part],
            rotations=rotations.numpy()[part],
            hand_contact=held.contact[part].astype(float),
            foot_contact=grounded.foot_contact[part],
            object_motion=ObjectMotion(mesh, T[part], np.ones(len(T[part]), bool)),
        )


def _stretches(held: RecordedObject, standing: Bool[np.ndarray, " frames"]) -> list[slice]:
    found = [slice(a, b) for a, b in runs(held.usable & standing) if b - a >= SHORTEST]
    return [part for part in found if held.contact[part].any(axis=1).sum() >= LEAST_CONTACT]


_FINGERS = ("Index", "Middle", "Ring", "Pinky", "Thumb")


@dataclass(frozen=True)
class BallReading:
    """Numbers by which a recording of a ball is read; metres, seconds."""

    near: float = 0.06
    """A hand with a finger joint this near the surface holds, while the recording says that one does."""
    palm_least: float = 0.01
    palm_most: float = 0.025
    """A palm that holds is put this far from the surface: recorded fingers stretch over the ball or
    sink into it."""
    blend: float = 0.1
    """Over which a palm gets there (standard deviation)."""
    resting_speed: float = 0.08
    fastest_held: float = 2.5
    """A faster ball is struck, shot, or still flies while it is caught."""
    bridged: float = 0.1
    """The label of contact may come and go this much too late."""


_READING = BallReading()


def is_ball(path: Path) -> bool:
    """Whether an npz holds a person with a ball (False for files that cannot be read)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return "obj_radius" in data and "joint_rot_global_xyzw" in data
    except UNREADABLE:
        return False


def read_ball(path: Path) -> ObjectRecording:
    """Read a person with a ball.

    Raises:
        InputError: as `read_mocap_npz`; ``mocap-file`` when an array of the ball is missing or odd,
            ``mocap-not-finite``, ``mocap-units`` when no ball is so large.
    """
    motion = read_mocap_npz(path)
    centre, radius, some = _arrays(path, len(motion.positions))
    centre[:, 2] = centre[:, 2].clip(radius)
    fingers = _fingers(motion)
    apart = np.linalg.norm(fingers - centre[:, None, None], axis=-1).min(axis=2) - radius
    contact = _steady((apart < _READING.near) & some[:, None])
    T = np.tile(np.eye(4), (len(centre), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = _turning(fingers - centre[:, None, None], contact), centre
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    mesh = ObjectMesh(np.asarray(sphere.vertices), np.asarray(sphere.faces), "ball")
    palms = _on_surface(motion, centre, radius, contact)
    return ObjectRecording(
        motion, RecordedObject(mesh, T, palms, contact, _held_or_resting(centre, contact))
    )


def _arrays(
    path: Path, frames: int
) -> tuple[Float[np.ndarray, "frames 3"], float, Bool[np.ndarray, " frames"]]:
    """The ball's centre, radius and contact at 30 fps, z up."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            centre = np.asarray(data["obj_pos"], float) @ R_ZUP[str(data["up"])].T
            radius, fps = float(data["obj_radius"]), float(data["fps"])
            some = np.asarray(data["contact"], bool)
    except UNREADABLE as problem:
        raise not_a_motion(path, problem) from problem
    where = str(path)
    if centre.ndim != 2 or centre.shape[1] != 3 or some.shape != centre.shape[:1]:
        raise InputError("mocap-file", "The ball's arrays do not match.", where=where)
    if not np.isfinite(centre).all():
        raise InputError("mocap-not-finite", "The ball is not a number.", where=where)
    if not 0.02 < radius < 0.6:
        raise InputError("mocap-units", f"No ball has a radius of {radius:g} m.", where=where)
    still = np.tile(np.eye(3), (len(centre), 1, 1, 1))
    centre = resample(centre[:, None], still, fps)[0][:, 0]
    if len(centre) != frames:
        raise InputError("mocap-file", "The ball has other frames than the person.", where=where)
    at = (np.arange(frames) * fps / FPS).round().astype(int).clip(max=len(some) - 1)
    return centre, radius, some[at]


def _fingers(motion: SourceMotion) -> Float[np.ndarray, "frames 2 joints 3"]:
    """All joints of the left and right fingers."""
    names = [f"{finger}{k}" for finger in _FINGERS for k in (1, 2, 3)]
    return np.stack(
        [np.stack([motion.position(f"{s}_{n}") for n in names], axis=1) for s in "LR"], axis=1
    )


def _steady(mask: Bool[np.ndarray, "frames 2"]) -> Bool[np.ndarray, "frames 2"]:
    """Without gaps and touches shorter than the time that is bridged."""
    column = np.ones((round(_READING.bridged * FPS) + 1, 1), bool)
    return binary_opening(binary_closing(mask, column), column)


def _held_or_resting(
    centre: Float[np.ndarray, "frames 3"], contact: Bool[np.ndarray, "frames 2"]
) -> Bool[np.ndarray, " frames"]:
    """Frames in which the ball rests, or moves no faster than people carry and is held."""
    speed = np.linalg.norm(np.gradient(centre, 1.0 / FPS, axis=0), axis=-1)
    bridged = np.ones(round(_READING.bridged * FPS) + 1, bool)
    resting = binary_opening(speed < _READING.resting_speed, bridged)
    held = contact.any(axis=1) & (speed < _READING.fastest_held)
    return binary_closing(resting | held, bridged) & (speed < _READING.fastest_held)


def _turning(
    fingers: Float[np.ndarray, "frames 2 joints 3"], contact: Bool[np.ndarray, "frames 2"]
) -> Float[np.ndarray, "frames 3 3"]:
    """R_world_ball that turns as the hands on the ball turn about its centre, and else stays."""
    # Smooth over touching frames alone: hands come fast, and the rest of their way turns no ball.
    weight = contact[..., None, None].astype(float)
    total, share = (
        gaussian_filter1d(x, 1.5, axis=0, mode="nearest") for x in (fingers * weight, weight)
    )
    fingers = total / share.clip(1e-9)
    R = np.tile(np.eye(3), (len(fingers), 1, 1))
    for t in range(1, len(fingers)):
        on = contact[t] & contact[t - 1]
        R[t] = R[t - 1]
        if on.any():
            before, now = (fingers[k, on].reshape(-1, 3) for k in (t - 1, t))
            R[t] = nearest_rotation(nearest_rotation(now.T @ before) @ R[t])
    return R


def _on_surface(
    motion: SourceMotion,
    centre: Float[np.ndarray, "frames 3"],
    radius: float,
    contact: Bool[np.ndarray, "frames 2"],
) -> Float[np.ndarray, "frames 2 3"]:
    """Recorded palms, moved along the ball's radius to a palm's thickness while they hold."""
    palms = np.stack([motion.position(f"{side}_Middle1") for side in "LR"], axis=1)
    out = palms - centre[:, None]
    apart = np.linalg.norm(out, axis=-1) - radius
    wanted = apart.clip(_READING.palm_least, _READING.palm_most)
    shift = np.where(contact, wanted - apart, 0.0)
    # Blended after the widest shift is spread, so that the first frame of a touch has all of it.
    shift = _spread(shift, contact)
    return palms + shift[..., None] * out / np.linalg.norm(out, axis=-1, keepdims=True).clip(1e-6)


def _spread(
    shift: Float[np.ndarray, "frames 2"], contact: Bool[np.ndarray, "frames 2"]
) -> Float[np.ndarray, "frames 2"]:
    """The shift of the nearest touching frame, fading over the frames around a touch."""
    frames, out = np.arange(len(shift)), shift.copy()
    for side in range(2):
        on = np.flatnonzero(contact[:, side])
        if len(on) == 0:
            continue
        away = np.abs(frames[:, None] - on)
        fade = np.exp(-0.5 * (away.min(axis=1) / (_READING.blend * FPS)) ** 2)
        out[:, side] = shift[on[away.argmin(axis=1)], side] * fade
    return out
