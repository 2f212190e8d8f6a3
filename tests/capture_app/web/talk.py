"""What tests say to a server."""

import socket
from dataclasses import dataclass

import httpx
from fastapi import FastAPI

from capture_app.web.site import Site

BROKEN = {"take.zip": b"PK\x03\x04"}
"""A recording of which nothing can be read; it is kept, and its report says so."""


@dataclass(frozen=True)
class Live:
    """A server on a port."""

    site: Site
    port: int
    app: FastAPI

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)


def announce(client: httpx.Client, files: dict[str, int], kind: str = "material") -> dict:
    """Begin an upload of files of so many bytes."""
    listed = [{"path": path, "size": size} for path, size in files.items()]
    answer = client.post("/api/uploads", json={"kind": kind, "name": "a take", "files": listed})
    assert answer.status_code == 201, answer.text
    return answer.json()


def upload(client: httpx.Client, files: dict[str, bytes], kind: str = "material", **how) -> str:
    """Bring files as one thing; returns its id."""
    begun = announce(client, {path: len(data) for path, data in files.items()}, kind)
    for file, data in zip(begun["files"], files.values(), strict=True):
        if data:
            put = client.put(
                f"/api/uploads/{begun['id']}/files/{file['index']}?offset=0", content=data
            )
            assert put.json() == {"received": len(data)}
    done = client.post(f"/api/uploads/{begun['id']}/finish", json=how)
    assert done.status_code == 200, done.text
    return done.json()["id"]


def problem(answer: httpx.Response, status: int) -> dict:
    """The error of an answer, which has the one shape."""
    assert answer.status_code == status, answer.text
    error = answer.json()["error"]
    assert set(error) == {"code", "what", "where", "field", "fix"}
    assert error["what"]
    assert "Traceback" not in answer.text
    return error
