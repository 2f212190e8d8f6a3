"""Gate: a row of guards, each of which may refuse a request before any route sees it."""

from collections.abc import Callable, Sequence

from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

Guard = Callable[[Request], Response | None]
"""The answer that refuses a request, or None to let it pass."""


class GuardMiddleware:
    """ASGI middleware of guards; what is no HTTP is not served at all."""

    def __init__(self, app: ASGIApp, guards: Sequence[Guard]) -> None:
        self._app, self._guards = app, guards

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Ask the guards in order."""
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        if scope["type"] != "http":
            return None
        request = Request(scope)
        for guard in self._guards:
            if (answer := guard(request)) is not None:
                return await answer(scope, receive, send)
        return await self._app(scope, receive, send)
