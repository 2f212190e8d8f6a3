"""What every format writes: a skeleton with its skin, posed in each frame, and the moving object."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from capture_app.commands.export import Units, UpAxis
from capture_app.exports.contact_spans import ExportedContact
from omomo_core.motion import ObjectMesh

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""R_yup_world: our z up becomes y up, our -y becomes +z."""
_PER_METRE: dict[Units, float] = {"m": 1.0, "cm": 100.0}
_ROTATION: dict[UpAxis, Float[np.ndarray, "3 3"]] = {"z": np.eye(3), "y": Y_UP}


@dataclass(frozen=True)
class Skeleton:
    """Bones at rest: standing on the floor over the world's origin, facing -y (+z when y is up)."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """Index of each joint's parent, which comes before it; -1 for the first."""
    positions: Float[np.ndarray, "joints 3"]
    rotations: Float[np.ndarray, "joints 3 3"]
    """R_world_joint at rest."""
    hips: int
    """The joint that carries the body through the world."""

    @property
    def above(self) -> list[int]:
        """Each joint's parent, and the first joint for itself."""
        return [max(parent, 0) for parent in self.parents]

    @property
    def travelling(self) -> tuple[int, ...]:
        """Joints that move against their parents: the hips, and those they hang on."""
        path = [self.hips]
        while self.parents[path[-1]] >= 0:
            path.append(self.parents[path[-1]])
        return tuple(sorted(path))


@dataclass(frozen=True)
class Skin:
    """A surface at rest, moved by at most four joints a vertex."""

    vertices: Float[np.ndarray, "verts 3"]
    normals: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    joints: Int[np.ndarray, "verts 4"]
    weights: Float[np.ndarray, "verts 4"]
    """Sum to 1; unused places hold joint 0 with weight 0."""


@dataclass(frozen=True)
class Take:
    """A motion ready to be written, in a right-handed world of which `placed` chooses the axes."""

    fps: float
    skeleton: Skeleton
    skin: Skin
    body: str
    credit: str
    positions: Float[np.ndarray, "frames joints 3"]
    rotations: Float[np.ndarray, "frames joints 3 3"]
    """R_world_joint; equal to the skeleton's when the body is at rest."""
    mesh: ObjectMesh
    T_world_object: Float[np.ndarray, "frames 4 4"]
    hand_contact: Bool[np.ndarray, "frames 2"]
    """Left, right hand holds the object."""
    foot_contact: Bool[np.ndarray, "frames 4"]
    """Left ankle, right ankle, left toe, right toe stands."""
    spans: tuple[ExportedContact, ...]
    """Contacts of the whole take, which may be longer than these frames."""
    human: dict[str, int]
    """Our joint names -> index in the skeleton; a skeleton may lack some."""

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """Seconds from the first frame."""
        return np.arange(len(self.positions)) / self.fps


@dataclass(frozen=True)
class Locals:
    """Poses of joints relative to their parents; of the first joint, to the world."""

    positions: Float[np.ndarray, "*frames joints 3"]
    rotations: Float[np.ndarray, "*frames joints 3 3"]


def placed(take: Take, up: UpAxis, units: Units) -> Take:
    """A take of our world (z up, metres) in another: every vector is turned, then scaled.

    Vectors in a joint's or the object's own frame are only scaled.
    """
    R, scale = _ROTATION[up], _PER_METRE[units]
    bones, skin, T = take.skeleton, take.skin, take.T_world_object.copy()
    T[:, :3, :3] = R @ T[:, :3, :3]
    T[:, :3, 3] = T[:, :3, 3] @ R.T * scale
    return replace(
        take,
        skeleton=replace(
            bones, positions=bones.positions @ R.T * scale, rotations=R @ bones.rotations
        ),
        skin=replace(skin, vertices=skin.vertices @ R.T * scale, normals=skin.normals @ R.T),
        positions=take.positions @ R.T * scale,
        rotations=R @ take.rotations,
        mesh=replace(take.mesh, vertices=take.mesh.vertices * scale),
        T_world_object=T,
        spans=tuple(_scaled(span, scale) for span in take.spans),
    )


def _scaled(span: ExportedContact, scale: float) -> ExportedContact:
    return span if span.point is None else replace(span, point=span.point * scale)


def rest_locals(skeleton: Skeleton) -> Locals:
    """The rest pose, joint by joint."""
    return _locals(skeleton, skeleton.positions, skeleton.rotations)


def pose_locals(take: Take) -> Locals:
    """Every frame, joint by joint."""
    return _locals(take.skeleton, take.positions, take.rotations)


def _locals(
    skeleton: Skeleton,
    positions: Float[np.ndarray, "*frames joints 3"],
    rotations: Float[np.ndarray, "*frames joints 3 3"],
) -> Locals:
    R_parent = rotations[..., skeleton.above, :, :].swapaxes(-1, -2).copy()
    origin = positions[..., skeleton.above, :].copy()
    R_parent[..., 0, :, :], origin[..., 0, :] = np.eye(3), 0.0
    offsets = np.einsum("...jxy,...jy->...jx", R_parent, positions - origin)
    return Locals(offsets, R_parent @ rotations)


def pose(
    skeleton: Skeleton,
    hips: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames joints 3 3"],
) -> Float[np.ndarray, "frames joints 3"]:
    """Return the joints' positions, from the hips and every joint's rotation, metres.

    Joints that the hips hang on go along over the floor, so that a program that takes a character's
    way from its first joint finds it there.
    """
    offsets = rest_locals(skeleton).positions
    way = (hips - skeleton.positions[skeleton.hips]) * [1.0, 1.0, 0.0]
    out = np.zeros((len(hips), len(skeleton.names), 3))
    for j, parent in enumerate(skeleton.parents):
        if j == skeleton.hips:
            out[:, j] = hips
        elif j in skeleton.travelling:
            out[:, j] = skeleton.positions[j] + way
        else:
            out[:, j] = out[:, parent] + rotations[:, parent] @ offsets[j]
    return out
