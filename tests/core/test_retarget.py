"""Retargeting: bones point where the source's did, people face where they faced, soles on the floor."""

from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import load_body
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.grounding import foot_skating, ground
from omomo_core.learning.recordings.mocap import METRES_PER_BVH_UNIT, SourceMotion, read_mocap_npz
from omomo_core.learning.recordings.recordings import build_mocap, motion_files, read_recordings
from omomo_core.learning.recordings.retargeting import calibrate, mocap_clips, retarget
from omomo_core.skeleton import joint

FAMILIES = {
    "cmu_bvh": "data/mocap/cmu_bvh/02",
    "cmu_jump": "data/mocap/cmu_jump",
    "o3de": "data/mocap/o3de",
    "hdm05": "data/mocap/hdm05",
}

LIMB_BONES: tuple[tuple[str, str], ...] = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in ("left", "right")
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)


def bone_angles(
    motion: SourceMotion, joints: Float[np.ndarray, "frames 24 3"]
) -> Float[np.ndarray, "frames bones"]:
    """Angle between each of our limb bones and the source's, radians."""
    angles: list[Float[np.ndarray, " frames"]] = []
    for a, b in LIMB_BONES:
        theirs = motion.position(motion.skeleton.points[b]) - motion.position(
            motion.skeleton.points[a]
        )
        ours = joints[:, joint(b)] - joints[:, joint(a)]
        cosine = (theirs * ours).sum(-1) / (
            np.linalg.norm(theirs, axis=-1) * np.linalg.norm(ours, axis=-1)
        )
        angles.append(np.arccos(cosine.clip(-1.0, 1.0)))
    return np.stack(angles, axis=1)


@pytest.fixture(scope="module")
def recordings(shared: Path) -> dict[str, list[SourceMotion]]:
    def motions(folder: Path) -> Iterator[SourceMotion]:
        for path in motion_files(folder):
            for found in read_recordings(path, load_body(), METRES_PER_BVH_UNIT):
                if isinstance(found, SourceMotion):
                    yield found

    return {name: list(islice(motions(shared / path), 12)) for name, path in FAMILIES.items()}


@pytest.mark.parametrize("family", FAMILIES)
def test_limbs_point_as_in_the_source(
    recordings: dict[str, list[SourceMotion]], family: str
) -> None:
    body = load_body()
    motions = recordings[family]
    corrections = calibrate(motions, body)
    for motion in motions[:5]:
        root, rotations = retarget(motion, corrections, body)
        np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-5)
        angles = bone_angles(motion, joints_of(body, root, rotations))
        assert np.degrees(angles.mean(axis=0)).max() < 8


@pytest.mark.parametrize("family", FAMILIES)
def test_people_face_forward_and_bend_the_right_way(
    recordings: dict[str, list[SourceMotion]], family: str
) -> None:
    body = load_body()
    motions = recordings[family]
    corrections = calibrate(motions, body)
    for motion in motions[:5]:
        root, rotations = retarget(motion, corrections, body)
        joints = joints_of(body, root, rotations)
        left = joints[:, joint("left_hip")] - joints[:, joint("right_hip")]
        facing = np.cross(left, [0.0, 0.0, 1.0])
        facing /= np.linalg.norm(facing, axis=-1, keepdims=True)
        for name in ("pelvis", "spine3", "head", "left_foot", "right_foot"):
            forward = rotations[:, joint(name), :, 2]
            assert np.quantile((forward * facing).sum(-1), 0.9) > 0.5, name
        for side in ("left", "right"):
            hip, knee, ankle = (joints[:, joint(f"{side}_{p}")] for p in ("hip", "knee", "ankle"))
            hinge = rotations[:, joint(f"{side}_hip"), :, 0]
            bend = (np.cross(knee - hip, ankle - knee) * hinge).sum(-1)
            assert np.quantile(bend, 0.02) > -0.01


def test_hands_are_in_line_with_hanging_arms(recordings: dict[str, list[SourceMotion]]) -> None:
    """Where the source has no hand, the palms of hanging arms face the thighs."""
    body = load_body()
    motions = recordings["cmu_jump"]
    walk = next(m for m in motions if m.name == "02_01")
    root, rotations = retarget(walk, calibrate(motions, body), body)
    joints = joints_of(body, root, rotations)
    hand = joints[:, 22] - joints[:, joint("left_wrist")]
    forearm = joints[:, joint("left_wrist")] - joints[:, joint("left_elbow")]
    cosine = (hand * forearm).sum(-1) / (
        np.linalg.norm(hand, axis=-1) * np.linalg.norm(forearm, axis=-1)
    )
    assert cosine.min() > 0.98
    palm_normal = -rotations[:, joint("left_wrist"), :, 1]
    right = joints[:, joint("right_hip")] - joints[:, joint("left_hip")]
    assert np.median((palm_normal * right).sum(-1) / np.linalg.norm(right, axis=-1)) > 0.7


def test_grounded_feet_stand_still_on_the_floor(recordings: dict[str, list[SourceMotion]]) -> None:
    body = load_body()
    motions = recordings["o3de"]
    root, rotations = retarget(motions[0], calibrate(motions, body), body)
    result = ground(body, root + np.array([0.0, 0.0, 0.3]), rotations)
    soles = sole_points(body, result.root, result.rotations)
    planted = result.foot_contact > 0
    assert planted.any(axis=1).mean() > 0.5
    assert np.abs(soles[planted][:, 2]).mean() < 0.015
    assert soles[..., 2].min() > -0.08
    assert foot_skating(soles, planted) < 0.6 * result.skating


def test_lying_down_is_left_out(shared: Path, recordings: dict[str, list[SourceMotion]]) -> None:
    body = load_body()
    corrections = calibrate(recordings["hdm05"], body)
    files = sorted((shared / FAMILIES["hdm05"]).glob("*lieDownFloor_00*"))
    motions = [read_mocap_npz(path) for path in files]
    clips = [clip for m in motions for clip in mocap_clips(m, corrections, body)]
    kept = sum(len(clip.root) for clip in clips)
    assert 0 < kept < 0.8 * sum(len(m.positions) for m in motions)
    for clip in clips:
        assert joints_of(body, clip.root, clip.rotations)[:, joint("head"), 2].min() > 0.45


def test_build_makes_named_licensed_clips(shared: Path) -> None:
    steps: list[tuple[int, int]] = []
    dropped: Counter[str] = Counter()
    clips = build_mocap(
        shared / FAMILIES["cmu_bvh"],
        load_body(),
        progress=lambda done, total: steps.append((done, total)),
        dropped=dropped,
    )
    assert steps[-1] == (10, 10)
    assert {c.source for c in clips} == {"cmu_bvh"}
    assert all("mocap.cs.cmu.edu" in c.licence for c in clips)
    assert all(c.object_motion is None and not c.hand_contact.any() for c in clips)
    assert len({c.name for c in clips}) == len(clips) >= 8


def test_runs() -> None:
    assert runs(np.array([], bool)) == []
    assert runs(np.array([True, True, False, True])) == [(0, 2), (3, 4)]
