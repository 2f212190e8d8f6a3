"""The pages of the documentation: their fenced blocks, their links, and what they name."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass

from tests.conftest import REPO

NOT_RUN = "*Not run by the tests: "
"""How the line directly above or below a block begins that says why the tests leave it out."""
SHELL = ("", "sh", "bash")
"""Languages of blocks that are run. A block without a language is one, so none is missed."""
_FENCE = re.compile(r"^ *```(\w*) *$")
_SPAN = re.compile(r"`+([^`]+)`+")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: str
    """Path in the repository."""
    line: int
    """Of its first line of text, from 1."""
    language: str
    text: str
    reason: str | None
    """Why the tests leave it out, as the page says."""

    @property
    def shell(self) -> bool:
        """Whether it is for a shell."""
        return self.language in SHELL


def pages() -> list[str]:
    """README, CONTRIBUTING and everything in docs/, as paths in the repository."""
    inside = sorted(f"docs/{path.name}" for path in (REPO / "docs").glob("*.md"))
    return ["README.md", "CONTRIBUTING.md", *inside]


def markdown() -> list[str]:
    """Every page of the repository, as paths in it; what is installed or made is no part of it."""
    rooms = (
        "capture_app",
        "ingest",
        "omomo_core",
        "render",
        "tests",
        "benchmarks",
        "tools",
        "examples",
    )
    inside = [path for room in rooms for path in sorted((REPO / room).rglob("*.md"))]
    return [*pages(), *(str(path.relative_to(REPO)) for path in inside)]


def text_of(page: str) -> str:
    return (REPO / page).read_text(encoding="utf-8")


def blocks(page: str, text: str | None = None) -> list[Block]:
    """All fenced blocks of a page, in order."""
    lines = (text_of(page) if text is None else text).splitlines()
    fences = [k for k, line in enumerate(lines) if _FENCE.match(line)]
    assert len(fences) % 2 == 0, f"{page}: a fence is not closed"
    found = []
    for first, last in zip(fences[::2], fences[1::2], strict=True):
        language = _FENCE.match(lines[first])
        assert language is not None
        body = "\n".join(lines[first + 1 : last])
        around = [*lines[max(first - 1, 0) : first], *lines[last + 1 : last + 2]]
        found.append(Block(page, first + 2, language[1], body, _reason(around)))
    return found


def _reason(around: list[str]) -> str | None:
    for line in around:
        if line.strip().startswith(NOT_RUN):
            return line.strip().removeprefix(NOT_RUN).rstrip("*")
    return None


def prose(page: str) -> str:
    """The page without its fenced blocks; lines keep their numbers."""
    inside, kept = False, []
    for line in text_of(page).splitlines():
        fence = _FENCE.match(line) is not None
        kept.append("" if inside or fence else line)
        inside ^= fence
    return "\n".join(kept)


def spans(text: str) -> list[str]:
    """What stands in `code` of a text, line breaks as blanks."""
    return [" ".join(span.split()) for span in _SPAN.findall(text)]


def command_lines(text: str) -> Iterator[list[str]]:
    """The words of every command of ours in a shell text, the word omocap left out."""
    joined = text.replace("\\\n", " ")
    for line in joined.splitlines():
        for part in re.split(r"[;|]|&&", line):
            words = _words(part)
            while words and ("=" in words[0] or words[0] in ("do", "then")):
                words = words[1:]
            if words[:1] == ["omocap"] or (
                words[:1] == ["./run"] and words[1:2] not in ([], ["test"])
            ):
                yield words[1:]


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text, comments=True)
    except ValueError:
        return text.split()
