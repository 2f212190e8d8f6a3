"""An animation as an ObjectMotion: which thing is meant, its mesh, its checks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int, UInt8

from ingest.animated.animation import Animation, Up
from ingest.axes import T_ZUP_ARKIT
from ingest.mesh import MAX_EXTENT, MIN_EXTENT, load_mesh
from ingest.mesh_files.file_parts import MAX_FACES, FilePart
from ingest.mesh_texture import TexturedPart, join_textures, patch
from ingest.trajectory.floor import Floor
from ingest.trajectory.segments import segments
from ingest.trajectory.trajectory_config import BREAKS
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import inverse, nearest_rotation, turning_speed
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion, Texture

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
        fix="Pass ‹mesh_scale› with the factor that brings the file to metres, e.g. 0.01.",
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
    if mesh_file is None:
        notes = (*animation.notes, *notes)
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
            field="object",
            fix="Give the object's mesh: ‹object› FILE (OBJ, PLY, STL or GLB, in metres).",
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
            "the floor of the file is elsewhere, give its height, e.g. ‹floor› 0.",
        )
    below = valid & (bottom < given - _SUNK)
    if below.any():
        frames = np.flatnonzero(below)
        raise InputError(
            "floor-above-object",
            f"The object goes {given - lowest:.2f} m below the floor that is given.",
            where=f"{source}, {frames[0] / FPS:.2f} to {frames[-1] / FPS:.2f} s",
            fix=f"Leave out ‹floor›, give ‹floor› {lowest:.2f}, or raise the object there.",
        )
    return Floor(given, "given", f"The floor is at {given:.3f} m, as given.")


def _lowest(motion: ObjectMotion) -> Float64[np.ndarray, " frames"]:
    """Height of the lowest vertex in each frame."""
    T, vertices = motion.T_world_object, motion.mesh.vertices.astype(np.float64)
    return np.array([(vertices @ up).min() for up in T[:, 2, :3]]) + T[:, 2, 3]


_TOLERANCE = 1e-3
_FLAT = 1e-6


def split_stretch(
    T: Float64[np.ndarray, "frames 4 4"], place: Callable[[int], str]
) -> tuple[Float64[np.ndarray, "frames 4 4"], Float64[np.ndarray, "3 3"]]:
    """Rigid poses, and the stretch S of the mesh, such that T @ v = pose @ (S @ v).

    S is what scale (even or not), shear and mirror of a node and its parents amount to; it is the
    same in every frame, or the object is not rigid.

    Args:
        T: affine transforms, last row 0 0 0 1.
        place: says where a frame is, for messages.

    Raises:
        InputError: "animation-not-affine", "animation-flat" when a scale is zero,
            "animation-stretched" when size or shape change.
    """
    odd = np.abs(T[:, 3] - [0, 0, 0, 1]).max(axis=1) > _TOLERANCE
    if odd.any():
        raise InputError(
            "animation-not-affine",
            "The last row of the matrix is not 0 0 0 1.",
            where=place(int(np.argmax(odd))),
            fix="Write matrices row by row, the position in the last column.",
        )
    first = T[0, :3, :3]
    _, sizes, axes = np.linalg.svd(first)
    if sizes[2] <= _FLAT * max(sizes[0], _FLAT):
        raise InputError(
            "animation-flat",
            "The object is scaled to nothing.",
            where=place(0),
            fix="Give the object and its parents a scale that is not zero.",
        )
    stretch = (axes.T * sizes) @ axes * np.sign(np.linalg.det(first))
    R = T[:, :3, :3] @ np.linalg.inv(stretch)
    off = np.abs(R.swapaxes(1, 2) @ R - np.eye(3)).max(axis=(1, 2)) > _TOLERANCE
    if off.any():
        raise InputError(
            "animation-stretched",
            "The object changes its size or shape; people move rigid things.",
            where=place(int(np.argmax(off))),
            fix="Take out keys of scale, and apply uneven scale of its parents (in Blender Ctrl+A, "
            "Scale).",
        )
    poses = T.copy()
    poses[:, :3, :3] = nearest_rotation(R)
    poses[:, 3] = [0, 0, 0, 1]
    return poses, stretch


def choose(
    names: Sequence[str], candidates: Sequence[int], wanted: str | None, source: Path
) -> int:
    """Index of the object among all things of a scene.

    Args:
        names: of all of them.
        candidates: those that move and have a surface.
        wanted: the name the user gave; it need not be a candidate's.
        source: the file, for messages.

    Raises:
        InputError: "animation-missing" when nothing moves, "node-missing" for a name that is not
            there, "node-ambiguous" when several fit.
    """
    fits = [i for i, name in enumerate(names) if name == wanted] if wanted else list(candidates)
    if len(fits) == 1:
        return fits[0]
    listed = ", ".join(names[i] for i in candidates[:12]) or "none"
    if wanted and not fits:
        raise InputError(
            "node-missing",
            f"{source.name} has nothing of the name {wanted!r}; what moves in it: {listed}.",
            where=str(source),
            fix="Give one of these names with ‹node›.",
        )
    if wanted:
        raise InputError(
            "node-ambiguous",
            f"{len(fits)} things in {source.name} are named {wanted!r}.",
            where=str(source),
            fix="Give the object a name of its own, and export again.",
        )
    if not fits:
        raise InputError(
            "animation-missing",
            f"Nothing with a surface is animated in {source.name}.",
            where=str(source),
            fix="Animate the location and rotation of the object itself, and export with animation.",
        )
    raise InputError(
        "node-ambiguous",
        f"Several things move in {source.name}: {listed}.",
        where=str(source),
        fix="Say which one the person moves: ‹node› NAME.",
    )


@dataclass(frozen=True)
class MeshPart:
    """A mesh of the file, or a part of one that has its own material."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    uv: Float64[np.ndarray, "faces 3 2"] | None = None
    """Places of the corners on the picture, as `omomo_core.motion.Texture` has them."""
    image: UInt8[np.ndarray, "h w 3"] | None = None

    def moved(self, T: Float64[np.ndarray, "4 4"]) -> "MeshPart":
        """The part in other axes."""
        return replace(self, vertices=self.vertices @ T[:3, :3].T + T[:3, 3])


