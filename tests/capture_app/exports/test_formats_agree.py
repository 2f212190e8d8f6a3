"""Motions in every format, read back by libraries that are not ours."""

import csv
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel
from scipy.spatial.transform import Rotation

from capture_app.blender_extension.bone_names import BONE_NAMES
from capture_app.commands.export import Bones, ExportFormat, ExportOptions
from capture_app.exports.export_sample import export
from capture_app.exports.resample import Sampled, at_rate
from omomo_core.body.model import BodyModel
from omomo_core.learning.recordings.bvh_file import read_bvh
from omomo_core.skeleton import ALL_JOINTS

with warnings.catch_warnings():
    # Its own dependency asks to be imported under another name.
    warnings.simplefilter("ignore")
    import bvhio

TOLERANCE = 1e-4
EACH = pytest.mark.parametrize(
    "motions", [range(6), pytest.param(range(100), marks=pytest.mark.slow)]
)
RATES = (24.0, 25.0, 30.0, 60.0)
Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
SCALE = {"m": 1.0, "cm": 100.0}


class Case:
    """One motion with options that its number draws."""

    def __init__(self, number: int, kind: ExportFormat, small_motion: Any, body: BodyModel) -> None:
        self.human, self.moved = small_motion(number)
        self.body, self.kind = body, kind
        self.fps = RATES[number % 4]
        self.bones = list(Bones)[number % 5]
        self.up = "yz"[number // 2 % 2]
        self.units = ("m", "cm")[number // 3 % 2]
        self.sampled = at_rate(self.human, self.moved, body, self.fps)
        self.names = [BONE_NAMES[self.bones].of[name] for name in ALL_JOINTS]

    def write(self, path: Path, **options: Any) -> Path:
        given = {"bones": self.bones, "fps": self.fps, **options}
        export(path, self.human, self.moved, self.body, ExportOptions(to=self.kind, **given))
        return path

    def free(self) -> dict[str, Any]:
        """For formats that leave axes and units open."""
        return {"up": self.up, "units": self.units}

    def home(self, points: np.ndarray, up: str, units: str) -> np.ndarray:
        """Points of a file in our world, metres."""
        turned = points @ (Y_UP if up == "y" else np.eye(3))
        return turned / SCALE[units]


@pytest.fixture
def case(small_motion: Any, shipped: BodyModel) -> Callable[[int, ExportFormat], Case]:
    return lambda number, kind: Case(number, kind, small_motion, shipped)


def agree(joints: np.ndarray, T: np.ndarray, true: np.ndarray, sampled: Sampled) -> None:
    np.testing.assert_allclose(joints, true, atol=TOLERANCE)
    T_true = sampled.object_motion.T_world_object
    np.testing.assert_allclose(T[:, :3, 3], T_true[:, :3, 3], atol=TOLERANCE)
    np.testing.assert_allclose(T[:, :3, :3], T_true[:, :3, :3], atol=1e-4)


def homogeneous(R: np.ndarray, place: np.ndarray) -> np.ndarray:
    T = np.tile(np.eye(4), (len(R), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = R, place
    return T


@EACH
def test_glb(motions: range, case: Any, true_joints: Any, read_glb: Any, tmp_path: Path) -> None:
    for number in motions:
        one = case(number, ExportFormat.glb)
        reader = read_glb(one.write(tmp_path / "a.glb"))
        true = true_joints(one.sampled)
        frames = len(true)
        np.testing.assert_allclose(reader.times(), np.arange(frames) / one.fps, atol=1e-6)
        world = np.stack([reader.world(n, frames=frames)[:, :3, 3] for n in one.names], axis=1)
        T = reader.world("object", frames=frames)
        placed = homogeneous(Y_UP.T @ T[:, :3, :3], T[:, :3, 3] @ Y_UP)
        agree(world @ Y_UP, placed, true, one.sampled)


@EACH
def test_bvh(motions: range, case: Any, true_joints: Any, tmp_path: Path) -> None:
    for number in motions:
        one = case(number, ExportFormat.bvh)
        path = one.write(tmp_path / "a.bvh", **one.free())
        read = read_bvh(path, metres_per_unit=1.0)
        thing = read_bvh(tmp_path / "a_object.bvh", metres_per_unit=1.0)
        assert read.fps == pytest.approx(one.fps, rel=1e-5)
        joints = read.joints[:, [read.names.index(n.replace(":", "")) for n in one.names]]
        R = thing.rotations[:, 0]
        turned = R if one.up == "z" else Y_UP.T @ R
        place = one.home(thing.joints[:, 0], one.up, one.units)
        agree(
            one.home(joints, one.up, one.units),
            homogeneous(turned, place),
            true_joints(one.sampled),
            one.sampled,
        )


@EACH
def test_bvh_as_bvhio_reads_it(motions: range, case: Any, true_joints: Any, tmp_path: Path) -> None:
    for number in motions:
        one = case(number, ExportFormat.bvh)
        path = one.write(tmp_path / "a.bvh", **one.free())
        true = true_joints(one.sampled)
        root = bvhio.readAsHierarchy(str(path))
        frame = number % len(true)
        root.loadPose(frame)
        at = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root.layout()}
        joints = np.stack([at[name.replace(":", "")] for name in one.names])
        np.testing.assert_allclose(one.home(joints, one.up, one.units), true[frame], atol=TOLERANCE)
        assert root.getKeyframeRange() == (0, len(true) - 1)


@pytest.mark.parametrize("bones", Bones)
def test_only_the_root_of_a_bvh_travels_and_its_offset_is_zero(
    bones: Bones, case: Any, true_joints: Any, tmp_path: Path
) -> None:
    """So it is the same for who adds the two (three.js 0.187) and who takes the position (bvhio)."""
    one = case(0, ExportFormat.bvh)
    path = one.write(tmp_path / "a.bvh", bones=bones, up="z", units="m")
    head, motion = path.read_text().split("MOTION\n")
    assert head.count("Xposition") == 1
    assert head.split("OFFSET ")[1].splitlines()[0].split() == ["0.000000"] * 3
    assert ":" not in head
    pelvis = [float(x) for x in motion.splitlines()[2].split()[:3]]
    np.testing.assert_allclose(pelvis, true_joints(one.sampled)[0, 0], atol=TOLERANCE)


@EACH
def test_usd(motions: range, case: Any, true_joints: Any, tmp_path: Path) -> None:
    for number in motions:
        one = case(number, ExportFormat.usd)
        ending = ("usda", "usdc", "usd", "usdz")[number % 4]
        path = one.write(tmp_path / f"{number}.{ending}", **one.free())
        stage = Usd.Stage.Open(str(path))
        up, units = UsdGeom.GetStageUpAxis(stage).lower(), UsdGeom.GetStageMetersPerUnit(stage)
        assert (up, units) == (one.up, pytest.approx(1 / SCALE[one.units]))
        assert stage.GetTimeCodesPerSecond() == one.fps
        joints, T = usd_poses(stage, len(one.sampled.human.root))
        R = T[:, :3, :3] if up == "z" else Y_UP.T @ T[:, :3, :3]
        placed = homogeneous(R, one.home(T[:, :3, 3], up, one.units))
        names = [n.replace(":", "_") for n in one.names]
        world = np.stack([joints[n] for n in names], axis=1)
        agree(one.home(world, up, one.units), placed, true_joints(one.sampled), one.sampled)


def usd_poses(stage: Usd.Stage, frames: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Joints by name and the object's matrices, as USD itself computes them."""
    root = UsdSkel.Root(stage.GetPrimAtPath("/take/person"))
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/take/person/skeleton")))
    names = [str(path).rsplit("/", 1)[-1] for path in query.GetJointOrder()]
    thing = UsdGeom.Xformable(stage.GetPrimAtPath("/take/object"))
    places, T = [], []
    for frame in range(frames):
        skel = query.ComputeJointSkelTransforms(frame)
        places.append([list(Gf.Matrix4d(m).ExtractTranslation()) for m in skel])
        T.append(np.array(thing.ComputeLocalToWorldTransform(frame)).T)
    world = np.array(places)
    assert stage.GetEndTimeCode() == frames - 1
    return {name: world[:, k] for k, name in enumerate(names)}, np.array(T)


@EACH
def test_csv(motions: range, case: Any, true_joints: Any, tmp_path: Path) -> None:
    for number in motions:
        one = case(number, ExportFormat.csv)
        with one.write(tmp_path / "a.csv", **one.free()).open(newline="") as file:
            header, *rows = csv.reader(file)
        column = dict(zip(header, np.array(rows, float).T, strict=True))

        def point(name: str, column: Any = column, one: Case = one) -> np.ndarray:
            xyz = np.stack([column[f"{name}_{axis}_{one.units}"] for axis in "xyz"], axis=1)
            return one.home(xyz, one.up, one.units)

        q = np.stack([column[f"object_q{k}"] for k in "xyzw"], axis=1)
        R = Rotation.from_quat(q).as_matrix()
        R = R if one.up == "z" else Y_UP.T @ R
        joints = np.stack([point(name) for name in one.names], axis=1)
        agree(joints, homogeneous(R, point("object")), true_joints(one.sampled), one.sampled)
        np.testing.assert_allclose(column["time_s"], np.arange(len(q)) / one.fps, atol=1e-6)
        held = one.sampled.human.hand_contact[:, 1]
        np.testing.assert_array_equal(column["right_hand_contact"], held)


@EACH
def test_amass(
    motions: range, case: Any, true_joints: Any, tmp_path: Path, shipped: BodyModel
) -> None:
    """Posed on our bones by the definition of SMPL's poses: chained axis-angles, y-up template."""
    rest = shipped.rest_joints.double().numpy()
    for number in motions:
        one = case(number, ExportFormat.amass)
        with np.load(one.write(tmp_path / "a.npz", bones=Bones.smplx)) as file:
            data = dict(file)
        assert float(data["mocap_frame_rate"]) == one.fps
        assert data["poses"].shape == (len(data["trans"]), 165)
        assert not data["betas"].any()
        assert str(data["gender"]) == "neutral"
        pose = np.concatenate([data["poses"][:, :66], data["poses"][:, 75:]], axis=1)
        joints = chained(pose.reshape(len(pose), 52, 3), data["trans"], rest)
        R = Rotation.from_quat(data["object_rotation_xyzw"]).as_matrix()
        T = homogeneous(R, data["object_position"])
        agree(joints, T, true_joints(one.sampled), one.sampled)
        parts = [data[k] for k in ("root_orient", "pose_body", "pose_jaw", "pose_eye", "pose_hand")]
        np.testing.assert_array_equal(np.concatenate(parts, axis=1), data["poses"])


def chained(pose: np.ndarray, root: np.ndarray, rest: np.ndarray) -> np.ndarray:
    from omomo_core.skeleton import ALL_PARENTS

    R = Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(*pose.shape, 3)
    out = np.zeros(pose.shape)
    out[:, 0] = root
    for j in range(1, 52):
        p = ALL_PARENTS[j]
        out[:, j] = out[:, p] + R[:, p] @ (rest[j] - rest[p])
        R[:, j] = R[:, p] @ R[:, j]
    return out
