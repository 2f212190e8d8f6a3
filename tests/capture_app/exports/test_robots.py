"""A small humanoid does a person's motion: hands on the object, feet still, limits kept, files read back."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.render import RenderRequest
from capture_app.commands.run import RunRequest
from capture_app.exports.export_sample import export_result
from capture_app.exports.resample import Sampled
from capture_app.pipeline import run_take
from capture_app.rendering import render_result
from capture_app.result import Result, body_of
from capture_app.robots import robot_model
from capture_app.robots.export_robot import export_robot, robot_motion, unreached
from capture_app.robots.robot_model import load_robot
from capture_app.robots.robot_solver import RobotMotion
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.errors import InputError
from omomo_core.motion import FPS

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("mink")

LEG = (("hip_yaw", "0 0 1"), ("hip_roll", "1 0 0"), ("hip_pitch", "0 1 0"))
ARM = (("shoulder_pitch", "0 1 0"), ("shoulder_roll", "1 0 0"), ("shoulder_yaw", "0 0 1"))
HAND = (("wrist_roll", "1 0 0"), ("wrist_pitch", "0 1 0"), ("wrist_yaw", "0 0 1"))


def joints(side: str, some: tuple[tuple[str, str], ...]) -> str:
    return "".join(f'<joint name="{side}_{n}" axis="{axis}" range="-2.6 2.6"/>' for n, axis in some)


def limbs(side: str, y: float) -> tuple[str, str]:
    capsule = '<geom type="capsule" size=".03" fromto="0 0 -.05 0 0 {}"/>'
    leg = f"""<body name="{side}_thigh" pos="0 {y} -.1">{joints(side, LEG)}{capsule.format(-0.25)}
      <body name="{side}_shank" pos="0 0 -.33"><joint name="{side}_knee" axis="0 1 0" range="0 2.6"/>
      {capsule.format(-0.25)}<body name="{side}_foot" pos="0 0 -.33">
      {joints(side, (("ankle_pitch", "0 1 0"), ("ankle_roll", "1 0 0")))}
      <geom type="box" size=".09 .04 .01" pos=".03 0 -.04"/></body></body></body>"""
    arm = f"""<body name="{side}_arm" pos="0 {2 * y} .4">{joints(side, ARM)}{capsule.format(-0.2)}
      <body name="{side}_elbow" pos="0 0 -.26"><joint name="{side}_elbow" axis="0 1 0" range="-2.6 .3"/>
      <geom type="capsule" size=".025" fromto=".05 0 0 .18 0 0"/>
      <body name="{side}_hand" pos=".22 0 0">{joints(side, HAND)}
      <geom type="box" size=".05 .015 .03" pos=".06 0 0"/></body></body></body>"""
    return leg, arm


@pytest.fixture(scope="module")
def humanoid(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The model and the map of a humanoid of 26 joints whose legs are 66 cm long."""
    folder = tmp_path_factory.mktemp("humanoid")
    (left_leg, left_arm), (right_leg, right_arm) = limbs("left", 0.1), limbs("right", -0.1)
    model = folder / "humanoid.xml"
    model.write_text(f"""<mujoco><compiler angle="radian"/><worldbody><body name="hips" pos="0 0 .8">
      <freejoint/><geom type="box" size=".06 .08 .05"/>{left_leg}{right_leg}
      <body name="trunk" pos="0 0 .05"><joint name="waist" axis="0 0 1" range="-2 2"/>
      <joint name="bow" axis="0 1 0" range="-.5 .9"/><geom type="box" size=".07 .1 .2" pos="0 0 .2"/>
      {left_arm}{right_arm}</body></body></worldbody></mujoco>""")
    both = {
        f"{side}_{part}": {"body": f"{side}_{body}", "point": [x, 0, 0]}
        for side in ("left", "right")
        for part, body, x in (("foot", "foot", 0), ("palm", "hand", 0.08), ("elbow", "elbow", 0))
    }
    frames = folder / "frames.json"
    chosen = {"pelvis": {"body": "hips"}, "torso": {"body": "trunk"}, **both, "sole": 0.05}
    chosen |= {"arms": ["left_arm", "right_arm"], "legs": ["left_thigh", "right_thigh"]}
    chosen["stance"] = {f"{s}_knee": 0.5 for s in ("left", "right")}
    frames.write_text(json.dumps(chosen))
    return model, frames


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The demonstration take."""
    request = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=tmp_path_factory.mktemp("demo") / "result",
        samples=1,
        steps=5,
        video_size=None,
    )
    return run_take(request)


def check_limits(motion: RobotMotion, fps: float) -> None:
    low, high = motion.robot.model.jnt_range[1:].T
    assert (motion.qpos[:, 7:] >= low - 1e-9).all()
    assert (motion.qpos[:, 7:] <= high + 1e-9).all()
    assert np.abs(np.diff(motion.qpos[:, 7:], axis=0)).max() * fps <= 12.0 + 1e-6
    assert motion.apart.min() > 0.0
    assert motion.planted_speed.max() < 1e-3


def test_hands_stay_on_the_object_and_feet_on_the_floor(
    result: Result, humanoid: tuple[Path, Path]
) -> None:
    sampled = Sampled(result.best, result.object_motion, FPS)
    motion = robot_motion(*humanoid, sampled, body_of(result))
    check_limits(motion, FPS)
    assert np.percentile(motion.miss[motion.targets.held], 95) < 0.015
    # Another reading of the joints: MuJoCo's own on the model as the file has it.
    model = mujoco.MjModel.from_xml_path(str(humanoid[0]))
    data = mujoco.MjData(model)
    frame = int(np.flatnonzero(motion.targets.held.all(axis=1))[20])
    data.qpos[:] = motion.qpos[frame]
    mujoco.mj_forward(model, data)
    hand = data.body("left_hand")
    palm = hand.xpos + hand.xmat.reshape(3, 3) @ [0.08, 0.0, 0.0]
    assert np.linalg.norm(palm - result.best.joints[frame, 22]) < 0.015


def test_files_say_the_same(result: Result, humanoid: tuple[Path, Path], tmp_path: Path) -> None:
    pytest.importorskip("coacd")
    model, frames = humanoid
    request = ExportRequest(
        result=result.folder,
        output=tmp_path / "out",
        to=ExportFormat.robot,
        robot=model,
        frames=frames,
        fps=50,
    )
    files = {path.name: path for path in export_robot(request).files}
    about = json.loads(files["qpos.json"].read_text())
    with files["qpos.csv"].open() as file:
        table = np.array([[float(x) for x in row] for row in csv.reader(file)])
    arrays = np.load(files["qpos_with_object.npz"])
    names = list(arrays["joint_names"])
    assert about["columns"][7:] == names
    assert (about["fps"], float(arrays["fps"])) == (50, 50)
    assert len(table) == len(arrays["qpos"]) == pytest.approx(len(result.best.root) * 5 / 3, abs=2)
    assert table[:, 7:] == pytest.approx(arrays["qpos"][:, 7:-7], abs=1e-6)
    turns = Rotation.from_quat(table[:, 3:7]).as_matrix()
    theirs = Rotation.from_quat(np.roll(arrays["qpos"][:, 3:7], -1, axis=1)).as_matrix()
    assert turns == pytest.approx(theirs, abs=1e-5)
    place = result.object_motion.T_world_object[0, :3, 3]
    assert arrays["qpos"][0, -7:-4] == pytest.approx(place, abs=1e-6)


def test_the_scene_opens_and_plays(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path
) -> None:
    pytest.importorskip("coacd")
    request = ExportRequest(
        result=result.folder, output=tmp_path / "out", robot=humanoid[0], frames=humanoid[1]
    )
    export_robot(request)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out/scene/scene.xml"))
    data = mujoco.MjData(model)
    arrays = np.load(tmp_path / "out/qpos_with_object.npz")
    assert model.nq == arrays["qpos"].shape[1]
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert data.qpos == pytest.approx(arrays["qpos"][0], abs=1e-5)
    for _ in range(5):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    vertices = result.object_motion.mesh.vertices
    volume = np.prod(np.ptp(vertices, axis=0))
    assert model.body("object").mass[0] == pytest.approx(200 * volume, rel=0.1)


def test_it_is_drawn(result: Result, humanoid: tuple[Path, Path], tmp_path: Path) -> None:
    file = tmp_path / "robot.png"
    request = RenderRequest(
        result=result.folder,
        output=file,
        robot=humanoid[0],
        frames=humanoid[1],
        still=2.0,
        size=(160, 120),
    )
    render_result(request)
    assert file.stat().st_size > 1000


def test_what_it_cannot_reach_is_said(result: Result, humanoid: tuple[Path, Path]) -> None:
    """The object is lifted a metre higher: nobody of that size holds it."""
    T = result.object_motion.T_world_object.copy()
    best = result.best
    joints = best.joints.copy()
    joints[:, 22:, 2] += 1.0 * best.hand_contact
    lifted = Sampled(
        replace(best, joints=joints), replace(result.object_motion, T_world_object=T), FPS
    )
    motion = robot_motion(*humanoid, lifted, body_of(result))
    check_limits(motion, FPS)
    notes = list(unreached(motion))
    assert any("left palm" in note for note in notes)
    assert all("robot cannot reach it" in note for note in notes)


@pytest.mark.parametrize(
    ("said", "code"),
    [
        ({}, "robot-needed"),
        ({"robot": "nowhere.xml"}, "robot-missing"),
        ({"robot": "broken.xml"}, "robot-unreadable"),
        ({"robot": "humanoid.xml"}, "robot-unknown"),
        ({"robot": "humanoid.xml", "frames": "nowhere.json"}, "robot-frames"),
        ({"robot": "humanoid.xml", "frames": "broken.json"}, "robot-frames"),
        ({"robot": "humanoid.xml", "frames": "other.json"}, "robot-unmapped"),
    ],
)
def test_what_is_wrong_is_named(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path, said: dict[str, str], code: str
) -> None:
    (tmp_path / "humanoid.xml").write_text(humanoid[0].read_text())
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody><body")
    (tmp_path / "broken.json").write_text('{"pelvis": 3}')
    (tmp_path / "other.json").write_text(humanoid[1].read_text().replace("hips", "pelvis"))
    given = {name: tmp_path / file for name, file in said.items()}
    request = ExportRequest(
        result=result.folder, output=tmp_path / "out", to=ExportFormat.robot, **given
    )
    with pytest.raises(InputError) as caught:
        export_robot(request)
    assert caught.value.code == code
    assert not (tmp_path / "out").exists()


def test_a_missing_extra_is_named(
    humanoid: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(robot_model, "import_module", absent)
    with pytest.raises(InputError, match="extra"):
        load_robot(*humanoid)


def test_urdf_is_read_too(tmp_path: Path) -> None:
    """A URDF has no free root: it gets one."""
    link = "<link name='{}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
    link += "ixz='0' iyz='0'/></inertial></link>"
    parts = [f"{s}_{p}" for s in ("left", "right") for p in ("leg", "foot", "arm", "hand")]
    hung = {"leg": "hips", "arm": "hips", "foot": "leg", "hand": "arm"}
    text = "<robot name='r'>" + link.format("hips") + "".join(link.format(p) for p in parts)
    for part in parts:
        side, kind = part.split("_")
        above = hung[kind] if hung[kind] == "hips" else f"{side}_{hung[kind]}"
        text += (
            f"<joint name='{part}' type='revolute'><parent link='{above}'/><child link='{part}'/>"
        )
        text += "<origin xyz='0 0 -.3'/><axis xyz='0 1 0'/><limit lower='-1' upper='1'/></joint>"
    (tmp_path / "r.urdf").write_text(text + "</robot>")
    named = {"pelvis": "hips", "torso": "hips"}
    for side in ("left", "right"):
        named |= {f"{side}_foot": f"{side}_foot", f"{side}_palm": f"{side}_hand"}
        named[f"{side}_elbow"] = f"{side}_arm"
    chosen = {name: {"body": body} for name, body in named.items()} | {"sole": 0.0}
    chosen |= {"arms": ["left_arm", "right_arm"], "legs": ["left_leg", "right_leg"]}
    (tmp_path / "frames.json").write_text(json.dumps(chosen))
    robot = load_robot(tmp_path / "r.urdf", tmp_path / "frames.json")
    assert robot.model.nq == 7 + len(parts)
    assert set(robot.joints) == set(parts)


def test_amass_says_where_the_object_is_and_what_touches(result: Result, tmp_path: Path) -> None:
    file = tmp_path / "person.npz"
    export_result(ExportRequest(result=result.folder, output=file, to=ExportFormat.amass))
    arrays, moved = np.load(file), result.object_motion
    name = moved.mesh.name
    turns = Rotation.from_quat(np.roll(arrays[f"{name}_quat"], -1, axis=1)).as_matrix()
    assert turns == pytest.approx(moved.T_world_object[:, :3, :3], abs=1e-5)
    assert arrays[f"{name}_pos"] == pytest.approx(moved.T_world_object[:, :3, 3], abs=1e-5)
    assert (arrays["hand_contact"] == (result.best.hand_contact > 0.5)).all()


def test_other_formats_stay_files(result: Result, tmp_path: Path) -> None:
    request = ExportRequest(result=result.folder, output=tmp_path, to=ExportFormat.robot)
    with pytest.raises(InputError, match="folder"):
        export_result(request)


def test_on_the_command_line(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(result.folder), "--to", "robot", "-o", str(tmp_path / "out")]
    assert invoke(words) == 2
    assert "--robot" in capsys.readouterr().err


@pytest.mark.slow
def test_unitree_g1_keeps_to_the_demo(result: Result, shared: Path) -> None:
    robot = shared / "data/robots/unitree_g1/g1_29dof.xml"
    motion = robot_motion(
        robot, None, Sampled(result.best, result.object_motion, FPS), body_of(result)
    )
    check_limits(motion, FPS)
    assert np.percentile(motion.miss[motion.targets.held], 95) < 0.015
