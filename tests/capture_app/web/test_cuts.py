"""Connections that break, stop, lie or crawl."""

import hashlib
import random
import time

import httpx
import pytest

from tests.capture_app.web.raw import answer
from tests.capture_app.web.talk import Live, announce, problem


def _put(live: Live, id_: str, offset: int, length: int, part: bytes):
    """Begin to send a piece of such a length; returns the open connection."""
    connection = live.connect()
    head = (
        f"PUT /api/uploads/{id_}/files/0?offset={offset} HTTP/1.1\r\n"
        f"Host: 127.0.0.1:{live.port}\r\nContent-Length: {length}\r\n\r\n"
    )
    connection.sendall(head.encode() + part)
    return connection


def _received(client: httpx.Client, id_: str) -> int:
    return client.get(f"/api/uploads/{id_}").json()["received"]


def _send_rest(client: httpx.Client, id_: str, data: bytes) -> None:
    """Send what is missing; the server may still write what a cut connection had sent, and refuse a piece."""
    while (have := _received(client, id_)) < len(data):
        piece = data[have : have + 2**20]
        client.put(f"/api/uploads/{id_}/files/0?offset={have}", content=piece)


def test_twenty_cuts_and_the_file_is_the_same(live: Live, client: httpx.Client):
    rng = random.Random(3)
    data = rng.randbytes(6 * 2**20)
    id_ = announce(client, {"a.bin": len(data)})["id"]
    for _ in range(20):
        have = _received(client, id_)
        length = min(2**20, len(data) - have)
        with _put(live, id_, have, length, data[have : have + rng.randrange(length)]):
            pass
    _send_rest(client, id_, data)
    assert client.post(f"/api/uploads/{id_}/finish").status_code == 200
    kept = live.site.library.shelves["material"].folder / id_ / "files" / "a.bin"
    assert hashlib.sha256(kept.read_bytes()).digest() == hashlib.sha256(data).digest()


def test_who_comes_back_need_not_wait_for_the_connection_that_hangs(live: Live, client):
    id_ = announce(client, {"a.bin": 1000})["id"]
    with _put(live, id_, 0, 1000, bytes(300)) as hanging:
        time.sleep(0.2)
        begun = time.monotonic()
        told = client.put(f"/api/uploads/{id_}/files/0?offset=0", content=bytes(1000))
        assert problem_or_none(told) == ("upload-offset", 300)
        assert client.put(f"/api/uploads/{id_}/files/0?offset=300", content=bytes(700)).json() == {
            "received": 1000
        }
        assert time.monotonic() - begun < 5
        hanging.sendall(bytes(700))
        assert _received(client, id_) == 1000


def problem_or_none(told: httpx.Response) -> tuple[str, int]:
    return problem(told, 409)["code"], told.json()["received"]


def test_a_length_that_is_a_lie_puts_nothing_where_it_does_not_belong(live: Live, client):
    data = bytes(range(100))
    id_ = announce(client, {"a.bin": 100})["id"]
    with _put(live, id_, 0, 10, data[:60]) as more:
        assert b'"received":10' in answer(more)[2]
    assert _received(client, id_) == 10
    with _put(live, id_, 10, 50, data[10:30]) as less:
        less.shutdown(1)
        answer(less)
    have = _received(client, id_)
    assert 10 <= have <= 30
    _send_rest(client, id_, data)
    assert client.post(f"/api/uploads/{id_}/finish").status_code == 200
    kept = live.site.library.shelves["material"].folder / id_ / "files" / "a.bin"
    assert kept.read_bytes() == data


@pytest.fixture(scope="module")
def hasty(open_site, serve) -> Live:
    """A server that waits for nobody longer than a second."""
    return serve(open_site(silence=1.0))


def test_who_stops_in_the_middle_is_told_and_keeps_what_came(hasty: Live):
    with httpx.Client(base_url=hasty.url) as client:
        id_ = announce(client, {"a.bin": 1000})["id"]
        with _put(hasty, id_, 0, 1000, bytes(300)) as silent:
            status, _, body = answer(silent)
        assert status == 408
        assert b"too-slow" in body
        assert _received(client, id_) == 300


def test_who_stops_in_the_middle_of_a_form_is_told(hasty: Live):
    with hasty.connect() as silent:
        silent.sendall(
            f"POST /api/mounts HTTP/1.1\r\nHost: 127.0.0.1:{hasty.port}\r\n"
            "Content-Type: application/json\r\nContent-Length: 100\r\n\r\n{".encode()
        )
        status, _, body = answer(silent)
    assert status == 408
    assert b'"error"' in body


@pytest.mark.parametrize("count", [50, pytest.param(200, marks=pytest.mark.slow)])
def test_slow_clients_starve_nobody(live: Live, client: httpx.Client, count: int):
    """So many crawl, in head and body; another client is served within a second all the while."""
    files = {f"{k}.bin": 10_000 for k in range(count)}
    id_ = announce(client, {**files, "whole.bin": 300_000})["id"]
    at = f"/api/uploads/{id_}/files"
    crawling = [live.connect() for _ in range(count)]
    other = bytes(30_000)
    try:
        for k, connection in enumerate(crawling):
            if k % 2:
                connection.sendall(b"GET /api/health HTTP/1.1\r\nHost: loc")
            else:
                head = f"PUT {at}/{k}?offset=0 HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999\r\n\r\n"
                connection.sendall(head.encode())
        took: list[float] = []
        for k in range(10):
            for connection in crawling:
                connection.sendall(b"x")
            begun = time.perf_counter()
            client.get("/api/materials")
            sent = client.put(f"{at}/{count}?offset={k * len(other)}", content=other)
            took.append(time.perf_counter() - begun)
            assert sent.json() == {"received": (k + 1) * len(other)}
    finally:
        for connection in crawling:
            connection.close()
    # Most of the time: a busy machine may stall any one request.
    assert sorted(took)[len(took) // 2] < 1.0