def as_mesh_part(part: FilePart) -> MeshPart:
    """A part of a mesh file with its picture decoded; without one that cannot be read."""
    try:
        pixels = None if part.picture is None else part.picture.pixels()
    except Exception:  # the decoders raise anything on a damaged picture
        pixels = None
    return MeshPart(part.vertices, part.faces, None if pixels is None else part.places, pixels)


def joined(
    parts: list[MeshPart], stretch: Float64[np.ndarray, "3 3"], name: str, source: Path
) -> ObjectMesh | None:
    """All parts as one mesh, stretched; equal vertices merged. None when there is no part.

    Raises:
        InputError: "mesh-unreadable" for a triangle without its vertices, "mesh-not-finite" or
            "mesh-too-large".
    """
    if not parts:
        return None
    _check(parts, source)
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices = np.concatenate([part.vertices for part in parts]) @ stretch.T
    faces = np.concatenate([part.faces + k for part, k in zip(parts, offsets, strict=True)])
    texture = _texture(parts)
    if np.linalg.det(stretch) < 0:  # a mirror turns triangles inside out
        faces = faces[:, ::-1]
        texture = texture and replace(texture, uv=texture.uv[:, ::-1])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    mesh.remove_unreferenced_vertices()
    return ObjectMesh(
        np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), name, texture
    )


def _texture(parts: list[MeshPart]) -> Texture | None:
    """One picture of the parts'; grey where a part has none and another has one."""
    if all(part.image is None for part in parts):
        return None
    plain = patch()
    painted: list[TexturedPart] = []
    for part in parts:
        corners, uv = part.vertices[part.faces], part.uv
        if uv is None or part.image is None:
            painted.append(TexturedPart(corners, np.full((*part.faces.shape, 2), 0.5), plain))
        else:
            painted.append(TexturedPart(corners, uv, part.image))
    return join_textures(painted)


def _check(parts: list[MeshPart], source: Path) -> None:
    triangles = sum(len(part.faces) for part in parts)
    if triangles > MAX_FACES:
        raise InputError(
            "mesh-too-large",
            f"The object has {triangles:,} triangles; at most {MAX_FACES:,} are read.",
            where=str(source),
            fix="Simplify the mesh: 20,000 triangles are plenty for a motion.",
        )
    for vertices, faces in ((part.vertices, part.faces) for part in parts):
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise InputError(
                "mesh-unreadable",
                "A triangle of the object names a vertex that is not there.",
                where=str(source),
                fix="Export the file again.",
            )
        if not np.isfinite(vertices).all():
            raise InputError(
                "mesh-not-finite",
                "The object has vertices that are NaN or infinite.",
                where=str(source),
                fix="Export the file again.",
            )
