"""From what people bring to what they get, by the API alone."""

import base64
import json
from pathlib import Path

import httpx
import pytest
import trimesh

from capture_app.web.routes import about
from capture_app.web.site import Site
from ingest.formats.registry import FORMATS
from tests.capture_app.replay.made import read_pack
from tests.capture_app.web.talk import BROKEN, announce, problem, upload

UNKNOWN = "ffffffffffffffff"


def _box(side: float) -> bytes:
    return trimesh.creation.box((side, side, side)).export(file_type="ply")


@pytest.fixture(scope="module")
def example(client: httpx.Client) -> dict[str, str]:
    return client.post("/api/example").json()


def test_the_example_is_there_once_and_good(client, example: dict[str, str]):
    assert client.post("/api/example").json() == example
    names = [item["name"] for item in client.get("/api/sessions").json()]
    assert names.count("Example: session") == 1
    ids = {"object": example["object"], "mount": example["mount"]}
    report = client.get(f"/api/sessions/{example['session']}/report", params=ids).json()
    assert report["verdict"] == "good"
    assert report["problem"] is None
    assert report["seconds"] == pytest.approx(11.57, abs=0.1)
    assert {check["severity"] for check in report["checks"]} == {"ok"}
    known = client.get(f"/api/sessions/{example['session']}").json()
    assert (known["app"], known["verdict"]) == ("Stray Scanner", "good")


def test_the_report_of_the_phone_alone_and_as_a_page(client, example: dict[str, str]):
    at = f"/api/sessions/{example['session']}"
    assert client.get(f"{at}/report").json()["app"] == "Stray Scanner"
    page = client.get(f"{at}/report.html")
    assert page.headers["content-type"].startswith("text/html")
    assert "sandbox" in page.headers["content-security-policy"]
    assert "Take report" in page.text


def test_a_session_that_cannot_be_read_is_kept_and_says_why(client):
    id_ = upload(client, BROKEN, "session")
    report = client.get(f"/api/sessions/{id_}/report").json()
    assert report["verdict"] == "not usable"
    assert report["problem"]["code"] == "archive-damaged"
    assert report["advice"] == report["problem"]["fix"] != ""
    assert problem(client.get(f"/api/sessions/{id_}/report.html"), 422)["code"] == "archive-damaged"
    assert client.get(f"/api/sessions/{id_}").status_code == 200


def test_what_is_no_recording_is_refused_in_words_and_kept_as_an_upload(client, site: Site):
    begun = announce(client, {"holiday.jpg": 2}, "session")
    client.put(f"/api/uploads/{begun['id']}/files/0?offset=0", content=b"\xff\xd8")
    refused = problem(client.post(f"/api/uploads/{begun['id']}/finish"), 422)
    assert refused["code"] == "session-unknown"
    assert "holiday.jpg" in refused["what"]
    assert str(site.library.root) not in str(refused)
    assert begun["id"] not in [one["id"] for one in client.get("/api/sessions").json()]
    assert client.get(f"/api/uploads/{begun['id']}").json()["received"] == 2


def test_files_that_are_no_recording_are_refused_however_many_they_are(client, caplog):
    begun = announce(client, {"notes.txt": 2, "holiday/a.jpg": 2}, "session")
    for index in range(2):
        client.put(f"/api/uploads/{begun['id']}/files/{index}?offset=0", content=b"\xff\xd8")
    refused = problem(client.post(f"/api/uploads/{begun['id']}/finish"), 422)
    assert refused["code"] == "session-unknown"
    assert "Traceback" not in caplog.text


def test_a_mount_is_looked_at_before_it_is_kept(client, example: dict[str, str]):
    names = [item["id"] for item in client.get("/api/mounts").json()]
    corners = {"top left back corner": [0, 0, 0.16], "top right back corner": [0.114, 0, 0.16]}
    pairs = [{"phone": name, "point": at} for name, at in corners.items()]
    form = {"method": "points", "name": "x", "object": example["object"], "phone": "iPhone 15 Pro"}
    looked = client.post("/api/mounts/look", json={**form, "pairs": pairs}).json()
    assert "11.4 cm apart here, 7.1 cm on the iPhone 15 Pro" in " ".join(looked["doubts"])
    assert looked["scene"] == ""
    drawing = {
        "method": "drawing",
        "name": "x",
        "object": example["object"],
        "phone": "iPhone 15 Pro",
        "xyz": [0.2, 0, 0.1],
        "axes": "screen faces +x, top edge points +z",
    }
    looked = client.post("/api/mounts/look", json=drawing).json()
    assert "those of its far end" in looked["notes"][0]
    header, arrays = read_pack(base64.b64decode(looked["scene"]))
    assert header["object"] is None
    assert len(arrays["phone_position"]) == 1
    assert [item["id"] for item in client.get("/api/mounts").json()] == names


