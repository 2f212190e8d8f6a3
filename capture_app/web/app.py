"""create_app: the server as an ASGI application."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from fastapi import Depends, FastAPI
from fastapi.security import HTTPBearer
from starlette.middleware import Middleware
from starlette.requests import Request

from capture_app.web.file_response import add_pages
from capture_app.web.guards import (
    BodyLimits,
    ErrorMiddleware,
    GuardMiddleware,
    Headers,
    Hosts,
    hosts_of,
    origin_guard,
)
from capture_app.web.problems import ErrorReply, add_error_replies
from capture_app.web.routes import about, items, jobs, mounts, reports, results, uploads
from capture_app.web.site import Limits, Site

_SWEEP_EVERY = 3600.0
_BEARER = HTTPBearer(
    auto_error=False,
    description="The token that the server printed when it was started. A browser sends the cookie "
    "instead that it gets from POST /api/login.",
)
"""Describes what `Token.guard` asks for, and refuses nobody itself."""
_ERRORS = (400, 401, 403, 404, 408, 409, 411, 413, 422, 500, 507)


@dataclass(frozen=True)
class ListenAddress:
    """Under which names the server is reached."""

    bound: str = "127.0.0.1"
    allowed: tuple[str, ...] = ()
    """Names under which a proxy shows it."""

    @property
    def hosts(self) -> Hosts:
        """The names that a request may be for."""
        return hosts_of(self.bound, self.allowed)

    @property
    def proxied(self) -> frozenset[str]:
        """The allowed names alone."""
        return hosts_of("127.0.0.1", self.allowed).names


def create_app(
    site: Site,
    door: ListenAddress = ListenAddress(),
    worker_runs: Callable[[], bool] = lambda: False,
) -> FastAPI:
    """The application of a site; its guards are part of it.

    Args:
        site: library, jobs and bounds.
        door: under which names it is reached.
        worker_runs: tells whether a worker is there to do jobs.
    """
    guards = [door.hosts.guard, origin_guard(door.proxied)]
    if site.token is not None:
        guards.append(site.token.guard)
    app = FastAPI(
        title="omocap",
        version=version("omocap"),
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=_lifespan,
        generate_unique_id_function=_operation_id,
        dependencies=[Depends(_BEARER)] if site.token is not None else [],
        responses={status: {"model": ErrorReply} for status in _ERRORS},
        middleware=[
            Middleware(Headers),
            Middleware(GuardMiddleware, guards=guards),
            Middleware(BodyLimits, bound=_bound(site.limits), silence=site.limits.silence),
            Middleware(ErrorMiddleware),
        ],
    )
    app.state.site = site
    add_error_replies(app)
    app.include_router(about.routes(worker_runs))
    app.include_router(uploads.router)
    # Before the shelves: their routes take any name behind a session or an object.
    for router in (
        reports.router,
        reports.picture_router,
        reports.scan_router,
        mounts.router,
        mounts.guide_router,
        results.router,
        jobs.router,
        about.example_router,
    ):
        app.include_router(router)
    for kind in site.library.shelves:
        app.include_router(items.routes(kind))
    add_pages(app)
    return app


def _operation_id(route: Any) -> str:
    """Return a name that stays when an address changes: what it is about, and its function's name."""
    return "_".join([*map(str, route.tags), route.name.rstrip("_")])


def _bound(limits: Limits) -> Callable[[Request], int]:
    """Return how long a request may be; of a piece of a file its route knows more."""

    def bound(request: Request) -> int:
        if request.method == "PUT":
            return limits.chunk + 1
        return limits.listing if request.url.path == uploads.PATH else limits.json

    return bound


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncGenerator[None]:
    """Sweep while the server runs, and let go of everything at its end."""
    site: Site = app.state.site
    site.library.empty_scratch()
    sweeping = asyncio.create_task(_sweep(site))
    try:
        yield
    finally:
        sweeping.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await sweeping
        site.close()


async def _sweep(site: Site) -> None:
    while True:
        await asyncio.to_thread(site.library.sweep, site.limits.orphan)
        await asyncio.sleep(_SWEEP_EVERY)
