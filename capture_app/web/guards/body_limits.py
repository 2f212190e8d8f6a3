"""Intake: a request is neither longer than it may be, nor waited for for ever."""

import asyncio
from collections.abc import Callable

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

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
