"""Every kind of job that the page orders, to its end by a real worker, and what it makes."""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.jobs.fleet import Fleet
from capture_app.simulator.demo_take import box_mesh, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import simulate
from capture_app.web.site import Site
from ingest.formats import scanner_3d
from ingest.mount_file import load_mount
from ingest.uncertainty import between
from omomo_core.motion import FPS
from render.video import write_video
from tests.capture_app.overlay.taken import LENS, Watched, phone_take, standing
from tests.capture_app.web.talk import BROKEN, problem, upload
from tests.log_writers import write_session
from tests.simulator.scan_log import scan_log, with_pictures
from tests.simulator.scan_model import drawn_model
from tests.simulator.scan_scene import orbit_poses, scan_scene
from tests.simulator.wiggle import Wiggle, wiggle_motion
from tests.simulator.witness import tripod

TAKE = "00000000000000aa"
OVER = ("done", "failed", "cancelled")


@pytest.fixture(scope="module", autouse=True)
def worker(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    fleet = Fleet(site.queue.database_url, 1, log=tmp_path_factory.mktemp("log") / "worker.log")
    fleet.start()
    yield
    fleet.stop()


@pytest.fixture(scope="module")
def take(site: Site) -> str:
    """Id of a result of one second, of a phone that filmed."""
    motion = wiggle_motion("all axes", seconds=14.0, seed=3)
    witness = tripod(distance=1.6, size=(320, 180), distortion=LENS, rate=2.0)
    watched = Watched(motion, standing(len(motion.valid), -0.5), witness)
    made = phone_take(watched, site.library.root / "taken")
    made.folder.rename(site.library.results.place(TAKE))
    return TAKE


@pytest.fixture(scope="module")
def box(client: httpx.Client) -> str:
    mesh = box_mesh()
    mesh_file = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    return upload(client, {"box.ply": mesh_file.export(file_type="ply")}, "object")


def order(client: httpx.Client, **wanted: object) -> dict:
    answer = client.post("/api/jobs", json=wanted)
    assert answer.status_code == 201, answer.text
    return answer.json()


def over(client: httpx.Client, job: str, seconds: float = 120.0) -> dict:
    until = time.monotonic() + seconds
    while (record := client.get(f"/api/jobs/{job}").json())["state"] not in OVER:
        assert time.monotonic() < until, record
        time.sleep(0.1)
    return record


def done(client: httpx.Client, **wanted: object) -> dict:
    record = over(client, order(client, **wanted)["id"])
    assert record["state"] == "done", record["error"]
    assert record["fraction"] == 1.0
    assert all(given["sha256"] for given in record["inputs"])
    return record


def product(client: httpx.Client, record: dict, suffix: str) -> bytes:
    """The file of a job, which the page lists and the result too."""
    file = next(file for file in record["files"] if file["name"].endswith(suffix))
    assert record["download"] == record["files"][0]["href"]
    data = client.get(file["href"]).content
    assert len(data) == file["size"]
    listed = client.get(f"/api/results/{record['result']}").json()["exports"]
    assert file["name"] in [one["name"] for one in listed]
    assert record["made"] is None
    return data


def test_a_video_from_elsewhere(client: httpx.Client, take: str):
    record = done(client, kind="render", result=take, view="top", size=[96, 64])
    assert product(client, record, ".mp4")[4:8] == b"ftyp"


def test_an_export(client: httpx.Client, take: str):
    record = done(client, kind="export", result=take, to="bvh")
    assert product(client, record, ".bvh").startswith(b"HIERARCHY")


@pytest.mark.slow
@pytest.mark.parametrize("what", ["render", "overlay", "export", "resolve"])
def test_a_sample_that_is_not_there_is_refused_when_it_is_asked_for(
    client: httpx.Client, take: str, what: str
):
    more = {"export": {"to": "glb"}, "resolve": {"contacts": {}}}.get(what, {})
    asked = client.post("/api/jobs", json={"kind": what, "result": take, "sample": 9, **more})
    refused = problem(asked, 422)
    assert refused["code"] == "sample-missing"
    assert "There is no sample 9: the result has 1." in refused["what"]


def test_fbx_without_a_blender_is_refused_when_it_is_asked_for(
    client: httpx.Client, take: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("PATH", "")
    asked = client.post("/api/jobs", json={"kind": "export", "result": take, "to": "fbx"})
    assert problem(asked, 422)["code"] == "blender-missing"


def test_a_comparison(client: httpx.Client, take: str):
    record = done(client, kind="compare", results=[take, take])
    assert product(client, record, ".mp4")[4:8] == b"ftyp"


def test_the_person_in_what_the_phone_filmed(client: httpx.Client, take: str):
    record = done(client, kind="overlay", result=take, thing="hidden", opacity=0.5)
    assert product(client, record, ".mp4")[4:8] == b"ftyp"
    assert record["stage"] == "video"


@pytest.fixture(scope="module")
def film(client: httpx.Client, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("film") / "witness.mp4"
    write_video(path, (np.full((180, 320, 3), 90, np.uint8) for _ in range(4)), 4.0)
    return upload(client, {"witness.mp4": path.read_bytes()}, "video")


def test_the_person_in_the_film_of_a_camera_that_stood_there(
    client: httpx.Client, take: str, film: str
):
    witness = tripod(distance=1.6, size=(320, 180))
    numbers = {name: getattr(witness.camera, name) for name in ("fx", "fy", "cx", "cy")}
    camera = {**numbers, "width": 320, "height": 180}
    posed = {**camera, "T_world_camera": witness.T_world_camera.tolist()}
    common = {"kind": "overlay", "result": take, "video": film, "offset": 0.0}
    record = done(client, **common, camera=posed, wipe=True)
    assert product(client, record, ".mp4")[4:8] == b"ftyp"
    refused = over(client, order(client, **common, camera=camera)["id"])
    assert refused["state"] == "failed"
    assert refused["error"]["code"] == "camera-place-needed"
    assert refused["error"]["fix"]
    assert refused["files"] == []


def wiggled(client: httpx.Client, folder: Path, kind: Wiggle) -> tuple[str, str]:
    """Ids of the log of a phone on a box that is turned about, and of what a tracker saw of it."""
    motion = wiggle_motion(kind, seed=1)
    write_recording(simulate(motion, clamped_phone(), seed=1), folder / "log")
    T = motion.T_world_object
    turns = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    rows = np.column_stack([np.arange(len(T)) / FPS, T[:, :3, 3], turns])
    np.savetxt(folder / "poses.csv", rows, delimiter=",", header="t,x,y,z,qx,qy,qz,qw")
    poses = upload(client, {"poses.csv": (folder / "poses.csv").read_bytes()}, "material")
    return upload(client, files_of(folder / "log"), "session"), poses


def test_a_calibration_becomes_a_mount_with_its_report(
    client: httpx.Client, site: Site, box: str, tmp_path: Path
):
    session, poses = wiggled(client, tmp_path, "all axes")
    common = {"kind": "calibrate", "method": "tracker", "name": "clamp", "object": box}
    record = done(client, **common, session=session, poses=poses)
    assert record["made"] == f"mounts/{record['id']}"
    assert record["result"] is None
    told = client.get(f"/api/{record['made']}").json()
    assert (told["name"], told["method"], told["object"]) == ("clamp", "tracker", box)
    assert told["bounds"]["mm"] < 20
    assert told["residuals"]["rms_mm"] < 10
    assert told["free"] == []
    assert told["object_id"].startswith("box")
    assert told["id"] in [one["id"] for one in client.get("/api/mounts").json()]
    mount = load_mount(site.library.shelves["mount"].content(told["id"]))
    step = between(mount.T_phone_object, clamped_phone().T_phone_object)
    assert np.linalg.norm(step[3:]) < 0.02
    assert client.delete(f"/api/{record['made']}").status_code == 204


@pytest.mark.slow
def test_the_clamped_phone_is_found_in_a_scan_and_by_the_mesh_of_its_recording(
    client: httpx.Client, site: Site, tmp_path: Path
):
    scene = scan_scene(4)
    model = drawn_model(scene, orbit_poses(scene, 8), tmp_path, seed=4)
    log, T_arkit_world = scan_log(scene, seed=4)
    filmed = with_pictures(log, scene, tmp_path / "film", (16.0, 17.0, 22.5, 23.5))
    write_session(scanner_3d, filmed, tmp_path / "take")
    session = upload(client, files_of(tmp_path / "take"), "session")
    mesh = trimesh.Trimesh(scene.mesh.vertices, scene.mesh.faces, process=False)
    chair = upload(client, {"chair.ply": mesh.export(file_type="ply")}, "object")
    colmap = {f"sparse/{name}": data for name, data in files_of(model.sparse).items()}
    colmap |= {f"images/{name}": data for name, data in files_of(model.images).items()}
    mesh.apply_transform(T_arkit_world @ scene.T_world_object)
    own = upload(client, {"scan.ply": mesh.export(file_type="ply")}, "material")
    scanned = {
        "method": "scan",
        "model": upload(client, colmap, "material"),
        "model_to_object": np.asarray(model.T_object_model).tolist(),
    }
    for way in (scanned, {"method": "session", "scan": own}):
        common = {"kind": "calibrate", "name": "clamp", "object": chair, "session": session}
        told = client.get(f"/api/{done(client, **common, **way)['made']}").json()
        assert told["method"] == way["method"]
        mount = load_mount(site.library.shelves["mount"].content(told["id"]))
        step = between(mount.T_phone_object, scene.mount.T_phone_object)
        assert np.linalg.norm(step[3:]) < 0.02


def files_of(folder: Path) -> dict[str, bytes]:
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def test_a_calibration_that_cannot_be_says_what_to_do_and_leaves_nothing(
    client: httpx.Client, site: Site, box: str, tmp_path: Path
):
    session, poses = wiggled(client, tmp_path, "translation")
    common = {"kind": "calibrate", "method": "tracker", "name": "clamp", "object": box}
    record = over(client, order(client, **common, session=session, poses=poses)["id"])
    assert record["state"] == "failed"
    assert record["error"]["code"] == "calibration-turns"
    assert record["error"]["fix"]
    folder = site.library.shelves["mount"].folder
    assert list(folder.glob(f"*{record['id']}*")) == []
    assert problem(client.get(f"/api/mounts/{record['id']}"), 404)["code"] == "mount-missing"


def test_what_an_order_says_in_words_is_kept_while_the_job_is_known(
    client: httpx.Client, site: Site, box: str
):
    session = upload(client, BROKEN, "session")
    points = [[0, 0], [175, 0], [175, 245]]
    place = {"points": [{"board_mm": at, "object": [*at, 0.1]} for at in points]}
    common = {"kind": "calibrate", "method": "board", "name": "clamp", "object": box}
    record = order(client, **common, session=session, film=session, board="A4", place=place)
    note = site.library.notes.folder / record["id"] / "place.json"
    assert len(json.loads(note.read_text())["points"]) == 3
    assert {given["role"]: given["path"] for given in record["inputs"]}["place"] == "place.json"
    assert over(client, record["id"])["state"] == "failed"
    assert client.delete(f"/api/jobs/{record['id']}").status_code == 204
    assert not note.parent.exists()


def test_another_apps_mesh_becomes_an_object_with_its_report(client: httpx.Client, site: Site):
    mesh_file = trimesh.creation.box([0.8, 0.4, 0.6]).subdivide()
    mesh_file.apply_translation([3.0, -1.0, 2.0])
    material = upload(client, {"carton.ply": mesh_file.export(file_type="ply")}, "material")
    record = done(client, kind="scan", name="carton", source=material)
    assert record["made"] == f"objects/{record['id']}"
    told = client.get(f"/api/{record['made']}").json()
    np.testing.assert_allclose(told["extents"], [0.8, 0.4, 0.6], atol=1e-3)
    assert told["scan"]["severity"] in ("ok", "warn", "bad")
    assert client.get(f"/api/{record['made']}/scene").status_code == 200
    at = f"/api/{record['made']}/scan"
    missing = problem(client.get(f"{at}/report.html"), 404)
    assert missing["code"] == "scan-missing"
    files = site.library.shelves["object"].folder / record["id"] / "files"
    assert not [path for path in files.rglob("*") if path.name.startswith(".")]


def test_a_job_is_cancelled_and_leaves_nothing(client: httpx.Client, site: Site, take: str):
    record = order(client, kind="render", result=take, view="orbit", size=[640, 360])
    until = time.monotonic() + 60
    while client.get(f"/api/jobs/{record['id']}").json()["state"] == "queued":
        assert time.monotonic() < until
        time.sleep(0.02)
    client.post(f"/api/jobs/{record['id']}/cancel")
    assert over(client, record["id"])["state"] == "cancelled"
    exports = site.library.results.exports(take)
    assert [path.name for path in exports.iterdir() if record["id"] in path.name] == []
