"""A real server with a real worker, and one headless browser, for all tests of the page."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import pytest

CHROMIUM = Path("/usr/bin/chromium")
REPO = Path(__file__).resolve().parents[3]
DEMO = REPO / "capture_app" / "demo_take"
_FLAGS = ["--no-sandbox", "--disable-background-networking", "--disable-component-update"]
TINY = {"samples": 2, "steps": 2, "video": False}
"""Options of a motion that is made in seconds."""


@dataclass(frozen=True)
class Server:
    """A running `omocap serve`."""

    url: str
    """With a slash at the end."""
    library: Path

    def ask(self, path: str, body: object = None, method: str | None = None) -> Any:
        """The answer's JSON of the HTTP API."""
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"} if data else {}
        request = Request(f"{self.url}api/{path}", data, headers, method=method)
        with urlopen(request, timeout=60) as answer:
            text = answer.read()
        return json.loads(text) if text else None

    def bring(self, kind: str, name: str, folder: Path) -> str:
        """Upload a folder's files; the id in the library."""
        files = sorted(path for path in folder.iterdir() if path.is_file())
        listed = [{"path": path.name, "size": path.stat().st_size} for path in files]
        upload = self.ask("uploads", {"kind": kind, "name": name, "files": listed})
        for index, path in enumerate(files):
            put = f"{self.url}api/uploads/{upload['id']}/files/{index}?offset=0"
            headers = {"Content-Type": "application/octet-stream"}
            urlopen(Request(put, path.read_bytes(), headers, method="PUT"), timeout=60).close()
        return self.ask(f"uploads/{upload['id']}/finish", {})["id"]

    def at(self, hash_: str) -> str:
        """The address of a view, such as "/library"."""
        return f"{self.url}#{hash_}"

    def done(self, job: str, seconds: float = 180.0) -> dict[str, Any]:
        """The record of a job when it has ended well."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            record = self.ask(f"jobs/{job}")
            if record["state"] in ("done", "failed", "cancelled"):
                assert record["state"] == "done", record
                return record
            time.sleep(0.1)
        raise TimeoutError(f"job {job} takes more than {seconds} s")


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    if not CHROMIUM.exists():
        pytest.skip("chromium is not installed")
    library = tmp_path_factory.mktemp("library")
    told = library.with_name("told")
    omocap = Path(sys.executable).with_name("omocap")
    command = [omocap, "serve", "--library", library, "--port", str(_free_port()), "--no-browser"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
    with told.open("w") as out:
        process = subprocess.Popen(command, env=environment, stdout=out)
    try:
        yield Server(_address(told, process), library)
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=60)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        return listening.getsockname()[1]


def _address(told: Path, process: subprocess.Popen[bytes]) -> str:
    """The address that the server says when it is ready."""
    until = time.monotonic() + 120
    while time.monotonic() < until and process.poll() is None:
        if found := re.search(r"http://127\.0\.0\.1:\d+/", told.read_text()):
            return found[0]
        time.sleep(0.1)
    raise RuntimeError("the server did not start")


# Playwright runs an event loop while it lives: other files could not have one of their own.
@pytest.fixture(scope="module")
def browser(server: Server) -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api")
    sync_api.expect.set_options(timeout=60_000)
    with sync_api.sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=str(CHROMIUM), args=_FLAGS)


@dataclass(frozen=True)
class Tabs:
    """Opens pages of one visitor; what goes wrong inside them fails the test."""

    context: Any
    faults: list[str]

    def open(self, url: str) -> Any:
        page = self.context.new_page()
        page.set_default_timeout(60_000)
        page.on("pageerror", lambda error: self.faults.append(f"error: {error}"))
        page.on("console", lambda message: self._heard(message))
        page.goto(url)
        return page

    def _heard(self, message: Any) -> None:
        # Answers that are no success are listed too; what the page makes of them is tested.
        if message.type == "error" and "Failed to load resource" not in message.text:
            self.faults.append(message.text)


@pytest.fixture
def tabs(browser: Any, server: Server) -> Iterator[Tabs]:
    context = browser.new_context(
        viewport={"width": 1280, "height": 800}, reduced_motion="reduce", accept_downloads=True
    )
    faults: list[str] = []
    context.on("request", lambda asked: _stays_here(asked.url, server.url, faults))
    yield Tabs(context, faults)
    context.close()
    for job in server.ask("jobs?state=running") + server.ask("jobs?state=queued"):
        server.ask(f"jobs/{job['id']}/cancel", {}, "POST")
    assert faults == []


def _stays_here(url: str, home: str, faults: list[str]) -> None:
    if not url.startswith((home, "blob:", "data:")):
        faults.append(f"asked another server: {url}")


@pytest.fixture(scope="session")
def example(server: Server) -> dict[str, str]:
    """Ids of the example's session, object and mount."""
    return server.ask("example", {}, "POST")


@pytest.fixture(scope="session")
def shaken(server: Server, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A session whose phone jumped half a metre in the middle and came back."""
    folder = tmp_path_factory.mktemp("shaken")
    for file in (DEMO / "session").iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    _shake(folder / "odometry.csv")
    return server.bring("session", "Shaken", folder)


def _shake(log: Path) -> None:
    lines = log.read_text().splitlines()
    middle = len(lines) // 2
    for k in range(middle, middle + 30):
        words = lines[k].split(",")
        words[2] = str(float(words[2]) + 0.5)
        lines[k] = ",".join(words)
    log.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="session")
def make_motion(server: Server, example: dict[str, str]) -> Callable[[str], str]:
    """Makes a motion of the example and tells its id."""

    def make(name: str) -> str:
        order = {"kind": "run", "name": name, **example, "options": TINY}
        return server.done(server.ask("jobs", order)["id"])["result"]

    return make


@pytest.fixture(scope="session")
def motion(make_motion: Callable[[str], str]) -> str:
    """A motion that all tests look at and none changes."""
    return make_motion("The motion")
