"""What people brought or made is never run by a browser, whatever it is called and holds."""

import pytest

from tests.capture_app.web.talk import Live

ID = "00000000000000bb"
SCRIPT = b"<script>alert(document.domain)</script>"
ACTIVE = {
    "a.svg": b'<svg xmlns="http://www.w3.org/2000/svg" onload="alert(1)"/>',
    "a.html": SCRIPT,
    "a.htm": SCRIPT,
    "a.xhtml": b'<html xmlns="http://www.w3.org/1999/xhtml">' + SCRIPT + b"</html>",
    "a.xml": b'<?xml-stylesheet href="a.xsl"?>',
    "a.xsl": b"<xsl:stylesheet/>",
    "a.mhtml": b"MIME-Version: 1.0",
    "a.pdf": b"%PDF-1.7",
    "a.js": b"alert(1)",
    "a.mjs": b"alert(1)",
    "a.wasm": b"\0asm",
    "a.swf": b"FWS",
    "a.hta": SCRIPT,
    "a.json": SCRIPT,
}


@pytest.fixture(scope="module")
def made(live: Live) -> Live:
    """A result whose folder and exports hold anything."""
    results = live.site.library.results
    results.place(ID).mkdir()
    (results.place(ID) / "manifest.json").write_text("{}")
    for folder in (results.place(ID), results.make_exports(ID)):
        for name, data in ACTIVE.items():
            (folder / name).write_bytes(data)
        (folder / "film.mp4").write_bytes(bytes(range(256)))
        (folder / "page.png").write_bytes(SCRIPT)
    return live


@pytest.mark.parametrize("place", ["files", "exports"])
@pytest.mark.parametrize("name", ACTIVE)
def test_it_is_a_download_and_nothing_else(made: Live, client, place: str, name: str):
    answer = client.get(f"/api/results/{ID}/{place}/{name}")
    assert answer.content == ACTIVE[name]
    assert answer.headers["content-type"] == "application/octet-stream"
    assert answer.headers["content-disposition"].startswith("attachment")
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["content-security-policy"].startswith("sandbox; default-src 'none'")


def test_a_page_that_is_called_a_picture_is_one(made: Live, client):
    answer = client.get(f"/api/results/{ID}/files/page.png")
    assert answer.headers["content-type"] == "image/png"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "sandbox" in answer.headers["content-security-policy"]


def test_a_film_is_shown_and_any_part_of_it_can_be_had(made: Live, client):
    at = f"/api/results/{ID}/files/film.mp4"
    whole = client.get(at)
    assert whole.headers["content-type"] == "video/mp4"
    assert whole.headers["content-disposition"].startswith("inline")
    part = client.get(at, headers={"Range": "bytes=10-19"})
    assert part.status_code == 206
    assert part.content == bytes(range(10, 20))
    assert client.get(at, headers={"Range": "bytes=999-"}).status_code == 416


def test_nothing_that_was_brought_is_served(made: Live, client):
    """Sessions, meshes and mounts are read by the server; no address shows their files."""
    named = [path for path in made.app.openapi()["paths"] if "{name}" in path or "{path" in path]
    assert sorted(named) == [
        "/api/results/{id}/exports/{name}",
        "/api/results/{id}/files/{name}",
    ]
