"""Middleware of the server: defects become one sentence, guards may refuse, bodies are bounded."""

import asyncio
import logging
from collections.abc import Callable, Sequence

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from capture_app.web.problems import plain_reply

log = logging.getLogger(__name__)


class ErrorMiddleware:
    """ASGI middleware, innermost of all."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 500 to what no handler knows."""
        begun = False

        async def noticed(message: Message) -> None:
            nonlocal begun
            begun = True
            await send(message)

        try:
            await self._app(scope, receive, noticed)
        except ClientDisconnect:
            # Nobody is there to be told.
            pass
        except Exception as error:
            if scope["type"] != "http" or begun:
                raise
            log.error("%s %s", scope["method"], scope["path"], exc_info=error)
            await plain_reply(500)(scope, receive, send)


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


Bound = Callable[[Request], int]
"""Bytes that a request may have."""


class BodyLimits:
    """ASGI middleware that bounds a request's body, and the silence between two pieces of it."""

    def __init__(self, app: ASGIApp, bound: Bound, silence: float) -> None:
        self._app, self._bound, self._silence = app, bound, silence

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let the request through piece by piece; too long is 413, too slow 408."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        left, coming = self._bound(Request(scope)), True

        async def bounded() -> Message:
            nonlocal left, coming
            if not coming:
                return await receive()
            message = await self._next(receive)
            left -= len(message.get("body", b""))
            coming = message.get("more_body", False)
            if left < 0:
                raise HTTPException(413, headers={"connection": "close"})
            return message

        return await self._app(scope, bounded, send)

    async def _next(self, receive: Receive) -> Message:
        try:
            async with asyncio.timeout(self._silence):
                return await receive()
        except TimeoutError:
            raise HTTPException(408, headers={"connection": "close"}) from None
