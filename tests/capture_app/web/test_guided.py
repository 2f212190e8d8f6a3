"""What guides through a calibration, and the pictures by which things are known."""

import json
import struct
import time

import httpx
import pytest
import trimesh

from capture_app.web.site import Site
from tests.capture_app.web.talk import BROKEN, problem, upload


@pytest.fixture(scope="module")
def example(client: httpx.Client) -> dict[str, str]:
    return client.post("/api/example").json()


def test_each_way_says_what_to_do(client: httpx.Client):
    told = client.get("/api/calibration").json()
    for way in ("board", "filmed", "meshed", "scan", "tracker"):
        steps = told["ways"][way]["steps"]
        assert sum(map(len, steps.values())) >= 3, way
    assert told["boards"]["A4"]["width_mm"] == 175
    assert told["boards"]["A4"]["text"] == "5x7:35mm:26mm:DICT_5X5_100"


def test_what_is_to_be_printed(client: httpx.Client):
    sheet = client.get("/api/calibration/board.pdf", params={"paper": "Letter"})
    assert sheet.content.startswith(b"%PDF")
    assert sheet.headers["content-disposition"].startswith("attachment")
    paper = client.get("/api/calibration/board.pdf", params={"paper": "../x"})
    assert problem(paper, 422)["code"] == "paper-unknown"


def test_a_look_says_what_is_good_or_what_to_do(client: httpx.Client, example: dict[str, str]):
    at = "/api/calibration/look"
    seen = client.get(at, params={"of": "turned", "id": example["session"]}).json()
    assert "poses a second" in seen["good"]
    blank = upload(client, {"poses.csv": b"nothing\n"}, "material")
    refused = problem(client.get(at, params={"of": "poses", "id": blank}), 422)
    assert refused["fix"]
    filmed = client.get(at, params={"of": "film", "id": example["session"]})
    assert problem(filmed, 422)["code"] == "board-needed"
    gone = client.get(at, params={"of": "turned", "id": "f" * 16})
    assert problem(gone, 404)["code"] == "session-missing"


def drawn(client: httpx.Client, address: str, seconds: float = 120.0) -> httpx.Response:
    """A picture, once it is drawn."""
    until = time.monotonic() + seconds
    while (answer := client.get(address)).status_code == 404:
        assert problem(answer, 404)["code"] == "picture-later"
        assert time.monotonic() < until
        time.sleep(0.2)
    return answer


def test_objects_and_mounts_have_pictures(client: httpx.Client, example: dict[str, str]):
    for kind in ("object", "mount"):
        picture = drawn(client, f"/api/{kind}s/{example[kind]}/picture")
        assert picture.headers["content-type"] == "image/webp"
        assert picture.content[8:12] == b"WEBP"
        assert 300 < len(picture.content) < 40_000
    mount = client.post("/api/mounts", json={"method": "identity", "name": "the phone"}).json()
    for what in ("picture", "scene"):
        answer = client.get(f"/api/mounts/{mount['id']}/{what}")
        assert problem(answer, 404)["code"] == "mount-object"


def test_a_mount_is_shown_on_its_object(client: httpx.Client, example: dict[str, str]):
    pack = client.get(f"/api/mounts/{example['mount']}/scene").content
    header = json.loads(pack[4 : 4 + struct.unpack("<I", pack[:4])[0]])
    assert header["kind"] == "object"
    assert {"object_vertices", "phone_position", "phone_rotation"} <= set(header["arrays"])


def test_an_object_that_was_brought_has_no_scan(client: httpx.Client, site: Site):
    mesh = trimesh.creation.box((0.3, 0.3, 0.3)).export(file_type="ply")
    object_ = upload(client, {"box.ply": mesh}, "object")
    for name in ("report.html", "views.png", "outline.png"):
        answer = client.get(f"/api/objects/{object_}/scan/{name}")
        assert problem(answer, 404)["code"] == "scan-missing"
    order = {"kind": "calibrate", "method": "scan", "name": "clamp", "object": object_}
    session = upload(client, BROKEN, "session")
    refused = client.post("/api/jobs", json={**order, "session": session})
    assert problem(refused, 404)["code"] == "scan-missing"
    assert list(site.library.notes.folder.iterdir()) == []