def test_a_mesh_says_what_it_is(client):
    id_ = upload(client, {"box.ply": _box(0.5)}, "object")
    told = client.get(f"/api/objects/{id_}").json()
    assert (told["vertices"], told["faces"]) == (8, 12)
    assert told["extents"] == [0.5, 0.5, 0.5]


def test_a_mesh_in_centimetres_is_kept_until_its_unit_is_known(client):
    data = _box(50)
    begun = announce(client, {"box.ply": len(data)}, "object")
    client.put(f"/api/uploads/{begun['id']}/files/0?offset=0", content=data)
    finish = f"/api/uploads/{begun['id']}/finish"
    assert problem(client.post(finish), 422)["code"] == "mesh-units"
    assert client.post(finish, json={"scale": 0.01}).json()["kind"] == "object"
    at = f"/api/objects/{begun['id']}"
    assert client.get(at).json()["extents"] == [0.5, 0.5, 0.5]
    assert client.patch(at, json={"scale": 0.02}).json()["extents"] == [1.0, 1.0, 1.0]
    assert problem(client.patch(at, json={"scale": 1}), 422)["code"] == "mesh-units"
    assert client.patch(at, json={"name": "a box"}).json()["name"] == "a box"


@pytest.mark.parametrize(
    ("kind", "name", "data", "code"),
    [
        ("object", "a.obj", b"v 0 0", "mesh-unreadable"),
        ("object", "a.stl", b"\xff" * 84, "mesh-unreadable"),
        ("mount", "a.json", b"{", "mount-unreadable"),
        ("mount", "a.json", b'{"T_phone_object": [[1e999]]}', "mount-unreadable"),
    ],
)
def test_what_is_damaged_is_refused_in_words(client, kind: str, name: str, data: bytes, code: str):
    begun = announce(client, {name: len(data)}, kind)
    client.put(f"/api/uploads/{begun['id']}/files/0?offset=0", content=data)
    error = problem(client.post(f"/api/uploads/{begun['id']}/finish"), 422)
    assert error["code"].startswith(code.partition("-")[0])
    assert error["fix"]
    assert error["where"] == name


def test_a_mesh_reads_no_file_beside_its_own(client, site: Site):
    """A glTF that names another file as its buffer."""
    (site.library.root.parent / "private.bin").write_bytes(bytes(1000))
    gltf = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "../../../../private.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    data = json.dumps(gltf).encode()
    begun = announce(client, {"a.gltf": len(data)}, "object")
    client.put(f"/api/uploads/{begun['id']}/files/0?offset=0", content=data)
    error = problem(client.post(f"/api/uploads/{begun['id']}/finish"), 422)
    assert "private.bin, which is not beside it" in error["what"]


def test_things_are_renamed_and_deleted(client):
    id_ = upload(client, BROKEN, "session")
    at = f"/api/sessions/{id_}"
    assert client.patch(at, json={"name": "  chair <b>1</b> "}).json()["name"] == "chair <b>1</b>"
    assert problem(client.patch(at, json={"name": "  "}), 422)["code"] == "request-invalid"
    assert client.delete(at).status_code == 204
    for answer in (client.get(at), client.delete(at), client.patch(at, json={"name": "x"})):
        assert problem(answer, 404)["code"] == "session-missing"


def test_a_mount_of_a_drawing(client, example: dict[str, str]):
    form = {
        "method": "drawing",
        "name": "holder",
        "phone": "iPhone 15",
        "xyz": [0, 0.12, 0.31],
        "axes": "screen faces +y, top edge points +z",
        "object": example["object"],
    }
    made = client.post("/api/mounts", json=form)
    assert made.status_code == 201, made.text
    assert made.json()["method"] == "drawing"
    assert made.json()["phone"] == "iPhone 15"
    assert 0 < made.json()["bounds"]["mm"] < 20
    assert made.json() in client.get("/api/mounts").json()
    error = problem(client.post("/api/mounts", json={**form, "axes": "screen faces up"}), 422)
    assert error["code"].startswith("drawing")
    assert problem(client.post("/api/mounts", json={**form, "phone": "Nokia"}), 422)["fix"]


