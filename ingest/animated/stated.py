"""What comment lines at the top of a text file state: `# fps: 24`, `# up: y`."""

import re
from pathlib import Path

from ingest.animated.animation import MAX_FPS, Up
from ingest.formats.pick import floats, head_lines
from omomo_core.errors import InputError

_STATED = re.compile(r"\s*#\s*(\w+)\s*:\s*(\S+)\s*$")
_KNOWN = {
    "up": "y or z",
    "fps": "a number of frames a second",
    "interpolation": "smooth, linear or constant",
}


def stated(path: Path) -> dict[str, str]:
    """The words that comments give for up, fps and interpolation, in small letters."""
    found = [match for line in head_lines(path) if (match := _STATED.match(line))]
    return {m[1].lower(): m[2].lower() for m in found if m[1].lower() in _KNOWN}


def unknown_word(path: Path, key: str, value: str) -> InputError:
    """The error when a comment states an unknown word."""
    return InputError(
        "comment-unknown",
        f"The comment says that {key} is {value[:30]!r}; it can be {_KNOWN[key]}.",
        where=str(path),
        fix=f"Mend the line that begins with # {key}:.",
    )


def stated_up(path: Path) -> Up:
    """Which axis is up; z where no comment says so."""
    word = stated(path).get("up", "z")
    if word == "y":
        return "y"
    if word == "z":
        return "z"
    raise unknown_word(path, "up", word)


def stated_fps(path: Path) -> float:
    """Frames a second, for files that count frames.

    Raises:
        InputError: "fps-missing" or "comment-unknown".
    """
    word = stated(path).get("fps")
    if word is None:
        raise InputError(
            "fps-missing",
            f"{path.name} counts frames, and does not say how many are a second.",
            where=str(path),
            fix="Put a line like # fps: 24 at the top, or give a column time in seconds.",
        )
    rate = floats([word])
    if not rate or not 0 < rate[0] < MAX_FPS:
        raise unknown_word(path, "fps", word)
    return rate[0]
