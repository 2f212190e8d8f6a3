"""What a user names to be compared: a file or folder, and which motion in it."""

import re
from dataclasses import dataclass
from pathlib import Path

from omomo_core.errors import InputError


@dataclass(frozen=True)
class Choice:
    """A path, and what follows its "#"."""

    path: Path
    which: str | None = None
    """A sample's number from 1, or a clip's number or name; None for the chosen or only one."""

    def __str__(self) -> str:
        return str(self.path) if self.which is None else f"{self.path}#{self.which}"


def choice(text: str) -> Choice:
    """The path and the part of "result#3"; a path that really contains "#" is taken as it is.

    Raises:
        InputError: there is no such file or folder.
    """
    named = re.fullmatch(r"(.+)#([^#/]+)", text)
    found = Choice(Path(text)) if named is None else Choice(Path(named[1]), named[2])
    for option in (Choice(Path(text)), found):
        if option.path.exists():
            return option
    raise InputError(
        "motion-missing",
        "There is no such result or clip.",
        where=str(found.path),
        fix="Give a result folder, RESULT#3 for its third sample, or a file of clips.",
    )


def number(which: str, count: int, choice: Choice, things: str) -> int:
    """Index of the motion with a number from 1.

    Raises:
        InputError: it is no number, or there are fewer.
    """
    if which.isdecimal() and 1 <= int(which) <= count:
        return int(which) - 1
    raise InputError(
        "sample-missing",
        f"There is no {which!r} among the {count} {things}.",
        where=str(choice),
        fix=f"Write # and a number from 1 to {count}.",
    )