def test_a_mount_of_clicked_points(client, example: dict[str, str]):
    corners = {
        "top left back corner": [0.1, 0.22, 0.05],
        "top right back corner": [0.1716, 0.22, 0.05],
        "bottom left back corner": [0.1, 0.0724, 0.05],
        "bottom right back corner": [0.1716, 0.0724, 0.05],
    }
    form = {
        "method": "points",
        "name": "clicked",
        "object": example["object"],
        "phone": "iPhone 15",
        "pairs": [{"phone": name, "point": point} for name, point in corners.items()],
    }
    made = client.post("/api/mounts", json=form)
    assert made.status_code == 201, made.text
    assert made.json()["object"] == example["object"]
    assert len(made.json()["points"]) == 4
    assert all(point["off_mm"] < 2 for point in made.json()["points"])


def test_the_identity_needs_nothing(client):
    made = client.post("/api/mounts", json={"method": "identity", "name": "the phone"}).json()
    assert made["method"] == "identity"
    assert client.delete(f"/api/mounts/{made['id']}").status_code == 204


def test_a_job_is_ordered_once_however_often_it_is_asked_for(client, example: dict[str, str]):
    order = {"kind": "run", **example, "options": {"seed": 3, "samples": 1, "video": False}}
    key = {"Idempotency-Key": "00000000000000cc"}
    made = [client.post("/api/jobs", json=order, headers=key) for _ in range(3)]
    assert [answer.status_code for answer in made] == [201] * 3
    job = made[0].json()
    assert job["id"] == job["result"] == "00000000000000cc"
    assert (job["state"], job["name"]) == ("queued", "Example: session")
    assert job["options"]["seed"] == 3
    assert {given["role"]: given["path"] for given in job["inputs"]} == {
        "session": "session",
        "object": "box.obj",
        "mount": "mount.json",
    }
    listed = client.get("/api/jobs", params={"state": "queued"}).json()
    assert [one["id"] for one in listed].count(job["id"]) == 1
    _what_it_needs_stays(client, example)
    assert problem(client.delete(f"/api/jobs/{job['id']}"), 409)["code"] == "job-active"
    assert client.post(f"/api/jobs/{job['id']}/cancel").json()["state"] == "cancelled"
    assert client.post(f"/api/jobs/{job['id']}/again").json()["state"] == "queued"
    client.post(f"/api/jobs/{job['id']}/cancel")
    assert client.delete(f"/api/jobs/{job['id']}").status_code == 204
    assert problem(client.get(f"/api/jobs/{job['id']}"), 404)["code"] == "job-missing"


def _what_it_needs_stays(client: httpx.Client, example: dict[str, str]) -> None:
    for kind, id_ in example.items():
        assert problem(client.delete(f"/api/{kind}s/{id_}"), 409)["code"] == "in-use"


@pytest.mark.parametrize(
    "order",
    [
        {"kind": "run", "session": UNKNOWN},
        {"kind": "resolve", "result": UNKNOWN, "contacts": {}},
        {"kind": "export", "result": UNKNOWN, "to": "glb"},
        {"kind": "render", "result": UNKNOWN},
        {"kind": "compare", "results": [UNKNOWN]},
    ],
)
def test_a_job_needs_what_it_is_about(client, order):
    assert problem(client.post("/api/jobs", json=order), 404)["code"].endswith("-missing")


def test_a_run_needs_an_object(client, example: dict[str, str]):
    order = {"kind": "run", "session": example["session"]}
    assert problem(client.post("/api/jobs", json=order), 422)["code"] == "object-needed"


def test_a_take_that_is_not_usable_is_refused_when_it_is_asked_for(client, example: dict[str, str]):
    upright = {"kind": "run", **example, "options": {"floor": -50.0, "video": False}}
    refused = problem(client.post("/api/jobs", json=upright), 422)
    assert "50" in refused["what"] or "floor" in refused["what"].lower()
    assert "‹" not in str(refused)
    assert "--" not in str(refused)


