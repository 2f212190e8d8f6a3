"""Other characters: their own bones and rest pose, feet where they stood, hands on the object."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import characters
from capture_app.blender_extension.bone_names import BONE_NAMES
from capture_app.cli.app import invoke
from capture_app.commands.export import Bones, ExportFormat, ExportOptions
from capture_app.exports.bones import take_on_own_bones
from capture_app.exports.bvh import write_bvh
from capture_app.exports.export_sample import export
from capture_app.exports.exported_take import Skeleton, Take, placed
from capture_app.exports.glb import write_glb_take
from capture_app.exports.refit import take_on_target
from capture_app.exports.resample import Sampled
from capture_app.exports.target_skeleton import Target, read_target
from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS, joint
from tests.capture_app.exports.smplx_files import posed, raise_shoulders, write_smplx
from tests.rigs import KINDS, make_rig, write_rig

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
FRAMES = 20


@pytest.fixture(scope="module")
def holding(shipped: BodyModel) -> Sampled:
    """Stands with bent knees and elbows, both palms on a box that it lifts and turns a little."""
    t = np.linspace(0, 1, FRAMES)
    R = np.tile(UPRIGHT, (FRAMES, 22, 1, 1))
    for side, sign in (("left", 1), ("right", -1)):
        down = Rotation.from_euler("z", -60 * sign, degrees=True).as_matrix()
        ahead = Rotation.from_euler("y", -70 * sign, degrees=True).as_matrix()
        R[:, joint(f"{side}_shoulder")] = UPRIGHT @ down
        R[:, joint(f"{side}_elbow")] = R[:, joint(f"{side}_wrist")] = UPRIGHT @ down @ ahead
        bend = Rotation.from_euler("x", -35, degrees=True).as_matrix()
        R[:, joint(f"{side}_hip")] = UPRIGHT @ bend
        R[:, joint(f"{side}_knee")] = UPRIGHT @ bend.T
    rest = shipped.rest_joints.double().numpy()
    leg = np.linalg.norm(np.diff(rest[[1, 4, 7]], axis=0), axis=1).sum()
    root = np.tile([0.3, -0.2, rest[0, 1] - leg * (1 - np.cos(np.radians(35)))], (FRAMES, 1))
    joints = joints_of(shipped, root, R)
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", 0.1 * t[:, None]).as_matrix()
    T[:, :3, 3] = joints[:, 22:].mean(axis=1)
    human = HumanMotion(
        root=root.astype(np.float32),
        rotations=R.astype(np.float32),
        fingers=np.tile(np.eye(3, dtype=np.float32), (FRAMES, 30, 1, 1)),
        joints=joints.astype(np.float32),
        hand_contact=np.ones((FRAMES, 2), np.float32),
        foot_contact=np.ones((FRAMES, 4), np.float32),
    )
    mesh = ObjectMesh(np.eye(3), np.array([[0, 1, 2]]), "box")
    return Sampled(human, ObjectMotion(mesh, T, np.ones(FRAMES, bool)), 30.0)


def character(shipped: BodyModel, scale: float, bones: Bones) -> tuple[Skeleton, dict[str, int]]:
    """Arms down in an A-pose, bones of another size, random axes, and joints that are none of ours."""
    rng = np.random.default_rng(4)
    still = HumanMotion(
        root=np.zeros((1, 3), np.float32),
        rotations=np.tile(UPRIGHT, (1, 22, 1, 1)).astype(np.float32),
        fingers=np.tile(np.eye(3, dtype=np.float32), (1, 30, 1, 1)),
        joints=np.zeros((1, 24, 3), np.float32),
        hand_contact=np.zeros((1, 2), np.float32),
        foot_contact=np.zeros((1, 4), np.float32),
    )
    for side, sign in (("left", 1), ("right", -1)):
        down = Rotation.from_euler("z", -50 * sign, degrees=True).as_matrix()
        for part in ("shoulder", "elbow", "wrist"):
            still.rotations[0, joint(f"{side}_{part}")] = UPRIGHT @ down
    thing = ObjectMotion(
        ObjectMesh(np.eye(3), np.array([[0, 1, 2]]), "box"), np.eye(4)[None], np.ones(1, bool)
    )
    sized = replace(
        shipped, rest_joints=shipped.rest_joints * scale, vertices=shipped.vertices * scale
    )
    take = take_on_own_bones(Sampled(still, thing, 30.0), sized, BONE_NAMES[bones])
    points = take.positions[0] - take.positions[0, take.skeleton.hips]
    points[:, 2] += sized.rest_joints[0, 1].item()
    turned = Rotation.random(len(points), rng=rng).as_matrix() @ take.rotations[0]
    old = take.skeleton
    extra = len(old.names)
    wrist = take.human["left_elbow"]
    skeleton = Skeleton(
        (*old.names, "twist", "twist_tip"),
        (*old.parents, wrist, extra),
        np.concatenate([points, points[[wrist]] + 0.05, points[[wrist]] + [0.05, 0.1, 0]]),
        np.concatenate([turned, turned[:2]]),
        old.hips,
    )
    return skeleton, take.human


def take_of(skeleton: Skeleton, human: dict[str, int], like: Take) -> Take:
    """A character standing still, to be written as a file."""
    return replace(
        like,
        skeleton=skeleton,
        positions=skeleton.positions[None],
        rotations=skeleton.rotations[None],
        T_world_object=like.T_world_object[:1],
        hand_contact=like.hand_contact[:1],
        foot_contact=like.foot_contact[:1],
        human=human,
    )


Refit = Callable[[float], tuple[Take, tuple[str, ...]]]


@pytest.fixture(scope="module")
def refit(shipped: BodyModel, holding: Sampled) -> Refit:
    def fit(scale: float) -> tuple[Take, tuple[str, ...]]:
        skeleton, human = character(shipped, scale, Bones.unreal)
        return take_on_target(holding, shipped, Target("char", skeleton, human))

    return fit


@pytest.mark.parametrize("scale", [0.85, 1.0, 1.12])
def test_bones_keep_the_characters_lengths_and_rest(refit: Refit, scale: float) -> None:
    take, _ = refit(scale)
    bones = take.skeleton
    for j, parent in enumerate(bones.parents):
        if parent >= 0 and j not in bones.travelling:
            offset = bones.rotations[parent].T @ (bones.positions[j] - bones.positions[parent])
            R, p = take.rotations[:, parent], take.positions
            local = np.einsum("fyx,fy->fx", R, p[:, j] - p[:, parent])
            np.testing.assert_allclose(local, np.tile(offset, (FRAMES, 1)), atol=1e-6)


@pytest.mark.parametrize("scale", [0.85, 1.0, 1.12])
def test_hands_hold_the_object_and_feet_stand(refit: Refit, holding: Sampled, scale: float) -> None:
    take, notes = refit(scale)
    assert notes == ()
    for side, k in (("left", 22), ("right", 23)):
        palm = take.positions[:, take.human[f"{side}_middle1"]]
        np.testing.assert_allclose(palm, holding.human.joints[:, k], atol=1e-3)
        toe = take.positions[:, take.human[f"{side}_foot"]]
        assert np.abs(toe - toe[0]).max() < 1e-4
        ours = holding.human.joints[:, joint(f"{side}_foot")]
        np.testing.assert_allclose(toe[:, :2], ours[:, :2], atol=1e-4)
        standing = take.skeleton.positions[take.human[f"{side}_foot"], 2]
        np.testing.assert_allclose(toe[:, 2], standing, atol=1e-4)
    np.testing.assert_array_equal(take.T_world_object, holding.object_motion.T_world_object)


def test_limbs_point_where_ours_do(refit: Refit, shipped: BodyModel, holding: Sampled) -> None:
    """A pose is carried over from a T-pose to an A-pose: the same size leaves the same joints."""
    take, _ = refit(1.0)
    for name in ("left_elbow", "right_wrist", "left_knee", "head", "right_index2", "left_thumb3"):
        ours = take_on_own_bones(holding, shipped, BONE_NAMES[Bones.smplx])
        true = ours.positions[:, ours.human[name]]
        np.testing.assert_allclose(take.positions[:, take.human[name]], true, atol=3e-3)


def test_arms_that_are_too_short_are_told(refit: Refit) -> None:
    _, notes = refit(0.4)
    assert any("does not reach" in note for note in notes)


def test_a_head_in_the_object_is_told(shipped: BodyModel, holding: Sampled) -> None:
    corners = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                      (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])  # fmt: skip
    moved = replace(holding.object_motion, mesh=ObjectMesh(corners * 0.6, faces, "box"))
    for scale, told in ((1.0, False), (0.6, True)):
        target = Target("char", *character(shipped, scale, Bones.unreal))
        _, notes = take_on_target(replace(holding, object_motion=moved), shipped, target)
        assert any("the head is inside the object" in note for note in notes) == told


@pytest.mark.parametrize("bones", list(Bones))
def test_a_glb_character_reads_back_as_it_was(
    tmp_path: Path, shipped: BodyModel, holding: Sampled, bones: Bones
) -> None:
    skeleton, human = character(shipped, 0.9, bones)
    like = take_on_own_bones(holding, shipped, BONE_NAMES[bones])
    write_glb_take(tmp_path / "char.glb", take_of(skeleton, human, like))
    target = read_target(tmp_path / "char.glb")
    assert set(target.joints) == set(human)
    for ours, k in target.joints.items():
        at = target.skeleton.positions[k]
        np.testing.assert_allclose(at, skeleton.positions[human[ours]], atol=1e-5)
        R = target.skeleton.rotations[k]
        np.testing.assert_allclose(R, skeleton.rotations[human[ours]], atol=1e-5)
    assert "twist_tip" in target.skeleton.names


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("units", ["m", "cm"])
def test_a_bvh_character_reads_back_in_metres(
    tmp_path: Path, shipped: BodyModel, holding: Sampled, up: Any, units: Any
) -> None:
    like = take_on_own_bones(holding, shipped, BONE_NAMES[Bones.mixamo])
    path = tmp_path / "char.bvh"
    write_bvh(path, tmp_path / "o.bvh", placed(like, up, units))
    target = read_target(path)
    for ours, k in target.joints.items():
        at = like.skeleton.positions[like.human[ours]]
        np.testing.assert_allclose(target.skeleton.positions[k], at, atol=0.005)


def test_our_own_skeleton_changes_nothing(
    tmp_path: Path, holding: Sampled, shipped: BodyModel, read_glb: Any
) -> None:
    moving = (holding.human, holding.object_motion, shipped)
    export(tmp_path / "own.glb", *moving, ExportOptions(to=ExportFormat.glb, bones=Bones.mixamo))
    export(tmp_path / "again.glb", *moving, ExportOptions(), skeleton=tmp_path / "own.glb")
    a, b = (read_glb(tmp_path / name) for name in ("own.glb", "again.glb"))
    for name in BONE_NAMES[Bones.mixamo].of.values():
        first, second = (r.world(name, frames=FRAMES)[:, :3, 3] for r in (a, b))
        np.testing.assert_allclose(second, first, atol=2e-4)


def test_smplx_poses_are_those_of_the_model(
    tmp_path: Path, shipped: BodyModel, holding: Sampled
) -> None:
    """A stand-in for the licensed file, arms hanging at rest: posed by its poses, hands hold."""
    skeleton, human = character(shipped, 0.97, Bones.smplx)
    order = [human[name] for name in ALL_JOINTS]
    rest = skeleton.positions[order] @ UPRIGHT + [0.01, -0.4, 0.02]
    raise_shoulders(rest)
    path = tmp_path / "SMPLX_FAKE.npz"
    write_smplx(path, rest)
    export(
        tmp_path / "a.npz",
        holding.human,
        holding.object_motion,
        shipped,
        ExportOptions(to=ExportFormat.amass),
        skeleton=path,
    )
    with np.load(tmp_path / "a.npz") as file:
        data = dict(file)
    assert bool(data["exact"])
    pose = np.concatenate([data["poses"][:, :66], data["poses"][:, 75:]], axis=1)
    joints = posed(pose.reshape(-1, 52, 3), data["trans"], rest)
    np.testing.assert_allclose(joints, data["joints"], atol=1e-5)
    np.testing.assert_allclose(joints[:, [25, 40]], holding.human.joints[:, 22:], atol=1e-3)
    ours = holding.human.joints
    for shoulder in (joint("left_shoulder"), joint("right_shoulder")):
        seen, as_ours = (at[:, shoulder] - at[:, joint("spine3")] for at in (joints, ours))
        raised = rest[shoulder] - rest[joint("spine3")]
        assert _cosine(seen, as_ours).min() > np.cos(np.radians(3))
        assert _cosine(raised, as_ours[0] @ UPRIGHT) < np.cos(np.radians(10))


def _cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)


def test_a_skeleton_of_nobody_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "box.bvh"
    path.write_text(
        "HIERARCHY\nROOT object\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n"
    )
    with pytest.raises(InputError) as caught:
        read_target(path)
    assert caught.value.code == "skeleton-unknown"
    assert "pelvis" in caught.value.what


def test_what_is_no_skeleton_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "char.glb"
    for content in (b"", b"hello", b"glTF" + b"\0" * 40):
        path.write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_target(path)
        assert caught.value.code == "skeleton-unreadable"


def test_an_fbx_without_a_blender_is_refused(
    tmp_path: Path, shipped: BodyModel, holding: Sampled
) -> None:
    moving = (holding.human, holding.object_motion, shipped)
    character = tmp_path / "char.fbx"
    for there, code in ((False, "skeleton-unreadable"), (True, "blender-missing")):
        if there:
            character.write_bytes(b"Kaydara FBX Binary")
        with pytest.raises(InputError) as caught:
            export(
                tmp_path / "a.glb",
                *moving,
                ExportOptions(),
                skeleton=character,
                blender="no-blender",
            )
        assert caught.value.code == code


@pytest.mark.parametrize("name", KINDS)
def test_characters_of_others_are_read_with_their_bones(tmp_path: Path, name: str) -> None:
    """Scaled nodes, twist bones, no fingers, and a node above the bones that is none."""
    rig = make_rig(KINDS[name])
    target = read_target(write_rig(rig, tmp_path / "rig.glb"))
    assert target.skeleton.names[0] == rig.names[0]
    assert set(target.skeleton.names) == set(rig.names)
    assert {o: target.skeleton.names[k] for o, k in target.joints.items()} == {
        o: rig.names[k] for o, k in rig.joints.items()
    }
    x, y, z = rig.positions[rig.joints["left_wrist"]] - rig.positions[rig.joints["pelvis"]]
    seen = target.skeleton.positions[target.joints["left_wrist"]]
    at = target.skeleton.positions[target.joints["pelvis"]]
    np.testing.assert_allclose(seen - at, [x, -z, y], atol=1e-5)


@pytest.mark.slow
def test_six_characters_hold_and_stand_as_the_benchmark_measures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["demo", "-o", str(tmp_path / "demo")]) == 0
    capsys.readouterr()
    characters.main([str(tmp_path / "demo")])
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[0] for row in rows] == list(KINDS)
    for name, size, palm, _, sole, slide, *_ in rows:
        assert float(sole) < 5, name
        if float(size) >= 1:
            assert float(palm) < 5, name
            assert float(slide) < 1, name
