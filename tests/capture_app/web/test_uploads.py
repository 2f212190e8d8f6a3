"""What is uploaded arrives whole, whatever happens on the way."""

import hashlib
import os
import random
import resource
import time
from contextlib import contextmanager

import httpx
import pytest

from capture_app.web.library import Library
from capture_app.web.shelves import TRASH
from capture_app.web.site import Site
from tests.capture_app.web.talk import BROKEN, announce, problem, upload

RNG = random.Random(0)


@pytest.fixture(scope="module")
def small(open_site, serve):
    """A client of a server that takes little."""
    site = open_site(file=1000, upload=1500, files=5, mesh=300, small=100, chunk=64, json=1000)
    with httpx.Client(base_url=serve(site).url) as client:
        yield client


def _kept(site: Site, id_: str, path: str) -> bytes:
    return (site.library.shelves["material"].folder / id_ / "files" / path).read_bytes()


def test_a_folder_becomes_a_session_with_the_same_files(client, site: Site):
    files = {
        "take/odometry.csv": RNG.randbytes(100_000),
        "take/depth/000.png": b"x",
        "take/empty.txt": b"",
        "take/Gerät 日本.txt": b"words",
    }
    id_ = upload(client, files)
    listed = client.get(f"/api/materials/{id_}").json()
    assert listed in client.get("/api/materials").json()
    assert (listed["name"], listed["size"], listed["files"]) == ("a take", 100_006, 4)
    for path, data in files.items():
        assert _kept(site, id_, path) == data
    assert id_ not in [item["id"] for item in client.get("/api/uploads").json()]


def test_pieces_go_behind_each_other_and_nowhere_else(client, site: Site):
    data = RNG.randbytes(5000)
    begun = announce(client, {"a.bin": 5000})
    at = f"/api/uploads/{begun['id']}/files/0"
    assert client.put(f"{at}?offset=0", content=data[:2000]).json() == {"received": 2000}
    for wrong in (0, 1999, 2001, 5000):
        answer = client.put(f"{at}?offset={wrong}", content=b"")
        assert problem(answer, 409)["code"] == "upload-offset"
        assert answer.json()["received"] == 2000
    assert client.get(f"/api/uploads/{begun['id']}").json()["files"][0]["received"] == 2000
    listed = next(i for i in client.get("/api/uploads").json() if i["id"] == begun["id"])
    assert (listed["received"], listed["size"], listed["count"]) == (2000, 5000, 1)
    unfinished = problem(client.post(f"/api/uploads/{begun['id']}/finish"), 409)
    assert unfinished["code"] == "upload-incomplete"
    assert unfinished["where"] == "a.bin"
    client.put(f"{at}?offset=2000", content=data[2000:])
    assert client.post(f"/api/uploads/{begun['id']}/finish").json()["kind"] == "material"
    assert _kept(site, begun["id"], "a.bin") == data


def test_a_large_piece_for_another_place_is_left_out_as_a_whole(client):
    id_ = announce(client, {"a.bin": 9 * 2**20})["id"]
    at = f"/api/uploads/{id_}/files/0"
    client.put(f"{at}?offset=0", content=b"12345")
    for wrong in (0, 4, 2**20):
        answer = client.put(f"{at}?offset={wrong}", content=bytes(3 * 2**20))
        assert problem(answer, 409)["code"] == "upload-offset"
    assert client.get(f"/api/uploads/{id_}").json()["received"] == 5


def test_an_answer_that_got_lost_may_be_asked_for_again(client):
    id_ = upload(client, {"a.csv": b"1,2"})
    again = client.post(f"/api/uploads/{id_}/finish")
    assert again.json() == {"kind": "material", "id": id_}
    assert [item["id"] for item in client.get("/api/materials").json()].count(id_) == 1


def test_more_than_was_announced_is_refused(client, site: Site):
    begun = announce(client, {"a.bin": 10})
    answer = client.put(f"/api/uploads/{begun['id']}/files/0?offset=0", content=bytes(11))
    assert problem(answer, 413)["code"] == "chunk-too-large"
    missing = client.put(f"/api/uploads/{begun['id']}/files/1?offset=0", content=b"x")
    assert problem(missing, 404)["code"] == "upload-file-missing"
    assert client.get(f"/api/uploads/{begun['id']}").json()["received"] == 0


def test_a_piece_without_its_length_is_refused(client):
    begun = announce(client, {"a.bin": 10})
    answer = client.put(
        f"/api/uploads/{begun['id']}/files/0?offset=0", content=iter([b"12345", b"67890"])
    )
    assert problem(answer, 411)["code"] == "length-required"


@pytest.mark.parametrize(
    ("kind", "files"),
    [
        ("session", {"a": 1001}),
        ("session", {"a": 1000, "b": 501}),
        ("session", {f"{k}": 1 for k in range(6)}),
        ("object", {"a.obj": 301}),
        ("mount", {"mount.json": 101}),
        ("contacts", {"contacts.json": 101}),
    ],
)
def test_limits_hold_to_the_byte(small, kind: str, files: dict[str, int]):
    listed = [{"path": p, "size": size} for p, size in files.items()]
    body = {"kind": kind, "name": "n", "files": listed}
    assert problem(small.post("/api/uploads", json=body), 413)["code"] == "upload-too-large"
    if len(listed) > 5:
        listed.pop()
    else:
        listed[-1]["size"] -= 1
    assert small.post("/api/uploads", json=body).status_code == 201


