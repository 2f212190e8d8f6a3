"""Calm: a defect of the program is logged here, and answered in a sentence that tells nothing of it."""

import logging

from starlette.requests import ClientDisconnect
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
