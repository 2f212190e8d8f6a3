"""Every failure as the one shape `{"error": {code, what, where, fix}}` with its HTTP status."""

import errno
import logging
import re
from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from capture_app.commands.inputs import DescribedModel
from capture_app.commands.request import first_problem
from capture_app.web.page_words import in_page_words
from omomo_core.errors import InputError, OmocapError

log = logging.getLogger(__name__)

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_FULL_CODES = ("disk-full", "archive-disk")
_SURROGATE = re.compile("[\ud800-\udfff]")


class ErrorDetail(DescribedModel):
    """An error: what is wrong, where, and how to fix it."""

    code: str
    """Stays the same in all versions, for programs."""
    what: str
    """What is wrong, in a sentence."""
    where: str = ""
    """The file, the frames or the part of the request; "" where that is no place."""
    field: str = ""
    """The field of the request that it concerns, where it is one."""
    fix: str = ""
    """How to fix it; "" where no remedy is sure."""


class ErrorReply(DescribedModel):
    """The body of every answer that is not a success."""

    error: ErrorDetail
    """What went wrong."""


class Refused(InputError):
    """A request that is answered with an error, and with which status."""

    def __init__(
        self, status: int, code: str, what: str, *, where: str = "", fix: str = "", **more: Any
    ) -> None:
        super().__init__(code, what, where=where, fix=fix)
        self.status = status
        self.more = more
        """What the answer says beside the error."""


_REPLIES: dict[int, tuple[str, str, str]] = {
    400: ("request-malformed", "The request cannot be understood.", "Send it again."),
    404: ("not-found", "There is nothing at this address.", "Check the address."),
    405: ("method", "This address does not take requests of this kind.", "See /api/openapi.json."),
    408: ("too-slow", "Nothing came for a while.", "Check the connection and send it again."),
    413: ("too-large", "The request is larger than the server takes.", "See /api/health: limits."),
    500: (
        "internal",
        "Something went wrong in the program; what you brought is unharmed.",
        "Try again. If it happens again, the server's log tells what to report.",
    ),
}


def refusal(status: int, code: str, what: str, *, where: str = "", fix: str = "") -> JSONResponse:
    """The answer of an error that no route is at hand to raise."""
    return _reply(status, ErrorDetail(code=code, what=what, where=where, fix=fix))


def plain_reply(status: int, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """The answer of a status that says it all."""
    code, what, fix = _REPLIES.get(status, _REPLIES[400 if status < 500 else 500])
    return _reply(status, ErrorDetail(code=code, what=what, fix=fix), headers=headers)


def _reply(
    status: int, problem: ErrorDetail, *, headers: Mapping[str, str] | None = None, **more: Any
) -> JSONResponse:
    # Names of files may hold what is no text; JSON must.
    texts = {k: _SURROGATE.sub("\ufffd", v) for k, v in problem.model_dump().items()}
    return JSONResponse({"error": texts, **more}, status, headers)


def status_of(error: OmocapError) -> int:
    """The HTTP status that an error of any room stands for."""
    if isinstance(error, Refused):
        return error.status
    return 507 if error.code in _FULL_CODES else 422


def is_of_the_disk(error: OmocapError) -> bool:
    """Whether something could not be written, which is no fault of what was read."""
    return error.code in (*_FULL_CODES, "output-not-writable")


def add_error_replies(app: FastAPI) -> None:
    """Give every failure of a route its answer; the unknown ones are met in `guards.calm`."""

    def ours(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, OmocapError)
        library = request.app.state.site.library

        shown = {name: in_page_words(library.shown(text)) for name, text in error.texts.items()}
        more = error.more if isinstance(error, Refused) else {}
        return _reply(status_of(error), ErrorDetail(**shown), **more)

    def full_disk(_: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, OSError)
        if error.errno not in NO_ROOM:
            raise error
        return refusal(507, "disk-full", "The disk is full.", fix="Make room on it and go on.")

    app.add_exception_handler(OmocapError, ours)
    app.add_exception_handler(OSError, full_disk)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http)


def _invalid(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    where, said = first_problem(error.errors())
    fix = "See /api/openapi.json for what it must look like."
    what = f"The request does not fit: {said}."
    return refusal(422, "request-invalid", what, where=where[:200], fix=fix)


def _http(_: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    return plain_reply(error.status_code, error.headers)