def test_a_job_that_waits_for_room_says_so(
    client, site: Site, example: dict[str, str], monkeypatch
):
    order = {"kind": "run", **example, "options": {"samples": 1, "video": False}}
    job = client.post("/api/jobs", json=order).json()["id"]
    monkeypatch.setattr(type(site.library), "free", 0)
    waits = client.get(f"/api/jobs/{job}").json()["waits"]
    monkeypatch.undo()
    client.post(f"/api/jobs/{job}/cancel")
    assert waits.startswith("The disk is full: 0 MB are left.")


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/api/jobs", b"{"),
        ("/api/jobs", b"null"),
        ("/api/jobs", b'{"kind": "run", "session": "../../x"}'),
        ("/api/mounts", b'{"method": "identity"}'),
        ("/api/mounts", b'{"method": "drawing", "name": "n", "xyz": [NaN, 0, 0]}'),
        ("/api/uploads", b'{"kind": "session", "name": "\\ud800", "files": []}'),
        ("/api/uploads", b'{"kind":"session","name":"n","files":[{"path":"../x","size":1}]}'),
    ],
)
def test_a_request_that_does_not_fit_is_told_why(client, path: str, body: bytes):
    answer = client.post(path, content=body, headers={"Content-Type": "application/json"})
    assert problem(answer, 422)["what"]


def test_a_request_that_no_parser_likes(client):
    headers = {"Content-Type": "application/json"}
    answer = client.post("/api/uploads", content=b"[" * 100_000, headers=headers)
    assert problem(answer, 400)["code"] == "request-malformed"


def test_other_addresses_and_methods(client):
    assert problem(client.get("/api/nothing"), 404)["code"] == "not-found"
    assert problem(client.put("/api/health"), 405)["code"] == "method"


def test_a_defect_is_answered_in_a_sentence_and_logged(client, monkeypatch, caplog):
    def broken(*_: object) -> None:
        raise RuntimeError("/a/secret/path")

    monkeypatch.setattr(about, "version", broken)
    error = problem(client.get("/api/health"), 500)
    assert error["code"] == "internal"
    assert "secret" not in str(error)
    assert "/a/secret/path" in caplog.text


def test_choices_name_what_can_be_ordered(client, example: dict[str, str]):
    choices = client.get("/api/choices").json()
    phones = {phone["name"]: phone["lens_known"] for phone in choices["phones"]}
    assert (phones["iPhone 15"], phones["iPhone 17 Pro"]) == (True, False)
    assert {"glb", "bvh", "usd"} <= {export["to"] for export in choices["exports"]}
    format_ = next(one for one in choices["forms"]["run"] if one["name"] == "format")
    assert [value for value, _ in format_["options"]] == ["", *(log.NAME for log in FORMATS)]
    form = {
        "method": "points",
        "name": "all of them",
        "object": example["object"],
        "phone": "iPhone 15",
        "pairs": [{"phone": name, "point": [0, 0, 0]} for name in choices["phone_points"]],
    }
    # The points do not fit, but each of their names is known.
    assert problem(client.post("/api/mounts", json=form), 422)["code"] != "phone-point"


@pytest.mark.parametrize("there", [False, True])
def test_fbx_is_offered_only_where_there_is_a_blender(client, monkeypatch, tmp_path, there: bool):
    if there:
        (tmp_path / "blender").touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    offered = {export["to"] for export in client.get("/api/choices").json()["exports"]}
    assert ("fbx" in offered) == there


def test_what_is_deleted_leaves_nothing(client, site: Site):
    id_ = upload(client, BROKEN, "session")
    client.get(f"/api/sessions/{id_}/report")
    client.delete(f"/api/sessions/{id_}")
    left = [p for p in site.library.root.rglob("*") if id_ in str(p)]
    assert left == []


def test_two_things_of_one_name_stay_two(client):
    one, other = (upload(client, BROKEN, "session") for _ in range(2))
    assert one != other


def test_a_scene_is_packed(client, example: dict[str, str]):
    answer = client.get(f"/api/objects/{example['object']}/scene")
    assert answer.headers["content-type"] == "application/octet-stream"
    length = int.from_bytes(answer.content[:4], "little")
    assert json.loads(answer.content[4 : 4 + length])["kind"] == "object"


def test_the_library_is_all_there_is(site: Site):
    outside = [p for p in site.library.root.parent.iterdir() if p != site.library.root]
    assert [p for p in outside if p != Path(site.library.root.parent / "private.bin")] == []
