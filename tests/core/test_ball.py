"""Recordings of a person with a ball: palms on the ball, and only what hands explain."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import full_kinematics, joints_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.object_recordings import is_ball, read_ball
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.recordings.smpl import world_rotations
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS
from tests.core.rig_files import stepping

RADIUS = 0.12
_PARTS = {"pelvis": "Pelvis", "spine1": "Torso", "spine2": "Spine", "spine3": "Chest"} | {
    "hip": "Hip", "knee": "Knee", "ankle": "Ankle", "foot": "Toe", "collar": "Thorax",
    "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist", "neck": "Neck", "head": "Head",
}  # fmt: skip


def their_name(ours: str) -> str:
    side, _, part = ours.partition("_")
    if side not in ("left", "right"):
        return _PARTS[ours]
    return f"{side[0].upper()}_{_PARTS.get(part, part.title())}"


def write_ball(path: Path, *, taken: int = 30, **changes: object) -> Path:
    """Somebody who walks, and a ball that flies to the left palm and stays there from frame `taken`."""
    root, pose = stepping(240)
    R = torch.from_numpy(world_rotations(pose))
    still = torch.eye(3, dtype=torch.float64).expand(len(root), 30, 3, 3)
    joints, turned = (
        a.numpy() for a in full_kinematics(load_body(), torch.from_numpy(root), R, still)
    )
    palm = ALL_JOINTS.index("left_middle1")
    centre = joints[:, palm] + turned[:, 20] @ [0.0, -RADIUS - 0.05, 0.0]
    late = (taken - np.arange(taken))[:, None] / 30
    centre[:taken] += [4.0, 0.0, 0.0] * late
    names = [their_name(n) for n in ALL_JOINTS] + ["Spine2"]
    spine = ALL_JOINTS.index("spine2")
    joints, turned = (np.concatenate([a, a[:, [spine]]], axis=1) for a in (joints, turned))
    content: dict[str, object] = {
        "joints": joints,
        "joint_rot_global_xyzw": Rotation.from_matrix(turned.reshape(-1, 3, 3))
        .as_quat()
        .reshape(*joints.shape[:2], 4),
        "joint_names": np.array(names),
        "parents": np.array([*ALL_PARENTS, 3]),
        "fps": 30,
        "up": "z",
        "licence": "Apache-2.0",
        "obj_pos": centre,
        "obj_radius": RADIUS,
        "contact": np.arange(len(root)) >= taken,
    }
    np.savez(path, **(content | changes))  # pyright: ignore[reportArgumentType]
    return path


def test_only_the_held_stretch_becomes_a_clip_with_the_palm_on_the_ball(tmp_path: Path) -> None:
    write_ball(tmp_path / "catch_1.npz")
    body = load_body()
    (clip,) = build_mocap(tmp_path, body)
    assert (clip.source, clip.licence, clip.name) == ("skillmimic", "Apache-2.0", "catch_1")
    assert clip.object_motion is not None
    assert 200 <= len(clip.root) <= 212
    assert clip.hand_contact[2:, 0].all()
    assert not clip.hand_contact[:, 1].any()
    palms = joints_of(body, clip.root, clip.rotations)[:, 22]
    local = to_local(clip.object_motion.T_world_object, palms[:, None])[:, 0]
    apart = np.linalg.norm(local, axis=-1) - RADIUS
    assert np.abs(apart - 0.025).max() < 0.005
    # The ball turns with the hand, so the palm stays where it is on the ball.
    assert np.linalg.norm(local - local.mean(axis=0), axis=-1).max() < 0.01


def test_a_ball_that_nobody_holds_gives_no_clip(tmp_path: Path) -> None:
    write_ball(tmp_path / "a.npz", contact=np.zeros(240, bool))
    dropped = Counter[str]()
    with pytest.raises(InputError, match="no-contact"):
        build_mocap(tmp_path, load_body(), dropped=dropped)
    assert dropped == {"no-contact": 1}


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"obj_pos": np.full((240, 3), np.nan)}, "mocap-not-finite"),
        ({"obj_pos": np.zeros((239, 3))}, "mocap-file"),
        ({"contact": np.zeros(7, bool)}, "mocap-file"),
        ({"obj_radius": 12.0}, "mocap-units"),
        ({"obj_radius": np.zeros(3)}, "mocap-file"),
    ],
)
def test_an_odd_ball_is_named(tmp_path: Path, changes: dict[str, object], code: str) -> None:
    path = write_ball(tmp_path / "a.npz", **changes)  # pyright: ignore[reportArgumentType]
    assert is_ball(path)
    with pytest.raises(InputError) as caught:
        read_ball(path)
    assert caught.value.code == code


def test_real_takes_are_held_by_palms(shared: Path) -> None:
    folder, body = shared / "data/mocap/skillmimic_ball", load_body()
    clips = build_mocap(folder / "pick_40__001_007pickle_pick_005.npz", body)
    clips += build_mocap(folder / "catch__003_008pickle_catch_017.npz", body)
    assert [c.name[:4] for c in clips] == ["pick", "catc"]
    for clip in clips:
        assert np.median(_off(clip)) < 0.03
        assert clip.hand_contact.mean() > 0.3


def _off(clip: Clip) -> np.ndarray:
    """Metres between touching palms and the ball's surface."""
    assert clip.object_motion is not None
    palms = joints_of(load_body(), clip.root, clip.rotations)[:, 22:]
    radius = np.linalg.norm(clip.object_motion.mesh.vertices, axis=1).max()
    away = np.linalg.norm(palms - clip.object_motion.T_world_object[:, None, :3, 3], axis=-1)
    return (away - radius)[clip.hand_contact > 0]
