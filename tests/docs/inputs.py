"""What the commands of each page are given: files under the names that the page uses."""

import json
import shutil
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import DEMO, carried_box, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import PhoneNoise, simulate
from ingest.calibration.board.board_spec import PRESETS
from ingest.formats import scanner_3d
from omomo_core.learning.recordings.clips import save_clips
from omomo_core.motion import ObjectMotion
from tests.capture_app.comparison.conftest import carrying, put_result
from tests.capture_app.test_cli_data import clip as still_clip
from tests.core.marker_files import capture, moving, write_places, write_vicon
from tests.docs.pages import blocks
from tests.docs.running import PYTHON, Stage, copy
from tests.ingest.animated.conftest import GlbWriter
from tests.ingest.calibration.board.filmed import picture, write_film
from tests.ingest.scan.test_scan_ready_mesh import write_usdz
from tests.log_writers import write_session
from tests.simulator.scan_camera import FilmErrors
from tests.simulator.scan_film import film_session
from tests.simulator.scan_log import scan_log, with_pictures
from tests.simulator.scan_model import drawn_model
from tests.simulator.scan_scene import orbit_poses, scan_scene
from tests.simulator.wiggle import wiggle_motion
from tests.simulator.witness import board_on_box, tripod
from tests.textured_room import room, write_room, write_room_of


@dataclass(frozen=True)
class Given:
    """Where a page's commands are typed, and what may be put there."""

    place: Path
    motion: Path
    """A finished result folder."""
    write_clip: Callable[[str, Path], None]
    """Writes a recorded clip of a name, and its mesh, into a folder."""
    shared: Callable[[], Path]
    """Third-party data; the page is skipped where that is not there."""


def a_take(place: Path, name: str = "take") -> None:
    """A session, the object and the mount of the take that comes with the program."""
    copy(DEMO / "session", place / name)
    copy(DEMO / "box.obj", place / "chair.obj")
    copy(DEMO / "mount.json", place / "mount.json")


def a_motion(given: Given) -> Stage:
    copy(given.motion, given.place / "chair_motion")
    return Stage()


def batch(given: Given) -> Stage:
    a_take(given.place, "takes/monday")
    (given.place / "mount.json").rename(given.place / "chair_mount.json")
    return Stage()


def blender(given: Given) -> Stage:
    """What Blender would export: a box that is lifted, carried and put down again."""
    glb = GlbWriter()
    chair = glb.node("Chair", mesh=0)
    times = np.linspace(0.0, 5.0, 51)
    s = np.clip((times - 1) / 3, 0, 1)
    way = s * s * (3 - 2 * s)
    up = 0.3 + 0.4 * np.sin(np.pi * way) ** 2
    glb.move(chair, "translation", times, np.stack([0.8 * way, up, 0 * way], axis=1))
    glb.write(given.place / "chair.glb")
    return Stage()


def recording(given: Given) -> Stage:
    a_take(given.place, "SESSION")
    return Stage()


def replay(given: Given) -> Stage:
    a_take(given.place)
    for name in ("chair_motion", "mop_motion"):
        copy(given.motion, given.place / name)
    return Stage()


def comparing(given: Given) -> Stage:
    """Motions of a take, short ones; the recorded person; two methods; and people who answer."""
    one, other = (carrying(size=0.55, aside=aside, frames=34) for aside in (0.0, 0.05))
    put_result(given.place / "chair_motion", one, other)
    for name in ("other_motion", "baseline/lift"):
        put_result(given.place / name, other)
    for name in ("ours/lift", "recorded/lift"):
        put_result(given.place / name, one)
    given.write_clip("sub2_woodchair_008", given.place / "clips")
    return Stage(before={2: f"{PYTHON} -m tests.docs.votes study votes"})


def evaluation(given: Given) -> Stage:
    given.write_clip("sub16_box_001", given.place / "DIR")
    copy(given.place / "DIR", given.place / "CLIPS")
    return Stage()


def _mocap(given: Given) -> None:
    """A few recordings of people who walk and stand, from the third-party data."""
    copy(given.shared() / "data" / "mocap" / "cmu_bvh" / "02", given.place / "MOCAP" / "02")


def data(given: Given) -> Stage:
    """Recorded people, clips to look at, and an object that was captured with markers."""
    _mocap(given)
    (given.place / "data").mkdir()
    save_clips(given.place / "data" / "clips_00000.npz", [still_clip(0)])
    box = trimesh.creation.box((40.0, 30.0, 50.0))
    box.export(given.place / "MESH.obj")
    drawn, corners = capture(np.random.default_rng(0), seconds=2.0), np.asarray(box.vertices)
    T = moving(drawn.times, drawn.turn)
    T[:, 2, 3] += 0.5
    seen = corners[[0, 1, 2, 4, 7]]
    points = seen * 0.0123 @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    write_vicon(given.place / "TRACKS.csv", replace(drawn, points=points, places=seen, T=T))
    write_places(given.place / "PLACES.csv", seen)
    return Stage()


def training(given: Given) -> Stage:
    _mocap(given)
    a_take(given.place, "SESSION")
    return Stage()


def corrected(given: Given) -> Stage:
    """A motion, in whose contacts a hand was made to hold a little later."""
    a_motion(given)
    file = given.place / "chair_motion" / "contacts.json"
    contacts = json.loads(file.read_text())
    contacts["segments"][0]["start"] += 6
    file.write_text(json.dumps(contacts))
    return Stage()


