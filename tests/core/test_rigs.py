"""BVH of common rigs: joints are found by name, rest poses of any kind give the same motion."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.mocap import read_bvh_motion
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.recordings.retargeting import calibrate, retarget
from omomo_core.skeleton import joint
from tests.core.rig_files import write_bvh

PARTS = ("hip", "knee", "ankle", "foot", "collar", "shoulder", "elbow", "wrist")
RIGS: dict[str, tuple[str, str, str]] = {
    "mixamo": (
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head",
        "mixamorig:*UpLeg mixamorig:*Leg mixamorig:*Foot mixamorig:*ToeBase mixamorig:*Shoulder "
        "mixamorig:*Arm mixamorig:*ForeArm mixamorig:*Hand",
        "Left Right",
    ),
    "rokoko": (
        "Hips Spine1 Spine2 Spine3 Neck Head",
        "*Thigh *Shin *Foot *Toe *Shoulder *Arm *ForeArm *Hand",
        "Left Right",
    ),
    "xsens": (
        "Hips Chest Chest2 Chest3 Neck Head",
        "*Hip *Knee *Ankle *Toe *Collar *Shoulder *Elbow *Wrist",
        "Left Right",
    ),
    "unreal": (
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "thigh_* calf_* foot_* ball_* clavicle_* upperarm_* lowerarm_* hand_*",
        "l r",
    ),
    "biped": (
        "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Spine2 Bip01_Neck Bip01_Head",
        "Bip01_*_Thigh Bip01_*_Calf Bip01_*_Foot Bip01_*_Toe0 Bip01_*_Clavicle Bip01_*_UpperArm "
        "Bip01_*_Forearm Bip01_*_Hand",
        "L R",
    ),
    "asf": (
        "root lowerback upperback thorax lowerneck head",
        "*femur *tibia *foot *toes *clavicle *humerus *radius *hand",
        "l r",
    ),
}


def names(rig: str) -> dict[str, str]:
    trunk, limbs, sides = (words.split() for words in RIGS[rig])
    out = dict(zip(("pelvis", "spine1", "spine2", "spine3", "neck", "head"), trunk, strict=True))
    for ours, theirs in zip(("left", "right"), sides, strict=True):
        out |= {f"{ours}_{p}": t.replace("*", theirs) for p, t in zip(PARTS, limbs, strict=True)}
    if rig == "biped":
        out = {k: v.replace("_", " ") for k, v in out.items()}
    return out


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize(("arms", "up"), [(0.0, "y"), (0.8, "y"), (1.4, "z")])
def test_every_rig_and_rest_pose_gives_the_same_motion(
    tmp_path: Path, rig: str, arms: float, up: str
) -> None:
    body = load_body()
    R = write_bvh(tmp_path / "a.bvh", names(rig).__getitem__, arms=arms, up=up)
    motion = read_bvh_motion(tmp_path / "a.bvh")
    root, found = retarget(motion, calibrate([motion], body), body)
    joints, wanted = joints_of(body, root, found), joints_of(body, root, R)
    limbs = [
        joint(f"{s}_{p}") for s in ("left", "right") for p in ("knee", "ankle", "elbow", "wrist")
    ]
    assert np.linalg.norm(joints - wanted, axis=-1)[:, limbs].max() < 0.06
    for name in ("pelvis", "spine3", "head", "left_hip", "right_elbow", "left_wrist"):
        j = joint(name)
        cosine = (np.einsum("tij,tij->t", found[:, j], R[:, j]) - 1) / 2
        assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 25, name


def test_a_rig_becomes_clips(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", names("mixamo").__getitem__, scale=1.1)
    clips = build_mocap(tmp_path, load_body())
    assert sum(len(c.root) for c in clips) > 60
    assert clips[0].source.startswith("rig_")


@pytest.mark.parametrize(("unit", "metres"), [(1.0, 1.0), (1000.0, 0.001), (39.37, 0.0254)])
def test_another_unit_is_refused_unless_it_is_told(
    tmp_path: Path, unit: float, metres: float
) -> None:
    path = tmp_path / "a.bvh"
    write_bvh(path, names("mixamo").__getitem__, unit=unit)
    with pytest.raises(InputError) as caught:
        read_bvh_motion(path)
    assert caught.value.code == "mocap-units"
    assert read_bvh_motion(path, metres).positions[:, 0, 2].mean() == pytest.approx(0.95, abs=0.15)


def test_what_cannot_be_used_is_named_and_none_is_an_error(tmp_path: Path) -> None:
    write_bvh(tmp_path / "good.bvh", names("rokoko").__getitem__)
    text = (tmp_path / "good.bvh").read_text()
    (tmp_path / "cut.bvh").write_text(text[: len(text) // 2])
    (tmp_path / "nan.bvh").write_text(text[: text.rindex(" ")] + " nan\n")
    write_bvh(tmp_path / "inches.bvh", names("rokoko").__getitem__, unit=39.37)
    write_bvh(
        tmp_path / "dog.bvh", lambda n: f"dog_{n}".replace("_left_", "_x").replace("_right_", "_y")
    )
    dropped, skipped = Counter[str](), list[InputError]()
    clips = build_mocap(tmp_path, load_body(), dropped=dropped, skipped=skipped)
    assert {c.name.partition("#")[0] for c in clips} == {"good"}
    assert dropped == {"bvh-syntax": 1, "bvh-not-finite": 1, "mocap-units": 1, "mocap-skeleton": 1}
    assert sorted(Path(p.where.split(",")[0].split(":")[0]).name for p in skipped) == [
        "cut.bvh", "dog.bvh", "inches.bvh", "nan.bvh",
    ]  # fmt: skip
    (tmp_path / "good.bvh").unlink()
    with pytest.raises(InputError) as caught:
        build_mocap(tmp_path, load_body())
    assert caught.value.code == "mocap-unusable"
