"""`omocap serve`: starts, says where, asks for its token beyond this machine, and stops in order."""

import random
import signal
import socket
from ipaddress import ip_address
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest

from capture_app.cli.serve import print_qr
from capture_app.web.library import only_server
from capture_app.web.server import ServerConfig, _listen, _token
from omomo_core.errors import InputError
from tests.capture_app.web.serving import Server
from tests.capture_app.web.talk import announce


@pytest.mark.runs("serve", elsewhere=True)
def test_beyond_this_machine_it_asks_for_the_token_that_it_said_once(tmp_path: Path):
    server = Server(tmp_path / "library", "--host", "0.0.0.0", "--port", "8961")
    try:
        token = server.address.partition("?token=")[2]
        assert len(token) >= 32
        at = f"http://127.0.0.1:{server.url.rpartition(':')[2]}/api/health"
        server.wait(at)
        assert httpx.get(at).status_code == 401
        answer = httpx.get(at, headers={"Authorization": f"Bearer {token}"})
        assert answer.json()["worker"] is False
    finally:
        status = server.stop(signal.SIGTERM)
    assert status == 0
    assert server.said.count(token) == 1
    assert ip_address(server.url.removeprefix("http://").rpartition(":")[0]) != ip_address(
        "0.0.0.0"
    )
    assert "▀" in server.said
    assert "Traceback" not in server.said
    assert list((tmp_path / "library" / "scratch").iterdir()) == []


def test_a_phone_reads_the_address_off_the_terminal(capsys: pytest.CaptureFixture[str]):
    address = f"http://192.168.178.33:8765/?token={'x' * 43}"
    print_qr(address)
    # Each block is two squares of the code, one above the other; light ones are painted.
    halves = {"█": (255, 255), "▀": (255, 0), "▄": (0, 255), " ": (0, 0), "\xa0": (0, 0)}
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    rows = [[halves[c][k] for c in line] for line in lines for k in (0, 1)]
    picture = np.kron(np.array(rows, np.uint8), np.ones((6, 6), np.uint8))
    assert cv2.QRCodeDetector().detectAndDecode(picture)[0] == address


def test_on_this_machine_alone_nothing_is_asked_for():
    assert _token(ServerConfig(Path("library"))) is None
    assert _token(ServerConfig(Path("library"), token="x" * 16)) is not None
    assert _token(ServerConfig(Path("library"), host="192.168.1.2")) is not None


def test_a_port_that_is_taken_is_passed_by():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with _listen("127.0.0.1", port) as free:
            assert port < free.getsockname()[1] <= port + 50


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(InputError) as caught:
        _listen("192.0.2.1", 8765)
    assert caught.value.code == "port-unusable"


def test_a_library_has_one_server(tmp_path: Path):
    with only_server(tmp_path) as note:
        note.write_text("http://127.0.0.1:8765/")
        with pytest.raises(InputError) as caught, only_server(tmp_path):
            pass
    assert caught.value.code == "library-served"
    assert "http://127.0.0.1:8765/" in caught.value.fix
    with only_server(tmp_path):
        pass


@pytest.mark.timeout(1500)
@pytest.mark.parametrize(
    ("size", "cuts", "kills"),
    [
        pytest.param(24 * 2**20, 4, 2, id="24 MiB"),
        pytest.param(2 * 2**30, 20, 10, id="2 GiB", marks=pytest.mark.slow),
    ],
)
def test_an_upload_survives_cuts_and_killed_servers(
    tmp_path: Path, size: int, cuts: int, kills: int
):
    """The file that arrives is the file that was sent, to the last bit."""
    import hashlib

    chunk, rng = min(8 * 2**20, size // 48), random.Random(8)
    source = tmp_path / "film.mp4"
    sent = hashlib.sha256()
    with source.open("wb") as file:
        for _ in range(size // chunk):
            piece = rng.randbytes(chunk)
            sent.update(piece)
            file.write(piece)
    broken = sorted(rng.sample(range(10, size // chunk - 10), cuts + kills))
    killed = set(rng.sample(broken, kills))
    server = Server(tmp_path / "library", "--port", "8971")
    server.wait()
    with httpx.Client(base_url=server.url, timeout=60) as client:
        id_ = announce(client, {"film.mp4": size})["id"]
    for k in [*broken, None]:
        server = _send_until(server, id_, source, k, chunk, kill=k in killed)
    with httpx.Client(base_url=server.url, timeout=600) as client:
        assert client.post(f"/api/uploads/{id_}/finish").json() == {"kind": "material", "id": id_}
    server.stop()
    kept = tmp_path / "library" / "materials" / id_ / "files" / "film.mp4"
    with kept.open("rb") as file:
        assert hashlib.file_digest(file, "sha256").digest() == sent.digest()


def _send_until(
    server: Server, id_: str, source: Path, stop: int | None, chunk: int, *, kill: bool
) -> Server:
    """Go on sending; at some chunk the connection breaks, or the server is killed and started again."""
    at = f"/api/uploads/{id_}"
    with httpx.Client(base_url=server.url, timeout=60) as client, source.open("rb") as file:
        while (have := client.get(at).json()["received"]) < source.stat().st_size:
            file.seek(have)
            piece = file.read(chunk)
            if stop is not None and have // chunk >= stop:
                break
            sent = client.put(f"{at}/files/0?offset={have}", content=piece)
            # What a broken request had sent may still be on its way to the disk: ask again.
            if sent.status_code != 409 or "received" not in sent.json():
                sent.raise_for_status()
        else:
            return server
    host, port = server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as cut:
        head = f"PUT {at}/files/0?offset={have} HTTP/1.1\r\nHost: {host}\r\nContent-Length: "
        cut.sendall(f"{head}{len(piece)}\r\n\r\n".encode() + piece[: len(piece) // 3])
        if kill:
            server.stop(signal.SIGKILL)
    if not kill:
        return server
    again = Server(source.parent / "library", "--port", "8971")
    again.wait()
    return again
