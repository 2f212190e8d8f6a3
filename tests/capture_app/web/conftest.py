"""A server on an empty library, on a port of its own."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import httpx
import pytest
import uvicorn

from capture_app.jobs.queue import open_queue
from capture_app.web.app import ListenAddress, create_app
from capture_app.web.library import Library
from capture_app.web.sandbox_process import SandboxPool
from capture_app.web.server import HeadTimeoutProtocol
from capture_app.web.site import Limits, Site
from tests.capture_app.web.talk import Live

OpenSite = Callable[..., Site]
Serve = Callable[..., Live]
LOCAL = ListenAddress()


@pytest.fixture(scope="module")
def open_site(tmp_path_factory: pytest.TempPathFactory) -> OpenSite:
    """Opens a new library; keywords are limits and a token."""

    def open_(token=None, **limits) -> Site:
        library = Library(tmp_path_factory.mktemp("web") / "library")
        return Site(
            library,
            open_queue(library.database),
            SandboxPool(library.scratch),
            replace(Limits(), **{"spare": 0, **limits}),
            token,
        )

    return open_


@pytest.fixture(scope="module")
def serve() -> Iterator[Serve]:
    """Puts a site on a port, in a thread."""
    running: list[tuple[uvicorn.Server, threading.Thread]] = []

    def start(site: Site, door: ListenAddress = LOCAL) -> Live:
        listening = socket.socket(proto=socket.IPPROTO_TCP)
        listening.bind(("127.0.0.1", 0))
        listening.listen(512)
        app = create_app(site, door)
        config = uvicorn.Config(
            app, http=HeadTimeoutProtocol, ws="none", log_config=None, timeout_graceful_shutdown=1
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listening],), daemon=True)
        thread.start()
        running.append((server, thread))
        for _ in range(500):
            if server.started:
                break
            time.sleep(0.01)
        return Live(site, listening.getsockname()[1], app)

    yield start
    for server, _ in running:
        server.should_exit = True
    for _, thread in running:
        thread.join(10)


@pytest.fixture(scope="module")
def live(open_site: OpenSite, serve: Serve) -> Live:
    """One server for all tests of a module, which leave it usable."""
    return serve(open_site())


@pytest.fixture(scope="module")
def site(live: Live) -> Site:
    return live.site


@pytest.fixture(scope="module")
def client(live: Live) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=live.url, timeout=60) as client:
        yield client