def turned(place: Path) -> ObjectMotion:
    """A phone that is turned about with its box, and a tracker's log of the box."""
    motion = wiggle_motion("all axes", seconds=12.0, seed=3)
    log = simulate(motion, clamped_phone(), seed=1, noise=replace(PhoneNoise(), drift=0.0))
    write_recording(log, place / "TURNED")
    T = motion.T_world_object
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    rows = np.column_stack([np.arange(len(T)) / 30, T[:, :3, 3], quaternions])
    np.savetxt(place / "poses.txt", rows, fmt="%.6f")
    return motion


def calibration(given: Given) -> Stage:
    """A box that is turned before a second camera, and a chair that was filmed, then clamped to."""
    place = given.place
    motion, board = turned(place), PRESETS["A4"]
    (told,) = [block for block in blocks("docs/calibration.md") if block.language == "json"]
    (place / "place.json").write_text(told.text)
    witness = tripod(distance=0.8, size=(640, 480), rate=4.0)
    seen = witness.board_poses(motion, board_on_box(board))
    stamps = [round(1000 * time) for time in witness.times(motion)]
    pictures = [picture(pose, board, witness.camera) for pose in seen]
    write_film(place / "film.mp4", pictures, stamps)
    _filmed_and_clamped(place)
    return Stage()


def _filmed_and_clamped(place: Path) -> None:
    """One recording of a chair, its scan, and a COLMAP model of the same room."""
    scene = scan_scene(4)
    model = drawn_model(scene, orbit_poses(scene, 8), place / "drawn", seed=4)
    model.sparse.rename(place / "drawn" / "0")
    copy(place / "drawn" / "0", place / "sparse" / "0")
    copy(model.images, place / "pictures")
    log, T_arkit_world = scan_log(scene, seed=4)
    filmed = with_pictures(log, scene, place / "drawn" / "film", (16.0, 17.0, 22.5, 23.5))
    write_session(scanner_3d, filmed, place / "FILMED")
    solid = trimesh.Trimesh(scene.mesh.vertices, scene.mesh.faces, process=False)
    solid.export(place / "chair.obj")
    solid.apply_transform(T_arkit_world @ scene.T_world_object)
    solid.export(place / "scan.obj")
    np.savetxt(place / "model_to_chair.txt", model.T_object_model)


def scan(given: Given) -> Stage:
    """A thing filmed all around, the phone clamped to it, and a take; and a mesh of another app."""
    place, scene = given.place, scan_scene(21, "box")
    errors = FilmErrors(jolts=0.0)
    film = film_session(
        scene, place / "chair_film", count=24, width=480, seed=3, errors=errors, depth=True
    )
    copy(film.path, place / "recording")
    write_room_of(film, place / "recording")
    write_room(place / "living_room.glb", room())
    log, _ = scan_log(scene, seed=4)
    seconds = (16.0, 17.0, 22.5, 23.5)
    write_session(
        scanner_3d, with_pictures(log, scene, place / "drawn", seconds), place / "clamped"
    )
    carried = carried_box()
    T = carried.T_world_object.copy()
    T[:, :3, 3] -= T[:, :3, 2] * T[0, 2, 3]
    write_recording(
        simulate(replace(carried, T_world_object=T), scene.mount, seed=2), place / "take"
    )
    write_usdz(place, {"chair": (0.0, 0.0, 0.0)}, metres=0.01).rename(place / "chair.usdz")
    return Stage()


def garden_chair(given: Given) -> Stage:
    """The real film of a garden chair; one of its pictures as the clamped phone's look; and a take."""
    film, place = given.shared() / "data" / "scan" / "chair_3d_scanner_app", given.place
    copy(film, place / "garden_chair")
    (place / "clamped").mkdir()
    record = json.loads((film / "frame_00030.json").read_bytes())
    rng, start, pose = np.random.default_rng(0), record["time"], record["cameraPoseARFrame"]
    for number in range(20):
        # Held still: to 0.2 mm, as a phone's log says where it is.
        moved = np.array(pose)
        moved[[3, 7, 11]] += rng.normal(0, 0.0002, 3)
        record |= {"time": start + number / 10, "frame_index": number}
        record["cameraPoseARFrame"] = moved.tolist()
        (place / "clamped" / f"frame_{number:05d}.json").write_text(json.dumps(record))
    for number in (0, 10):
        copy(film / "frame_00030.jpg", place / "clamped" / f"frame_{number:05d}.jpg")
    copy(film / "info.json", place / "clamped" / "info.json")
    return Stage(
        before={2: f"{PYTHON} -m tests.docs.carried_chair chair.glb mount.json take"},
        seconds=1200.0,
    )


def serve(given: Given) -> Stage:
    """A server on a free port, and what is brought to it."""
    place = given.place
    turned(place)
    shutil.make_archive(str(place / "turned"), "zip", place / "TURNED")
    copy(DEMO / "box.obj", place / "chair.obj")
    shutil.make_archive(str(place / "chair_film"), "zip", DEMO / "session")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    start = f"{PYTHON} -c 'from capture_app.cli.start import main; main()' serve --no-browser"
    begin = (
        f"{start} --library served --port {port} > served.txt & SERVER=$!",
        "trap 'kill $SERVER; wait $SERVER || true' EXIT",
        f"until curl -sf http://127.0.0.1:{port}/api/health; do sleep 0.3; done",
    )
    return Stage({2: "\n".join(begin)}, {"http://127.0.0.1:8765": f"http://127.0.0.1:{port}"})


def unreal(given: Given) -> Stage:
    """A character with Manny's bones: the person that the page has just exported."""
    a_motion(given)
    return Stage(before={1: "cp chair.glb SKM_Manny.glb"})
