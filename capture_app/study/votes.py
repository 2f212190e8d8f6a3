"""Votes of a study and its answer key, in files.

The answer key: what stood where on which page. It stays with who makes the study.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from capture_app.commands.request import first_problem
from capture_app.study.study_design import Side
from omomo_core.errors import InputError, in_words

KEY = "key.json"
"""The file with the key in a study's folder."""
PAGES = "pages"
"""The folder of what raters get in a study's folder."""


class _KeyRecord(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class KeyItem(_KeyRecord):
    """One question as one page shows it."""

    id: str
    """What the page calls it; tells a rater nothing."""
    take: str
    left: str
    """Name of the method on the left."""
    right: str
    intact: Side | None = None
    """In an attention check, the side that was not broken."""


class KeyPage(_KeyRecord):
    """One page."""

    id: str
    file: str
    batch: int
    items: tuple[KeyItem, ...]


class Key(_KeyRecord):
    """`key.json` of a study's folder."""

    format_version: Literal[1] = 1
    study: str
    """What the pages and votes of this study call it."""
    seed: int
    methods: tuple[str, ...]
    pages: tuple[KeyPage, ...]


def write_key(folder: Path, key: Key) -> None:
    """Write it into a study's folder."""
    (folder / KEY).write_text(key.model_dump_json(indent=1) + "\n", encoding="utf-8")


def read_key(folder: Path) -> Key:
    """Read what `write_key` wrote.

    Raises:
        InputError: there is none, or it is damaged.
    """
    path = folder / KEY
    try:
        return Key.model_validate_json(path.read_bytes())
    except OSError as error:
        raise InputError(
            "study-missing",
            "This is no study: it has no answer key.",
            where=str(path),
            fix="Give the folder that ‹omocap study make› wrote, with its key.json.",
        ) from error
    except ValidationError as error:
        field, problem = first_problem(error.errors())
        raise InputError(
            "study-damaged",
            f"The answer key cannot be read: {field}: {problem}.",
            where=str(path),
            fix="Make the study again with the same seed: its key will be the same.",
        ) from error


FORMAT = "omocap study votes"
_MOST_BYTES = 5 * 10**6


class _VoteRecord(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class PageAnswer(_VoteRecord):
    """The choice of a rater, and after how many milliseconds."""

    item: str
    choice: Side
    ms: Annotated[int, Field(ge=0)]


class VoteFile(_VoteRecord):
    """The file that a page saves."""

    format: Literal["omocap study votes"]
    version: Literal[1]
    study: str
    page: str
    answers: Annotated[list[PageAnswer], Field(max_length=10_000)]


@dataclass(frozen=True)
class Vote:
    """An answer with what it was about."""

    item: KeyItem
    choice: Side

    @property
    def preferred(self) -> str:
        """Name of the method chosen."""
        return self.item.left if self.choice == "left" else self.item.right


@dataclass(frozen=True)
class Rater:
    """All votes of one page."""

    name: str
    """Name of their file of votes."""
    page: KeyPage
    votes: tuple[Vote, ...]

    @property
    def checks_missed(self) -> int:
        """Attention checks in which they chose the broken film."""
        return sum(v.item.intact is not None and v.choice != v.item.intact for v in self.votes)

    @property
    def checks(self) -> int:
        """Attention checks on their page."""
        return sum(v.item.intact is not None for v in self.votes)


def vote_files(paths: Iterable[Path]) -> list[Path]:
    """Files as given, and the .json files of folders.

    Raises:
        InputError: a path is missing, or there is no file at all.
    """
    files: list[Path] = []
    for path in paths:
        if not path.exists():
            raise InputError(
                "votes-missing", "There are no votes here.", where=str(path), fix="Check the path."
            )
        files += sorted(path.glob("*.json")) if path.is_dir() else [path]
    if not files:
        raise InputError(
            "votes-missing",
            "There is no file of votes.",
            fix="Give the JSON files that the pages saved, or a folder of them.",
        )
    return files


def read_votes(paths: Sequence[Path], key: Key) -> list[Rater]:
    """Read files of votes.

    Raises:
        InputError: "votes-damaged", "votes-foreign" (another study), "votes-unknown-page",
            "votes-unknown-pair", "votes-double" (a page twice, or a question twice on one),
            "votes-incomplete"; each names the file.
    """
    pages = {page.id: page for page in key.pages}
    raters: list[Rater] = []
    file_of_page: dict[str, Path] = {}
    for path in paths:
        rater = _rater(path, key, pages)
        if (earlier := file_of_page.get(rater.page.id)) is not None:
            raise _refused(
                "votes-double", f"These are votes of the same page as {earlier}.", path, "rater"
            )
        file_of_page[rater.page.id] = path
        raters.append(rater)
    return raters


def _rater(path: Path, key: Key, pages: dict[str, KeyPage]) -> Rater:
    file = _read(path)
    if file.study != key.study:
        raise _refused("votes-foreign", "These votes are of another study.", path, "study")
    if file.page not in pages:
        what = f"The study has no page {file.page[:40]!r}."
        raise _refused("votes-unknown-page", what, path, "study")
    page = pages[file.page]
    items = {item.id: item for item in page.items}
    answered: set[str] = set()
    for answer in file.answers:
        if answer.item not in items:
            what = f"Its page has no pair {answer.item[:40]!r}."
            raise _refused("votes-unknown-pair", what, path, "study")
        if answer.item in answered:
            what = f"The pair {answer.item!r} is answered twice."
            raise _refused("votes-double", what, path, "file")
        answered.add(answer.item)
    if len(answered) < len(items):
        what = f"{len(items) - len(answered)} of {len(items)} pairs have no answer."
        raise _refused("votes-incomplete", what, path, "file")
    votes = tuple(Vote(items[a.item], a.choice) for a in file.answers)
    return Rater(path.name, page, votes)


def _read(path: Path) -> VoteFile:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise _refused("votes-damaged", "The file is far too large for votes.", path, "file")
        return VoteFile.model_validate_json(path.read_bytes())
    except OSError as error:
        what = f"It cannot be read: {in_words(error)}."
        raise _refused("votes-damaged", what, path, "file") from error
    except ValidationError as error:
        where, problem = first_problem(error.errors())
        what = f"These are no votes, or they are damaged: {f'{where}: ' * bool(where)}{problem}."
        raise _refused("votes-damaged", what, path, "file") from error


def _refused(code: str, what: str, path: Path, concern: str) -> InputError:
    fixes = {
        "file": "Ask the rater for the file that the page saved, or leave it out.",
        "study": "Leave it out, or analyse it with the study it belongs to.",
        "rater": "Keep one of the two: each page is for one person.",
    }
    return InputError(code, what, where=str(path), fix=fixes[concern])
