"""serve: the server on a port of this machine, with its workers, until it is told to stop."""

import asyncio
import errno
import logging
import signal
import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from capture_app.jobs.fleet import Fleet
from capture_app.jobs.queue import JobQueue, open_queue
from capture_app.web.app import ListenAddress, create_app
from capture_app.web.guards import Token, is_loopback, new_token
from capture_app.web.library import Library, only_server
from capture_app.web.sandbox_process import SandboxPool, warm_up
from capture_app.web.site import Limits, Site
from omomo_core.errors import InputError

_PORTS = 50
"""Tried one after the other, when the first is taken."""
_WAITING = 1024
"""Connections that may wait to be taken."""
_EVERYWHERE = ("0.0.0.0", "::")
"""What listens at all addresses of this machine, and is none itself."""
_FAR_AWAY = "192.0.2.1"
"""An address of documentation (RFC 5737)."""
_STOPPING = (signal.SIGINT, signal.SIGTERM)
_LEAVE = 3
"""Seconds that requests get to end when the server stops."""


@dataclass(frozen=True)
class ServerConfig:
    """The settings of the server."""

    library: Path
    host: str = "127.0.0.1"
    port: int = 8765
    token: str | None = None
    """None makes one where others can reach the server."""
    allowed: tuple[str, ...] = ()
    """Names under which a proxy shows it."""
    workers: int = 1


def serve(
    config: ServerConfig, started: Callable[[str], None], warn: Callable[[str], None]
) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        config: how.
        started: told the address to open, once the port is there.
        warn: told in a sentence what could not be kept.

    Raises:
        InputError: the library, the address or the token cannot be used.
    """
    library = _library(config.library)
    token = _token(config)
    with ExitStack() as stack:
        note = stack.enter_context(only_server(library.root))
        listening = stack.enter_context(_listen(config.host, config.port))
        address = _address(config.host, listening.getsockname()[1])
        note.write_text(address, encoding="utf-8")
        queue = open_jobs(library, warn)
        workers = (
            Fleet(queue.database_url, config.workers, died=queue.worker_died)
            if config.workers
            else None
        )
        site = Site(library, queue, SandboxPool(library.scratch), token=token)
        app = create_app(
            site,
            ListenAddress(config.host, config.allowed),
            lambda: workers is not None and workers.alive,
        )
        warm_up()
        if workers is not None:
            workers.start()
            stack.callback(workers.stop)
        started(address if token is None else f"{address}?token={token.value}")
        _run(_config(app), listening)


def open_jobs(library: Library, warn: Callable[[str], None]) -> JobQueue:
    """The jobs of a library; a damaged list of them is put aside, and a new one begun.

    Raises:
        InputError: "jobs-database-..." when it cannot be used for another reason.
    """
    try:
        return open_queue(library.database)
    except InputError as error:
        if error.code != "jobs-database-damaged":
            raise
    aside = library.give_up_jobs()
    warn(
        f"The list of jobs was damaged. It is now {aside.name}, and a new one was begun: order again "
        "what was not finished. Everything in the library is there, and whole."
    )
    return open_queue(library.database)


def open_browser(address: str) -> None:
    """Show the page as soon as the server answers, without waiting for it."""

    def show() -> None:
        time.sleep(0.5)
        webbrowser.open(address)

    threading.Thread(target=show, daemon=True).start()


def _library(root: Path) -> Library:
    try:
        return Library(root)
    except OSError as error:
        raise InputError(
            "library-unusable",
            f"The library cannot be kept there: {error.strerror or error}.",
            where=str(root),
            fix="Give a folder you may write to with ‹library›.",
        ) from error


def _token(config: ServerConfig) -> Token | None:
    if config.token is None and is_loopback(config.host):
        return None
    return Token(config.token or new_token())


def _listen(host: str, port: int) -> socket.socket:
    """A socket on the port, or on the next one that is free."""
    for free in range(port, min(port + _PORTS, 2**16)):
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        # Without its protocol, asyncio leaves Nagle's delay on: 40 ms for every answer.
        listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        if sys.platform != "win32":  # there it would let a second program take the same port
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, free))
            listening.listen(_WAITING)
        except OSError as error:
            listening.close()
            if error.errno != errno.EADDRINUSE:
                raise _cannot_listen(host, port, error.strerror or str(error)) from error
        else:
            return listening
    raise _cannot_listen(host, port, "all ports from there on are taken")


def _cannot_listen(host: str, port: int, why: str) -> InputError:
    return InputError(
        "port-unusable",
        f"The server cannot listen there: {why}.",
        where=f"{host}:{port}",
        fix="Give another ‹port›, or an address of this machine with ‹host›.",
    )


def _address(host: str, port: int) -> str:
    """Return what to type into a browser on this machine, or on another one of its network."""
    name = _network_address() if host in _EVERYWHERE else host
    return f"http://[{name}]:{port}/" if ":" in name else f"http://{name}:{port}/"


def _network_address() -> str:
    """This machine's address in its network; its name where it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            # Nothing is sent: this only asks which way a packet would leave.
            asking.connect((_FAR_AWAY, 9))
            return asking.getsockname()[0]
        except OSError:
            return socket.gethostname()


def _config(app: FastAPI) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        http=HeadTimeoutProtocol,
        ws="none",
        lifespan="on",
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=_LEAVE,
    )


def _run(config: uvicorn.Config, listening: socket.socket) -> None:
    logging.getLogger("uvicorn.error").setLevel(logging.WARNING)
    # When it has stopped in order it raises the signal once more, which then means nothing.
    before = {number: signal.signal(number, lambda *_: None) for number in _STOPPING}
    try:
        uvicorn.Server(config).run(sockets=[listening])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class HeadTimeoutProtocol(H11Protocol):
    """Lets go of a connection on which no whole request head comes for a while."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the clock."""
        super().connection_made(transport)
        self.loop.call_later(Limits().silence, self._let_go)

    def _let_go(self) -> None:
        if not self.headers and not self.transport.is_closing():
            self.transport.close()
