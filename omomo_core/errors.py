"""The one exception family: what is wrong, where, and how to fix it."""

from functools import partial


class OmocapError(Exception):
    """A problem the user can act on; the command line prints it and exits with code 2.

    Args:
        code: stable short name, e.g. ``"mount-missing"``.
        what: one sentence saying what is wrong.
        where: the file, frame range or option it concerns ("" when there is none).
        fix: one sentence saying what to do about it.
    """

    def __init__(self, code: str, what: str, *, where: str = "", fix: str = "") -> None:
        super().__init__(what)
        self.code = code
        self.what = what
        self.where = where
        self.fix = fix

    def __reduce__(self) -> tuple[partial["OmocapError"], tuple[str, str]]:
        """Return what makes it anew in another process, as a worker's error is."""
        return partial(type(self), where=self.where, fix=self.fix), (self.code, self.what)

    def __str__(self) -> str:
        place = f" [{self.where}]" if self.where else ""
        remedy = f" {self.fix}" if self.fix else ""
        return f"{self.what}{place}{remedy} ({self.code})"


class InputError(OmocapError):
    """The input (session, mesh, mount, option) cannot give a correct motion."""


class AssetError(OmocapError):
    """A file the program needs (body, weights) is missing, damaged or of another version."""


_OF_PYTHON = (LookupError, TypeError, AttributeError, AssertionError, ArithmeticError, UnicodeError)


def reader_complaint(problem: Exception) -> str:
    """Return what a library says of a file that it cannot read, without the words of Python.

    Exceptions that only name a key, a type or an attribute tell a user nothing.
    """
    text = str(problem)
    if isinstance(problem, _OF_PYTHON) or " " not in text:
        return "what it holds is not as its format has it"
    return text[:200]
