"""A small humanoid does a person's motion: hands on the object, feet still, limits kept, files read back."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.render import RenderRequest
from capture_app.exports.export_sample import export_result
from capture_app.exports.resample import Sampled
from capture_app.rendering import render_result
from capture_app.result import Result, body_of
from capture_app.robots import robot_files, robot_model
from capture_app.robots.export_robot import export_robot, unreached
from capture_app.robots.robot_files import scene_of
from capture_app.robots.robot_model import load_robot
from capture_app.robots.robot_solver import RobotMotion, robot_motion
from omomo_core.errors import InputError
from omomo_core.motion import FPS

mujoco = pytest.importorskip("mujoco")
pytest.importorskip("mink")


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
    motion = robot_motion(load_robot(*humanoid), sampled, body_of(result))
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
    motion = robot_motion(load_robot(*humanoid), lifted, body_of(result))
    check_limits(motion, FPS)
    notes = list(unreached(motion))
    assert any("left palm" in note for note in notes)
    assert all("robot cannot reach it" in note for note in notes)


def test_a_foot_that_slides_is_said(result: Result, humanoid: tuple[Path, Path]) -> None:
    sampled = Sampled(result.best, result.object_motion, FPS)
    motion = robot_motion(load_robot(*humanoid), sampled, body_of(result))
    assert not any("slides" in note for note in unreached(motion))
    frame = int(np.flatnonzero(motion.targets.planted[:-1, 0] & motion.targets.planted[1:, 0])[0])
    ankles = motion.ankles.copy()
    ankles[frame + 1 :, 0] += [0.01, 0.0, 0.0]
    (note,) = (n for n in unreached(replace(motion, ankles=ankles)) if "slides" in n)
    assert note.startswith(f"From {frame / FPS:.2f} to {(frame + 1) / FPS:.2f} s a foot")
    assert "0.30 m/s" in note


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
    given: dict[str, Any] = {name: tmp_path / file for name, file in said.items()}
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
    model, frames = map(str, humanoid)
    assert invoke([*words, "--robot", model, "--frames", frames, "--fps", "24"]) == 0
    assert (tmp_path / "out" / "scene" / "scene.xml").is_file()
    picture = tmp_path / "robot.png"
    drawn = ["render", str(result.folder), "--robot", model, "--frames", frames, "--still", "2"]
    assert invoke([*drawn, "--size", "160x120", "-o", str(picture)]) == 0
    assert picture.stat().st_size > 1000


PLANE = '<geom name="floor" type="plane" size="0 0 1"/>'
HANDS = """<asset><mesh name="l" file="l/hand.stl"/><mesh name="r" file="r/hand.stl"/></asset><worldbody>
  <geom type="mesh" mesh="l"/><geom type="mesh" mesh="r"/></worldbody>"""
LOOKS = """<asset><texture name="a" type="2d" file="a.png"/><texture name="b" type="cube" fileleft="a.png"/>
  <hfield name="h" file="a.png" size="1 1 1 1"/><material name="a" texture="a"/></asset>
  <worldbody><geom type="hfield" hfield="h" pos="9 9 0" material="a"/></worldbody>"""
OBJECT = """<asset><mesh name="object_0" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>
  <body name="object"><geom name="object_0" type="mesh" mesh="object_0"/></body></worldbody>"""


def scene_with(
    result: Result, humanoid: tuple[Path, Path], folder: Path, inside: str, compiler: str = ""
) -> Any:
    """Write a robot with more in it and its scene, remove the robot, and read the scene."""
    home, made = folder / "robot", folder / "made"
    for side, size in (("l", 0.1), ("r", 0.2)):
        (home / side).mkdir(parents=True)
        trimesh.creation.box(extents=[size] * 3).export(home / side / "hand.stl")
    shutil.copyfile(home / "l/hand.stl", home / "hand.stl")
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save(home / "a.png")
    text = humanoid[0].read_text().replace('"radian"', f'"radian" {compiler}')
    (home / "robot.xml").write_text(text.replace("</mujoco>", inside + "</mujoco>"))
    made.mkdir()
    spec = scene_of(made, load_robot(home / "robot.xml", humanoid[1]), result.object_motion.mesh)
    spec.add_key(name="start", qpos=np.zeros(spec.compile().nq))
    (made / "scene/scene.xml").write_text(spec.to_xml())
    shutil.rmtree(home)
    return mujoco.MjModel.from_xml_path(str(made / "scene/scene.xml"))


@pytest.mark.parametrize("taken", [f"<worldbody>{PLANE}</worldbody>", OBJECT, "KEY"])
def test_a_scene_takes_names_that_are_free(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path, taken: str
) -> None:
    pytest.importorskip("coacd")
    qpos = " ".join(map(str, load_robot(*humanoid).standing))
    inside = taken.replace("KEY", f'<keyframe><key name="start" qpos="{qpos}"/></keyframe>')
    model = scene_with(result, humanoid, tmp_path, inside)
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1
    assert (model.nkey, model.nq) == (1, load_robot(*humanoid).model.nq + 7)
    name = "omocap_object" if taken == OBJECT else "object"
    assert model.body(name).mass[0] > 0.0


@pytest.mark.parametrize(
    ("inside", "compiler", "sizes"),
    [(HANDS, "", [0.05, 0.1]), (HANDS, 'strippath="true"', [0.05, 0.05]), (LOOKS, "", [])],
)
def test_a_scene_holds_all_files_that_it_needs(
    result: Result,
    humanoid: tuple[Path, Path],
    tmp_path: Path,
    inside: str,
    compiler: str,
    sizes: list[float],
) -> None:
    pytest.importorskip("coacd")
    model = scene_with(result, humanoid, tmp_path, inside, compiler)
    assert (model.ntex, model.nhfield) == ((0, 0) if sizes else (2, 1))
    found = [np.abs(model.geom_aabb[model.geom_dataid == k, 3]).max() for k in range(len(sizes))]
    assert found == pytest.approx(sizes)


def test_a_robots_defaults_are_not_the_objects(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path
) -> None:
    pytest.importorskip("coacd")
    inside = """<default><mesh scale=".001 .001 .001"/>
      <geom contype="0" conaffinity="0" friction="0 0 0"/></default>"""
    model = scene_with(result, humanoid, tmp_path, inside)
    volume = np.prod(np.ptp(result.object_motion.mesh.vertices, axis=0))
    assert model.body("object").mass[0] == pytest.approx(200 * volume, rel=0.1)
    for name in ("floor", "object_0"):
        geom = model.geom(name)
        assert (geom.contype[0], geom.conaffinity[0], geom.friction[0]) == (1, 1, 1.0)


def test_a_scene_that_cannot_be_made_is_said_before_the_motion_is_solved(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    pytest.importorskip("coacd")
    monkeypatch.setattr(robot_files, "_copy_assets", full)
    monkeypatch.setattr("capture_app.robots.export_robot.solved_result", None)
    output = tmp_path / "out"
    request = ExportRequest(
        result=result.folder, output=output, robot=humanoid[0], frames=humanoid[1]
    )
    with pytest.raises(InputError, match="No space left") as caught:
        export_robot(request)
    assert (caught.value.code, list(tmp_path.iterdir())) == ("robot-scene", [])


def test_the_easy_stance_is_within_the_ranges(humanoid: tuple[Path, Path], tmp_path: Path) -> None:
    model = tmp_path / "bent.xml"
    model.write_text(humanoid[0].read_text().replace('range="-.5 .9"', 'range=".2 .9"'))
    robot = load_robot(model, humanoid[1])
    assert robot.standing[7 + robot.joints.index("bow")] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"stance": {"left_knee": -0.5}}, "from 0.000 to 2.600"),
        ({"stance": {"root": 0.5}}, "root"),
        ({"pelvis": {"body": "hips", "forward": [0, 0, 0]}}, "right angle"),
        ({"pelvis": {"body": "hips", "forward": [0, 0.1, 1]}}, "right angle"),
        ({"pelvis": {"body": "hips", "point": [0, float("nan"), 0]}}, "pelvis.point.1: .*finite"),
        ({"sole": float("nan")}, "sole: .*finite"),
        (None, "is a directory"),
    ],
)
def test_a_map_that_makes_no_sense_is_refused(
    humanoid: tuple[Path, Path], tmp_path: Path, changed: dict[str, Any] | None, words: str
) -> None:
    model, frames = tmp_path / "named.xml", tmp_path / "map.json"
    model.write_text(humanoid[0].read_text().replace("<freejoint/>", '<freejoint name="root"/>'))
    if changed is None:
        frames.mkdir()
    else:
        frames.write_text(json.dumps(json.loads(humanoid[1].read_text()) | changed))
    with pytest.raises(InputError, match=words) as caught:
        load_robot(model, frames)
    assert (caught.value.code, caught.value.where) == ("robot-frames", str(frames))


@pytest.mark.parametrize("kind", ["file", "folder of a robot"])
def test_what_is_there_is_neither_replaced_nor_added_to(
    result: Result, humanoid: tuple[Path, Path], tmp_path: Path, kind: str
) -> None:
    output = tmp_path / "out"
    if kind == "file":
        output.write_text("mine")
    else:
        output.mkdir()
        (output / "qpos_with_object.npz").touch()
    request = ExportRequest(
        result=result.folder, output=output, robot=humanoid[0], frames=humanoid[1]
    )
    with pytest.raises(InputError, match="another name") as caught:
        export_robot(request)
    assert (caught.value.code, caught.value.where) == ("output-exists", str(output))
    assert "replace›" not in caught.value.fix


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["--to", "glb", "--robot", "g1.xml"], "--robot"),
        (["--frames", "map.json", "-o", "a.bvh"], "--frames"),
        (["--to", "robot", "--bones", "unreal"], "--bones"),
        (["--to", "robot", "--skeleton", "a.bvh"], "--skeleton"),
        (["--robot", "g1.xml", "--units", "cm"], "--units"),
        (["--robot", "g1.xml", "--up", "y"], "--up"),
        (["--to", "robot", "--blender", "blender"], "--blender"),
    ],
)
def test_options_of_another_format_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], option: str
) -> None:
    assert invoke(["export", str(tmp_path), *words]) == 2
    said = capsys.readouterr().err
    assert option in said
    assert "option-unused" in said


@pytest.mark.slow
def test_unitree_g1_keeps_to_the_demo(result: Result, shared: Path) -> None:
    robot = load_robot(shared / "data/robots/unitree_g1/g1_29dof.xml")
    sampled = Sampled(result.best, result.object_motion, FPS)
    motion = robot_motion(robot, sampled, body_of(result))
    check_limits(motion, FPS)
    assert np.percentile(motion.miss[motion.targets.held], 95) < 0.015
