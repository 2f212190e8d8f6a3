"""What every request passes before a route sees it, and every answer on its way out.

The host and the origin are checked, the token is asked for, bodies are bounded, and headers say what an
answer may do in a browser.
"""

import asyncio
import hashlib
import hmac
import logging
import re
import secrets
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address

from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from capture_app.web.problems import plain_reply, refusal
from omomo_core.errors import InputError

_PAGE = (
    "default-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
SANDBOX = "sandbox; default-src 'none'; frame-ancestors 'none'"
"""Policy of files that people brought or made: nothing in them runs or loads anything."""
REPORT = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"
)
"""Policy of a page of ours that tells of what people brought: it may only have its styles."""

_ALWAYS = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


class Headers:
    """ASGI middleware that puts them on."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Add to the head of the answer."""

        async def dressed(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _ALWAYS.items():
                    headers[name] = value
                headers.setdefault("content-security-policy", _PAGE)
                headers.setdefault("cache-control", "no-store")
            await send(message)

        await self._app(scope, receive, dressed)


_HOST = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::([0-9]{1,5}))?")


@dataclass(frozen=True)
class Hosts:
    """The names and addresses that a Host header may have."""

    names: frozenset[str]
    """In lower case, without a port."""
    any_address: bool = False
    """Any IP address too: nobody can register one as the name of a web site."""

    def allow(self, host: str) -> bool:
        """Whether a name without port is one of ours."""
        name = host.lower().rstrip(".")
        address = _address(name)
        if address is not None:
            return self.any_address or address.is_loopback or name in self.names
        return name == "localhost" or name.endswith(".localhost") or name in self.names

    def guard(self, request: Request) -> Response | None:
        """Refuse a request for another host."""
        given = request.headers.getlist("host")
        found = split_host(given[0]) if len(given) == 1 else None
        if found is not None and self.allow(found[0]):
            return None
        return refusal(
            403,
            "host-unknown",
            "The server does not answer to this name.",
            where=f"Host: {', '.join(given)!r:.100}",
            fix="Use the address that it printed. If a proxy stands before it, start it with "
            "--allow-host NAME.",
        )


def hosts_of(bound: str, allowed: tuple[str, ...]) -> Hosts:
    """The names of a server that is bound to an address, with those that its user allows.

    Args:
        bound: what --host says.
        allowed: what --allow-host says, each a name with or without a port.
    """
    names = {split[0].lower() for name in allowed if (split := split_host(name)) is not None}
    if is_loopback(bound):
        return Hosts(frozenset(names))
    own = socket.gethostname().lower()
    return Hosts(frozenset({*names, bound.lower(), own, f"{own}.local"}), any_address=True)


def split_host(text: str) -> tuple[str, str] | None:
    """Name (an IPv6 address keeps its brackets) and port ("" if none); None for what is neither."""
    match = _HOST.fullmatch(text)
    return (match[1], match[2] or "") if match else None


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach it."""
    address = _address(host)
    return host == "localhost" if address is None else address.is_loopback


def _address(host: str) -> IPv4Address | IPv6Address | None:
    try:
        return ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return None


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


_READS = ("GET", "HEAD")
_OWN = ("same-origin", "none")
"""none: its user typed the address, or opened a bookmark."""
_PORTS = {"http": "80", "https": "443"}


def origin_guard(proxied: frozenset[str]) -> Callable[[Request], Response | None]:
    """The guard of a server.

    Args:
        proxied: names under which proxies that may change the Host show the server to browsers.
    """

    def guard(request: Request) -> Response | None:
        site = request.headers.get("sec-fetch-site")
        if site is not None and site not in _OWN and not _followed_link(request):
            return _foreign(f"Sec-Fetch-Site: {site!r:.40}")
        origin = request.headers.get("origin")
        if request.method in _READS or origin is None or _is_ours(request, origin, proxied):
            return None
        return _foreign(f"Origin: {origin!r:.100}")

    return guard


def _followed_link(request: Request) -> bool:
    """Somebody came here by a link: the page opens, and nothing is told to where they were."""
    return (
        request.method in _READS
        and request.headers.get("sec-fetch-mode") == "navigate"
        and request.headers.get("sec-fetch-dest") == "document"
    )


def _is_ours(request: Request, origin: str, proxied: frozenset[str]) -> bool:
    scheme, _, place = origin.partition("://")
    there, here = split_host(place), split_host(request.headers.get("host", ""))
    if there is None or here is None or scheme not in _PORTS:
        return False
    if there[0].lower() in proxied:
        return True
    # A proxy may have taken https off on the way: then the port is the default one of https.
    same_port = (there[1] or _PORTS[scheme]) == (here[1] or _PORTS[scheme])
    return there[0].lower() == here[0].lower() and same_port


def _foreign(where: str) -> Response:
    return refusal(
        403,
        "cross-site",
        "Another web site sent this request.",
        where=where,
        fix="Use the server's own page. If a proxy shows it under another name, start it with "
        "--allow-host NAME.",
    )


SHORTEST = 16
_OPEN = ("/api/login",)
_MONTH = 30 * 24 * 3600


def new_token() -> str:
    """One that nobody guesses."""
    return secrets.token_urlsafe(24)


@dataclass(frozen=True)
class Token:
    """The secret that a client must know."""

    value: str

    def __post_init__(self) -> None:
        if len(self.value) < SHORTEST or not self.value.isascii() or not self.value.isprintable():
            raise InputError(
                "token-weak",
                f"A token needs {SHORTEST} characters or more, all of them ASCII.",
                field="token",
                fix="Leave it out: the server makes a good one and prints it.",
            )

    def guard(self, request: Request) -> Response | None:
        """Refuse who does not know it; the page itself is open, so that it can ask for it."""
        path = request.url.path
        if path == "/" and self.fits(request.query_params.get("token", "")):
            # The address bar and the history shall not keep it.
            return self.remember(request, RedirectResponse("/", 303))
        if not path.startswith("/api") or path in _OPEN or self._is_known(request):
            return None
        return refusal(
            401,
            "token-needed",
            "This server asks for its token.",
            fix="Open the link that it printed when it was started.",
        )

    def fits(self, given: str) -> bool:
        """Whether it is the one; takes as long for any that is not."""
        return secrets.compare_digest(given.encode(), self.value.encode())

    def remember(self, request: Request, answer: Response) -> Response:
        """Let the browser come in from now on. Its cookie says no more than that it was let in."""
        answer.set_cookie(
            _cookie(request), self._pass, max_age=_MONTH, httponly=True, samesite="strict"
        )
        return answer

    @property
    def _pass(self) -> str:
        """Return what the cookie holds: browsers send it to every port of a host, so it is not the token."""
        return hmac.new(self.value.encode(), b"omocap cookie", hashlib.sha256).hexdigest()

    def _is_known(self, request: Request) -> bool:
        scheme, _, bearer = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self.fits(bearer.strip()):
            return True
        shown = request.cookies.get(_cookie(request), "")
        return secrets.compare_digest(shown.encode(), self._pass.encode())


def _cookie(request: Request) -> str:
    """The cookie's name: one for each port, so that servers of one host do not log each other out."""
    return f"omocap-{(request.scope.get('server') or ('', 0))[1]}"
