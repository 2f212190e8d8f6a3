"""The token that a server beyond this machine asks for: in a link once, then in a cookie or a header."""

import hashlib
import hmac
import secrets
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from capture_app.web.problems import refusal
from omomo_core.errors import InputError

SHORTEST = 16
_OPEN = ("/api/login",)
_MONTH = 30 * 24 * 3600


def new_token() -> str:
    """One that nobody guesses."""
    return secrets.token_urlsafe(24)


@dataclass(frozen=True)
class Token:
    """What a client must know."""

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
        """What the cookie holds: browsers send it to every port of a host, so it is not the token."""
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
