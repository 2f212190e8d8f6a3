"""The one exception family: what is wrong, where, and how to fix it.

Texts for a user do not know who shows them. They name a field of the request as ‹mesh_scale›, a field
that is to be switched off as ‹no poses›, and a command as ‹omocap scan›. Each front end spells these
references: the command line as options, the page as the labels of its form.
"""

import json
import re
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Self

_REFERENCE = re.compile("‹([^‹›]+)›")


def spelled(text: str, spell: Callable[[str], str]) -> str:
    """Return a text with its references, such as ‹mesh_scale›, in the words of a front end.

    Args:
        text: of an error, a check or a note.
        spell: returns the words for what stands between the marks.
    """
    return _REFERENCE.sub(lambda reference: spell(reference[1]), text) if "‹" in text else text


def all_spelled(value: Any, spell: Callable[[str], str]) -> Any:
    """Return JSON with all its texts as `spelled` has them."""
    if isinstance(value, str):
        return spelled(value, spell)
    if isinstance(value, Mapping):
        return {key: all_spelled(part, spell) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [all_spelled(part, spell) for part in value]
    return value


class OmocapError(Exception):
    """A problem the user can act on; the command line prints it and exits with code 2.

    Args:
        code: stable short name, e.g. ``"mount-missing"``.
        what: one sentence saying what is wrong.
        where: the file or frame range it concerns ("" when there is none).
        field: the field of the request it concerns, such as ``"mesh_scale"``; stands for `where`.
        fix: one sentence saying what to do about it.
    """

    def __init__(
        self, code: str, what: str, *, where: str = "", field: str = "", fix: str = ""
    ) -> None:
        super().__init__(what)
        self.code = code
        self.what = what
        self.where = where or (f"‹{field}›" if field else "")
        self.field = field
        self.fix = fix

    @property
    def texts(self) -> dict[str, str]:
        """Every text of the error by its name, as JSON has them."""
        return {name: getattr(self, name) for name in ("code", "what", "where", "field", "fix")}

    def __reduce__(self) -> tuple[partial[Self], tuple[str, str]]:
        """Return what makes it anew in another process, as a worker's error is."""
        named = partial(type(self), where=self.where, field=self.field, fix=self.fix)
        return named, (self.code, self.what)

    def __str__(self) -> str:
        place = f" [{self.where}]" if self.where else ""
        remedy = f" {self.fix}" if self.fix else ""
        return f"{self.what}{place}{remedy} ({self.code})"


class InputError(OmocapError):
    """The input (session, mesh, mount, option) cannot give a correct motion."""


class AssetError(OmocapError):
    """A file the program needs (body, weights) is missing, damaged or of another version."""


class DamageError(ValueError):
    """What is wrong with a file, in words of ours; a reader of it makes an `InputError` of that."""


def in_words(problem: Exception) -> str:
    """Return what is wrong with a file in words of ours, whatever was raised while it was read.

    A ValueError without a class of its own is ours, or Python's about a number; the disk says what it has
    to say without its numbers; and all that a library says of its own insides is left out.
    """
    if isinstance(problem, KeyError) and problem.args and isinstance(problem.args[0], str):
        return f"it has no {str(problem.args[0])[:40]}"
    if isinstance(problem, OSError) and problem.strerror:
        return problem.strerror.lower()
    if isinstance(problem, UnicodeError):
        return "it is no UTF-8 text"
    if isinstance(problem, json.JSONDecodeError):
        return f"line {problem.lineno} is no JSON"
    if type(problem) is ValueError or type(problem).__module__.startswith("omomo_core."):
        return str(problem)[:200]
    return NOT_AS_ITS_FORMAT


NOT_AS_ITS_FORMAT = "what it holds is not as its format has it"


def in_own_words(problem: Exception) -> str:
    """Return the same for readers on libraries, whose ValueErrors and keys tell a user nothing.

    What those readers find themselves they raise as `DamageError`.
    """
    foreign = type(problem) is ValueError or isinstance(problem, KeyError)
    return NOT_AS_ITS_FORMAT if foreign else in_words(problem)


@contextmanager
def reading(
    refusal: Callable[[str], InputError],
    *,
    words: Callable[[Exception], str] = in_own_words,
    faults: tuple[type[Exception], ...] = (Exception,),
) -> Generator[None]:
    """Turn whatever a library raises on a damaged file into one error.

    Args:
        refusal: the error, from what is wrong with the file.
        words: what is wrong, by what was raised.
        faults: what the library raises.

    Raises:
        InputError: that, or what the block raises itself.
    """
    try:
        yield
    except InputError:
        raise
    except faults as problem:
        raise refusal(words(problem)) from None
