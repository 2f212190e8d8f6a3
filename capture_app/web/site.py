"""Site: what the routes work with."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

from fastapi import Depends, Request

from capture_app.jobs.queue import JobQueue
from capture_app.web.guards.token import Token
from capture_app.web.library.library import Library
from capture_app.web.limits import Limits
from capture_app.web.receive import Receiver
from capture_app.web.sandbox.pool import SandboxPool


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
        """For what nobody waits for: it keeps nobody from being served."""
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
