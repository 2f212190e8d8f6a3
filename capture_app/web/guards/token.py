"""The token that a server beyond this machine asks for: in a link once, then in a cookie or a header."""

import secrets
from dataclasses import dataclass

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from capture_app.web.problems import refusal
from omomo_core.errors import InputError

COOKIE = "omocap"
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
                where="--token",
                fix="Leave it out: the server makes a good one and prints it.",
            )

    def guard(self, request: Request) -> Response | None:
        """Refuse who does not know it; the page itself is open, so that it can ask for it."""
        path = request.url.path
        if path == "/" and self.fits(request.query_params.get("token", "")):
            # The address bar and the history shall not keep it.
            return self.remember(RedirectResponse("/", 303))
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

    def remember(self, answer: Response) -> Response:
        """Let the browser send it from now on, to this server's own pages alone."""
        answer.set_cookie(COOKIE, self.value, max_age=_MONTH, httponly=True, samesite="strict")
        return answer

    def _is_known(self, request: Request) -> bool:
        scheme, _, bearer = request.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self.fits(bearer.strip()):
            return True
        return self.fits(request.cookies.get(COOKIE, ""))
