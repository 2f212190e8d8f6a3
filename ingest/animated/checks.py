"""Checks of an animation: speeds that nobody reaches, and sizes that look like a wrong unit."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64

from ingest.mesh import MAX_EXTENT, MIN_EXTENT
from ingest.trajectory.config import BREAKS
from ingest.trajectory.segments import segments
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import turning_speed
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion

MAX_SPEED, FAST = 15.0, 4.0
"""m/s of the object's middle: impossible for a hand, and unusual for a carried object."""
MAX_TURN, FAST_TURN = 60.0, 15.0
"""rad/s, the same for its rotation."""
_STILL, _STILL_TURN = 1e-3, 1e-2


def check_motion(motion: ObjectMotion, source: Path) -> tuple[str, ...]:
    """Refuse motions that are none, or that nobody makes; says what is unusual.

    Args:
        motion: of the object, z up, the floor anywhere.
        source: its file, for messages.

    Returns:
        Sentences for the user.

    Raises:
        InputError: "animation-short", "animation-still" or "animation-too-fast", with the times.
    """
    frames = len(motion.valid)
    if not segments(motion):
        raise InputError(
            "animation-short",
            f"The animation lasts {(frames - 1) / FPS:.2f} s"
            + ("" if motion.valid.all() else " with gaps")
            + f"; a take needs at least {BREAKS.shortest_segment:g} s without a gap.",
            where=str(source),
            fix="Animate for longer, and check the frame rate.",
        )
    T = motion.T_world_object.copy()
    low, high = motion.mesh.vertices.min(axis=0), motion.mesh.vertices.max(axis=0)
    T[:, :3, 3] += T[:, :3, :3] @ ((low + high) / 2)
    bridged = ~(motion.valid[1:] & motion.valid[:-1])
    path = np.diff(T[:, :3, 3], axis=0)
    speed = np.where(bridged, 0.0, np.linalg.norm(path, axis=1) * FPS)
    turn = np.where(bridged, 0.0, turning_speed(T[:, :3, :3], FPS)[:-1])
    if np.ptp(T[:, :3, 3], axis=0).max() < _STILL and turn.sum() / FPS < _STILL_TURN:
        raise InputError(
            "animation-still",
            "The object does not move.",
            where=str(source),
            fix="Animate its location or rotation, and export with animation.",
        )
    _refuse(speed > MAX_SPEED, f"moves at {speed.max():.3g} m/s", speed, source)
    _refuse(turn > MAX_TURN, f"turns by {np.degrees(turn.max() / FPS):.0f}° a frame", speed, source)
    return (
        *_note(speed > FAST, f"moves at up to {speed.max():.1f} m/s"),
        *_note(turn > FAST_TURN, f"turns at up to {turn.max() / (2 * np.pi):.1f} turns a second"),
    )


def check_size(mesh: ObjectMesh, scale: float, source: Path) -> None:
    """Refuse an object that no person moves: the file is in another unit.

    Raises:
        InputError: "mesh-units".
    """
    sides = np.ptp(mesh.vertices, axis=0) * scale
    if MIN_EXTENT <= sides.max() <= MAX_EXTENT:
        return
    raise InputError(
        "mesh-units",
        f"The object measures {' x '.join(f'{side:.4g}' for side in sides)} m; a thing that a person "
        f"moves has its largest side between {MIN_EXTENT:g} and {MAX_EXTENT:g} m.",
        where=str(source),
        fix="Pass --mesh-scale with the factor that brings the file to metres, e.g. 0.01.",
    )


def _refuse(
    steps: Bool[np.ndarray, " steps"],
    what: str,
    speed: Float64[np.ndarray, " steps"],
    source: Path,
) -> None:
    if not steps.any():
        return
    # Walking pace in centimetres is a hundred metres a second.
    centimetres = speed.max() > MAX_SPEED and np.median(speed[speed > 0.1]) > MAX_SPEED / 2
    raise InputError(
        "animation-too-fast",
        f"The object {what}, which no person can.",
        where=f"{source}, {_when(steps)}",
        fix="The positions look like centimetres: give metres."
        if centimetres
        else "Take out the jump, or give the motion more time; positions are in metres.",
    )


def _note(steps: Bool[np.ndarray, " steps"], what: str) -> tuple[str, ...]:
    if not steps.any():
        return ()
    return (f"The object {what} ({_when(steps)}): faster than people move what they carry.",)


def _when(steps: Bool[np.ndarray, " steps"]) -> str:
    found = runs(steps)
    spans = [f"frames {a} to {b} ({a / FPS:.2f} to {b / FPS:.2f} s)" for a, b in found[:3]]
    return ", ".join(spans) + (f" and {len(found) - 3} more" if len(found) > 3 else "")
