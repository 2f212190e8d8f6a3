"""An animation and a mesh become the object's motion over our floor."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.animated.animation import Animation, Up
from ingest.animated.checks import check_motion, check_size
from ingest.axes import T_ZUP_ARKIT
from ingest.mesh import load_mesh
from ingest.trajectory.floor import Floor
from ingest.trajectory.segments import segments
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion

_T_ZUP: dict[Up, Float64[np.ndarray, "4 4"]] = {"y": T_ZUP_ARKIT, "z": np.eye(4)}
"""Our axes from those of a world with that axis up."""
_SUNK = 0.05
_SAME_FLOOR = 0.02


@dataclass(frozen=True)
class AnimatedTake:
    """An animated object over our floor."""

    motion: ObjectMotion
    """Frame k is k/30 s after the first pose of the file."""
    segments: tuple[tuple[int, int], ...]
    """(start, stop) of the stretches without a gap, at least one."""
    floor: Floor
    """Its height along the up axis of the file's world."""
    notes: tuple[str, ...]
    """What the user should know about this take."""


def to_animated_take(
    animation: Animation, mesh_file: Path | None, *, scale: float = 1.0, floor: float | None = None
) -> AnimatedTake:
    """Turn an animation into the object's motion: 30 fps, z up, floor at 0; x and y as in the file.

    A mesh is taken in the axes of its file, which are those that the poses are about; those of glTF
    files, the animation's own mesh among them, are turned z up together with the poses.

    Args:
        animation: what the file says.
        mesh_file: the object's surface; None takes the animation's own.
        scale: of the mesh to metres; with the animation's own mesh, of the whole file.
        floor: height of the floor along the up axis of the file's world, metres; None takes the
            object's lowest point.

    Raises:
        InputError: "object-needed", "animation-short", "animation-still", "animation-too-fast",
            "floor-above-object", and those of `load_mesh`.
    """
    mesh, mesh_up = _mesh(animation, mesh_file, scale)
    T_file_object = animation.T_file_object.copy()
    if mesh_file is None:
        T_file_object[:, :3, 3] *= scale
    T_zup_object = _T_ZUP[animation.up] @ T_file_object @ inverse(_T_ZUP[mesh_up])
    motion = ObjectMotion(mesh, T_zup_object, animation.valid)
    notes = check_motion(motion, animation.source)
    ground = _floor(motion, floor, animation.source)
    T_world_zup = np.eye(4)
    T_world_zup[2, 3] = -ground.height
    moved = ObjectMotion(mesh, T_world_zup @ T_zup_object, animation.valid)
    shifted = floor is None and abs(ground.height) > _SAME_FLOOR
    return AnimatedTake(
        motion=moved,
        segments=tuple(segments(moved)),
        floor=ground,
        notes=(*notes, ground.message) if shifted else notes,
    )


def _mesh(animation: Animation, mesh_file: Path | None, scale: float) -> tuple[ObjectMesh, Up]:
    """The object's surface, and which axis of the poses' object is its z axis now."""
    if mesh_file is not None:
        turned = mesh_file.suffix.lower() in (".glb", ".gltf")
        return load_mesh(mesh_file, scale=scale), "y" if turned else "z"
    own = animation.mesh
    if own is None:
        raise InputError(
            "object-needed",
            f"{animation.source.name} has no surface for the object.",
            where="--object",
            fix="Give the object's mesh: --object FILE (OBJ, PLY, STL or GLB, in metres).",
        )
    check_size(own, scale, animation.source)
    R = _T_ZUP[animation.up][:3, :3]
    return replace(own, vertices=own.vertices @ R.T * scale), animation.up


def _floor(motion: ObjectMotion, given: float | None, source: Path) -> Floor:
    bottom = _lowest(motion)
    valid = motion.valid
    lowest = float(bottom[valid].min())
    if given is None:
        return Floor(
            lowest,
            "lowest",
            f"The object's lowest point, at {lowest:.2f} m in the file, is taken as the floor. If "
            "the floor of the file is elsewhere, give its height, e.g. --floor 0.",
        )
    below = valid & (bottom < given - _SUNK)
    if below.any():
        frames = np.flatnonzero(below)
        raise InputError(
            "floor-above-object",
            f"The object goes {given - lowest:.2f} m below the floor that is given.",
            where=f"{source}, {frames[0] / FPS:.2f} to {frames[-1] / FPS:.2f} s",
            fix=f"Leave out --floor, give --floor {lowest:.2f}, or raise the object there.",
        )
    return Floor(given, "given", f"The floor is at {given:.3f} m, as given.")


def _lowest(motion: ObjectMotion) -> Float64[np.ndarray, " frames"]:
    """Height of the lowest vertex in each frame."""
    T, vertices = motion.T_world_object, motion.mesh.vertices.astype(np.float64)
    return np.array([(vertices @ up).min() for up in T[:, 2, :3]]) + T[:, 2, 3]
