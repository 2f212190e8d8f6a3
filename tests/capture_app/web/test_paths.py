"""40 path payloads on every route: nothing outside the library is read or written."""

import re
from pathlib import Path

import pytest
from starlette.routing import Mount

from tests.capture_app.web.raw import answer
from tests.capture_app.web.talk import Live

SECRET = b"what-only-the-owner-may-read"
_UP = ("../", "..%2f", "%2e%2e/", "%2e%2e%2f", "..%252f", "..\\", "..%5c", "%c0%ae%c0%ae/", "..;/")
PAYLOADS = [
    *(up * 8 + "etc/passwd" for up in _UP),
    *(up * 2 + "secret.txt" for up in _UP),
    *("/etc/passwd", "//etc/passwd", "%2fetc%2fpasswd", "file:///etc/passwd", "C:%5cboot.ini"),
    *("C:/boot.ini", "%5c%5cserver%5cshare", "//server/share/x", "%00", "a%00.json", "..%00/"),
    *("....//....//secret.txt", "%ef%bc%8e%ef%bc%8e/secret.txt", "NUL", "con.txt", "~root/.bashrc"),
    *(".", "..", "%0a", "x" * 5000, "%25%32%65%25%32%65/secret.txt", "%uff0e%uff0e/secret.txt"),
]


def _routes(live: Live) -> list[tuple[str, str]]:
    """Method and path of every route, with those that the page's files come from."""
    described = live.app.openapi()["paths"]
    found = [(method.upper(), path) for path, methods in described.items() for method in methods]
    mounts = [("GET", f"{m.path}/{{path}}") for m in live.app.routes if isinstance(m, Mount)]
    return [*found, *mounts, ("GET", "/"), ("GET", "/api/openapi.json")]


def _targets(path: str, payload: str) -> list[str]:
    """The payload in each place of the path, behind it, and in its query."""
    filled = re.sub(r"\{[^}]*\}", "0123456789abcdef", path)
    places = re.findall(r"\{[^}]*\}", path)
    inside = [
        re.sub(r"\{[^}]*\}", "0123456789abcdef", path.replace(place, payload)) for place in places
    ]
    query = payload.replace("&", "%26")
    return [*inside, f"{filled}/{payload}", f"{filled}?object={query}&offset={query}&state={query}"]


def _status(live: Live, method: str, target: str) -> tuple[int, bytes]:
    body = b"{}" if method in ("POST", "PUT", "PATCH") else b""
    head = (
        f"{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:{live.port}\r\nConnection: close\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    with live.connect() as connection:
        connection.sendall(head.encode() + body)
        status, _, got = answer(connection)
    return status, got


def _snapshot(folder: Path) -> dict[Path, float]:
    return {path: path.stat().st_mtime for path in folder.rglob("*") if path.is_file()}


def test_there_are_forty_of_them():
    assert len(PAYLOADS) == len(set(PAYLOADS)) >= 40


def test_every_route_was_found(live: Live):
    routes = _routes(live)
    assert len(routes) > 50
    assert ("GET", "/api/results/{id}/files/{name}") in routes


_EVERY = 7
"""One in so many is tried in the quick tests."""


@pytest.mark.parametrize(
    "payload",
    [
        pytest.param(payload, marks=() if k % _EVERY == 0 else pytest.mark.slow)
        for k, payload in enumerate(PAYLOADS)
    ],
)
def test_no_route_reads_or_writes_outside(live: Live, payload: str):
    root = live.site.library.root
    (root.parent / "secret.txt").write_bytes(SECRET)
    (root / "secret.txt").write_bytes(SECRET)
    outside = {p: t for p, t in _snapshot(root.parent).items() if not p.is_relative_to(root)}
    for method, path in _routes(live):
        for target in _targets(path, payload):
            status, got = _status(live, method, target)
            assert status < 500, (method, target, got)
            assert SECRET not in got
            assert b"root:" not in got
    assert outside == {
        p: t for p, t in _snapshot(root.parent).items() if not p.is_relative_to(root)
    }


@pytest.mark.parametrize("place", ["files", "exports"])
def test_a_name_is_only_looked_for_among_those_that_are_there(live: Live, client, place: str):
    id_ = "00000000000000aa"
    folder = live.site.library.results.place(id_)
    folder.mkdir(exist_ok=True)
    (folder / "manifest.json").write_text("{}")
    (folder / ".hidden").write_bytes(SECRET)
    (live.site.library.results.make_exports(id_) / "sub").mkdir(exist_ok=True)
    (folder / "link").unlink(missing_ok=True)
    for name in (".hidden", "sub", "..%2f..%2fsecret.txt", "%2e%2e", "manifest.json%00"):
        assert client.get(f"/api/results/{id_}/{place}/{name}").status_code == 404
