"""Requests as bytes: no client library mends them on the way."""

import socket

from tests.capture_app.web.talk import Live


def exchange(live: Live, head: str, body: bytes = b"") -> tuple[int, dict[str, str], bytes]:
    """Send one request on a connection of its own; returns status, headers and body.

    Args:
        live: the server.
        head: request line and headers, a line each; "Connection: close" is added.
        body: what comes behind.
    """
    lines = [line for line in head.strip().splitlines() if line]
    with live.connect() as connection:
        text = "\r\n".join([*lines, "Connection: close", "", ""])
        connection.sendall(text.encode("utf-8", "surrogateescape") + body)
        return answer(connection)


def answer(connection: socket.socket) -> tuple[int, dict[str, str], bytes]:
    """What comes until the server closes the connection."""
    got = b""
    while piece := connection.recv(2**16):
        got += piece
    if not got:
        return 0, {}, b""
    head, _, body = got.partition(b"\r\n\r\n")
    first, *rest = head.decode("latin-1").split("\r\n")
    headers = {name.lower(): value.strip() for name, _, value in (r.partition(":") for r in rest)}
    return int(first.split()[1]), headers, body


def ask(live: Live, target: str = "/api/health", method: str = "GET", **headers: str | None) -> int:
    """The status of a request with such headers; underscores stand for dashes, None leaves one out."""
    given = {
        "Host": f"127.0.0.1:{live.port}",
        **{k.replace("_", "-"): v for k, v in headers.items()},
    }
    lines = [
        f"{method} {target} HTTP/1.1",
        *(f"{k}: {v}" for k, v in given.items() if v is not None),
    ]
    if method in ("POST", "PATCH", "PUT"):
        lines.append("Content-Length: 0")
    return exchange(live, "\n".join(lines))[0]