def test_a_piece_may_be_so_long_and_no_longer(small):
    at = f"/api/uploads/{announce(small, {'a.bin': 100})['id']}/files/0?offset=0"
    assert problem(small.put(at, content=bytes(65)), 413)["code"] == "chunk-too-large"
    assert small.put(at, content=bytes(64)).json() == {"received": 64}


def test_a_request_longer_than_any_is_refused_before_it_is_read(small):
    body = {"method": "identity", "name": "x" * 2000}
    assert problem(small.post("/api/mounts", json=body), 413)["code"] == "too-large"


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("session", []),
        ("object", ["notes.txt"]),
        ("object", ["a.obj", "b.obj"]),
        ("mount", ["mount.txt"]),
        ("mount", ["a.json", "b.json"]),
        ("video", ["film.exe"]),
        ("contacts", ["contacts.csv"]),
    ],
)
def test_what_cannot_be_of_its_kind_is_refused_before_it_is_sent(client, kind: str, names):
    body = {"kind": kind, "name": "n", "files": [{"path": n, "size": 1} for n in names]}
    assert problem(client.post("/api/uploads", json=body), 422)["code"] == "upload-files"


def test_no_room_is_said_at_once(client, site: Site, monkeypatch):
    monkeypatch.setattr(Library, "free", 999)
    body = {"kind": "session", "name": "n", "files": [{"path": "a", "size": 1000}]}
    assert problem(client.post("/api/uploads", json=body), 507)["code"] == "disk-full"


@contextmanager
def _full_after(size: int):
    """No file of this process can grow beyond so many bytes: writes fail as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    "room", [0, 1, 999, 65536, 10**6, 2**20, 2**20 + 1, 1_500_000, 2**21, 2_999_999]
)
def test_a_full_disk_breaks_nothing_and_is_gone_on_from(client, site: Site, room: int):
    data = RNG.randbytes(3_000_000)
    begun = announce(client, {"a.bin": len(data)})
    at = f"/api/uploads/{begun['id']}/files/0"
    with _full_after(room):
        answer = client.put(f"{at}?offset=0", content=data)
    assert problem(answer, 507)["code"] == "disk-full"
    have = client.get(f"/api/uploads/{begun['id']}").json()["received"]
    assert have == room
    assert client.put(f"{at}?offset={have}", content=data[have:]).json() == {"received": len(data)}
    client.post(f"/api/uploads/{begun['id']}/finish")
    assert _kept(site, begun["id"], "a.bin") == data


def test_uploads_that_nobody_goes_on_with_are_swept(client, site: Site):
    old, new = (announce(client, {"a.bin": 10})["id"] for _ in range(2))
    client.put(f"/api/uploads/{old}/files/0?offset=0", content=b"12345")
    left = site.library.uploads.folder / f"{TRASH}0123"
    left.mkdir()
    yesterday = time.time() - 25 * 3600
    os.utime(site.library.uploads.folder / old / "upload.json", (yesterday, yesterday))
    site.library.sweep(86400.0)
    assert new in [item["id"] for item in client.get("/api/uploads").json()]
    assert not (site.library.uploads.folder / old).exists()
    assert not left.exists()


def test_going_on_keeps_an_upload_from_being_swept(client, site: Site):
    id_ = announce(client, {"a.bin": 10})["id"]
    yesterday = time.time() - 25 * 3600
    os.utime(site.library.uploads.folder / id_ / "upload.json", (yesterday, yesterday))
    client.put(f"/api/uploads/{id_}/files/0?offset=0", content=b"12345")
    site.library.sweep(86400.0)
    assert client.get(f"/api/uploads/{id_}").json()["received"] == 5


def test_an_upload_can_be_given_up(client, site: Site):
    id_ = announce(client, {"a.bin": 10})["id"]
    assert client.delete(f"/api/uploads/{id_}").status_code == 204
    assert problem(client.get(f"/api/uploads/{id_}"), 404)["code"] == "upload-missing"
    assert not list(site.library.uploads.folder.glob(f"*{id_}*"))


@pytest.mark.parametrize("count", [200, pytest.param(5000, marks=pytest.mark.slow)])
def test_a_folder_of_many_files(client, site: Site, count: int):
    files = {f"take/depth/{k:05d}.png": str(k).encode() for k in range(count)}
    id_ = upload(client, files)
    kept = site.library.shelves["material"].folder / id_ / "files"
    digest = hashlib.sha256()
    for path in sorted(kept.rglob("*.png")):
        digest.update(path.read_bytes())
    assert digest.digest() == hashlib.sha256(b"".join(files.values())).digest()
    assert client.get(f"/api/materials/{id_}").json()["files"] == count


def test_the_server_shows_nothing_of_where_it_is(client, site: Site):
    id_ = upload(client, BROKEN, "session")
    report = client.get(f"/api/sessions/{id_}/report")
    assert report.json()["problem"]["where"] == "take.zip"
    assert str(site.library.root) not in report.text
