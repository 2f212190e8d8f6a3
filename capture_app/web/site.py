"""The site that the routes work with: the library, the jobs, the bounds, and what receives files."""

import asyncio
import os
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import IO, Annotated, TypeVar

from fastapi import Depends, Request
from fastapi import Path as PathParameter

from capture_app.jobs.queue import JobQueue
from capture_app.web.guards import Token
from capture_app.web.library import Library
from capture_app.web.problems import Refused
from capture_app.web.sandbox_process import SandboxPool
from capture_app.web.shelves import Id
from ingest.archive import MAX_BYTES, MAX_ENTRIES
from ingest.mesh import MAX_BYTES as MESH_BYTES

MIB = 2**20


@dataclass(frozen=True)
class Limits:
    """Bounds on what a client may send, in bytes unless they say otherwise."""

    chunk: int = 64 * MIB
    """Most bytes of one request of an upload."""
    file: int = MAX_BYTES
    upload: int = MAX_BYTES
    """Most bytes of all its files together."""
    files: int = MAX_ENTRIES
    """In one upload; as many as an archive may hold."""
    mesh: int = MESH_BYTES
    small: int = 8 * MIB
    """Most bytes of a mount or a list of contacts."""
    listing: int = 64 * MIB
    """Most bytes of the request that lists the files of an upload."""
    json: int = 10 * MIB
    """Most bytes of any other request."""
    spare: int = 256 * MIB
    """Left free on the disk for everything else."""
    silence: float = 30.0
    """Seconds that a client may say nothing in the middle of a request."""
    orphan: float = 24 * 3600.0
    """Seconds after which an upload that nobody went on with is swept away."""


_T = TypeVar("_T")


class Receiver:
    """Appends to files; a request for a file cuts off an older one for it, which may hang."""

    def __init__(self) -> None:
        self._work: dict[Path, asyncio.Task[int]] = {}

    async def append(
        self, place: Path, offset: int, length: int, body: AsyncIterator[bytes]
    ) -> int:
        """Put bytes behind the ones that are there.

        Args:
            place: the file; it and its folders are made.
            offset: where the client believes that the file ends.
            length: how many bytes were announced.
            body: the bytes; whatever comes of them is kept, even when it ends with an error.

        Returns:
            How long the file is now; what came in large pieces is flushed to the disk.

        Raises:
            Refused: 409 when the file does not end there, or another request took over.
            OSError: the disk is full.
        """
        await self._cut_off(place)
        work = asyncio.ensure_future(_append(place, offset, length, body))
        self._work[place] = work
        try:
            return await work
        except asyncio.CancelledError:
            request = asyncio.current_task()
            if request is not None and request.cancelling():
                raise
            raise _taken_over() from None
        finally:
            if self._work.get(place) is work:
                del self._work[place]

    async def _cut_off(self, place: Path) -> None:
        # It stays known until it is over: of several who come, none begins before that.
        while (older := self._work.get(place)) is not None:
            older.cancel()
            await asyncio.wait([older])
            if self._work.get(place) is older:
                del self._work[place]


async def _append(place: Path, offset: int, length: int, body: AsyncIterator[bytes]) -> int:
    tail, taken = _Tail(place, offset), 0
    try:
        async for piece in body:
            taken += len(piece)
            tail.held += piece[: len(piece) - max(0, taken - length)]
            if len(tail.held) >= MIB:
                await _in_thread(tail.write)
    finally:
        # A small piece takes one visit to the disk, of which an upload may need thousands.
        await _in_thread(tail.close)
    return offset + min(taken, length)


class _Tail:
    """The end of a file, opened when there is something to put there."""

    def __init__(self, place: Path, offset: int) -> None:
        self.held = bytearray()
        """To be put there; what a full disk leaves over stays."""
        self._place, self._offset = place, offset
        self._file: IO[bytes] | None = None
        self._written = 0

    def write(self) -> None:
        """Put there all that is held."""
        file = self._open()
        while self.held:
            done = file.write(self.held)
            self._written += done
            del self.held[:done]

    def close(self) -> None:
        """Put the rest there; what is little is flushed when the upload is finished."""
        try:
            self.write()
            if self._written >= MIB:
                os.fsync(self._open().fileno())
        finally:
            if self._file is not None:
                self._file.close()

    def _open(self) -> IO[bytes]:
        if self._file is None:
            self._place.parent.mkdir(parents=True, exist_ok=True)
            file = self._place.open("ab", buffering=0)
            there = os.fstat(file.fileno()).st_size
            if there != self._offset:
                file.close()
                raise _elsewhere(there, self._offset)
            self._file = file
        return self._file


def _elsewhere(there: int, offset: int) -> Refused:
    return Refused(
        409,
        "upload-offset",
        f"The file has {there} bytes so far.",
        where=f"offset {offset}",
        fix="Go on from there.",
        received=there,
    )


async def _in_thread(work: Callable[[], _T]) -> _T:
    """Run in a thread; who is cancelled waits for it all the same, so that two never write at once."""
    running = asyncio.ensure_future(asyncio.to_thread(work))
    cancelled: asyncio.CancelledError | None = None
    while not running.done():
        try:
            await asyncio.wait([running])
        except asyncio.CancelledError as error:
            cancelled = error
    if cancelled is not None:
        raise cancelled from running.exception()
    return running.result()


def _taken_over() -> Refused:
    return Refused(
        409,
        "upload-taken-over",
        "Another request goes on with this file.",
        fix="Ask how much of it is there, and go on from there.",
    )


@dataclass(frozen=True)
class Site:
    """One server's library, jobs and bounds."""

    library: Library
    queue: JobQueue
    sandbox: SandboxPool
    limits: Limits = field(default_factory=Limits)
    token: Token | None = None
    """What clients must know; None asks for nothing."""
    receiver: Receiver = field(default_factory=Receiver)

    @cached_property
    def painter(self) -> SandboxPool:
        """The pool for work that nobody waits for: it keeps nobody from being served."""
        return SandboxPool(self.library.scratch, at_once=1)

    def close(self) -> None:
        """Begin nothing more."""
        self.sandbox.close()
        self.painter.close()
        self.queue.close()


async def _site(request: Request) -> Site:
    return request.app.state.site


Here = Annotated[Site, Depends(_site)]
"""A route's parameter: the site it belongs to."""
ThingId = Annotated[
    Id,
    PathParameter(description="Id of the thing: 16 hex digits, as a list or what made it tells."),
]
"""A route's parameter: a part of its address."""
