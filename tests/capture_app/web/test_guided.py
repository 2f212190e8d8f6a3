"""What guides through a calibration, and the pictures by which things are known."""

import io
import json
import struct
import time

import httpx
import pytest
import trimesh
from PIL import Image

from capture_app.web.site import Site
from tests.capture_app.web.talk import BROKEN, problem, upload


@pytest.fixture(scope="module")
def example(client: httpx.Client) -> dict[str, str]:
    return client.post("/api/example").json()


def test_each_way_says_what_to_do(client: httpx.Client):
    told = client.get("/api/calibration").json()
    for way in ("board", "filmed", "meshed", "scan", "tracker"):
        parts = told["ways"][way]["parts"]
        assert sum(len(part["todo"]) for part in parts) >= 3, way
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


def test_a_session_has_a_picture_once_its_object_is_known(
    client: httpx.Client, example: dict[str, str]
):
    at = f"/api/sessions/{example['session']}/picture"
    ids = f"object={example['object']}&mount={example['mount']}"
    picture = drawn(client, f"{at}?{ids}")
    assert picture.headers["content-type"] == "image/webp"
    with Image.open(io.BytesIO(picture.content)) as shown:
        assert shown.size == (3 * 420 + 2 * 4, 420)
    assert problem(client.get(at), 404)["code"] == "picture-none"
    for gone in ("object", "mount"):
        lost = {**example, gone: "f" * 16}
        answer = client.get(at, params={k: lost[k] for k in ("object", "mount")})
        assert problem(answer, 404)["code"] == f"{gone}-missing"
    broken = f"/api/sessions/{upload(client, BROKEN, 'session')}/picture?{ids}"
    assert problem(refused_in_the_end(client, broken), 404)["code"] == "picture-none"


def refused_in_the_end(client: httpx.Client, address: str) -> httpx.Response:
    """The answer once it is no longer that a picture is being drawn."""
    until = time.monotonic() + 60
    while problem(answer := client.get(address), 404)["code"] == "picture-later":
        assert time.monotonic() < until
        time.sleep(0.2)
    return answer


def test_the_page_of_a_report_shows_the_phone_on_the_object(
    client: httpx.Client, example: dict[str, str]
):
    at = f"/api/sessions/{example['session']}/report.html"
    page = client.get(at, params={k: example[k] for k in ("object", "mount")})
    assert page.text.count('<img src="data:image/jpeg;base64,') == 1
    assert "A wrong mesh or mount shows here." in page.text
    assert "img-src data:" in page.headers["content-security-policy"]
    assert "<img" not in client.get(at).text


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


def test_one_request_asks_for_many_pictures(client: httpx.Client, example: dict[str, str]):
    """What is drawn is asked for once it is there: an address that is not ready is nobody's error."""
    drawn(client, f"/api/objects/{example['object']}/picture")
    ready = f"objects/{example['object']}/picture"
    known = f"object={example['object']}&mount={example['mount']}"
    take = f"sessions/{example['session']}/picture?{known}"
    gone, wrong = f"results/{'f' * 16}/picture", f"{take}&floor=low"
    answer = client.get("/api/pictures", params={"of": [ready, take, gone, wrong]})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found.pop(take) in ("later", "ready")
    assert found == {ready: "ready", gone: "none", wrong: "none"}
    problem(client.get("/api/pictures", params={"of": "../secrets"}), 422)
