"""Talk: the guide asks and tells on a terminal, or on anything that has lines."""

import sys
from collections.abc import Callable, Sequence
from glob import glob
from pathlib import Path
from shlex import split
from typing import TypeVar

from rich.console import Console
from rich.table import Table
from rich.text import Text

from capture_app.calibration.guide.finding import Finding
from omomo_core.errors import InputError

_T = TypeVar("_T")
_YES, _NO = ("y", "yes"), ("n", "no")


class Prompt:
    """Questions to a person, and what they are told.

    The end of the input raises EOFError, Ctrl-C KeyboardInterrupt, wherever it comes.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._typed = sys.stdin.isatty()
        if self._typed:
            _complete_paths()

    def heading(self, text: str) -> None:
        """Begin a part."""
        self._console.print(f"\n{text}", style="bold", markup=False)

    def tell(self, text: str) -> None:
        """A paragraph."""
        self._console.print(text, markup=False)

    def numbered(self, rows: Sequence[str]) -> None:
        """Things to do or to choose from, numbered from 1."""
        table = Table.grid(padding=(0, 1))
        for number, row in enumerate(rows, start=1):
            table.add_row(Text(f"{number:>3}"), Text(row))
        self._console.print(table)

    def command(self, text: str) -> None:
        """A command line, in one line however long, so that it can be copied."""
        self._console.print(f"  {text}", style="cyan", markup=False, soft_wrap=True)

    def good(self, text: str) -> None:
        """What was found right."""
        self._label("Good: ", "bold green", text)

    def doubt(self, text: str) -> None:
        """What may be wrong."""
        self._label("But: ", "bold yellow", text)

    def problem(self, error: InputError) -> None:
        """What is wrong, where, and what to do about it."""
        where = f" ({error.where})" if error.where and not error.where.startswith("--") else ""
        self._label("No: ", "bold red", f"{error.what.rstrip('.')}{where}. {error.fix}")

    def accept(self, finding: Finding) -> bool:
        """Tell a finding; whether the person takes it, doubts or not."""
        self.good(finding.good)
        for note in finding.notes:
            self._label("Note: ", "bold", note)
        for doubt in finding.doubts:
            self.doubt(doubt)
        return not finding.doubts or self.yes("Take it all the same?", default=False)

    def ask(self, question: str, default: str | None = None) -> str:
        """One line of answer, without the blanks around it; the default where it is empty.

        Without a default the question is asked until there is an answer.
        """
        prompt = f"{question} [{default}]: " if default else f"{question}: "
        while True:
            answer = input(prompt).strip()
            if not self._typed:
                self._console.print(answer, markup=False)
            if answer or default is not None:
                return answer or default or ""

    def yes(self, question: str, *, default: bool) -> bool:
        """A question that is answered by yes or no."""
        prompt = f"{question} [{'Y/n' if default else 'y/N'}]"
        while True:
            answer = self.ask(prompt, default="").lower()
            if answer in (*_YES, *_NO, ""):
                return answer in _YES if answer else default
            self.doubt("Answer y or n.")

    def choose(self, question: str, rows: Sequence[str]) -> int:
        """One of several, numbered from 1; returns its place from 0."""
        return self.choose_some(question, rows, most=1)[0]

    def choose_some(self, question: str, rows: Sequence[str], most: int = 9) -> list[int]:
        """Some of several, numbered from 1, each once; returns their places from 0, as answered."""
        self.numbered(rows)
        while True:
            words = self.ask(question).replace(",", " ").split()
            chosen = list(dict.fromkeys(int(w) - 1 for w in words if w.isdecimal()))
            fits = all(0 <= k < len(rows) for k in chosen) and len(chosen) <= most
            if fits and len(chosen) == len(words) > 0:
                return chosen
            self.doubt(f"Answer with a number from 1 to {len(rows)}.")

    def path(self, question: str, default: Path | None = None) -> Path:
        """A file or folder, typed or dropped on the terminal."""
        return as_path(self.ask(question, str(default) if default else None))

    def maybe_path(self, question: str) -> Path | None:
        """As `path`; nothing where the answer is empty."""
        answer = self.ask(question, "")
        return as_path(answer) if answer else None

    def until_right(self, attempt: Callable[[], _T]) -> _T:
        """Try until it raises no InputError; each is told."""
        while True:
            try:
                return attempt()
            except InputError as error:
                self.problem(error)

    def _label(self, label: str, style: str, text: str) -> None:
        self._console.print(Text.assemble((label, style), text))


def as_path(text: str) -> Path:
    """The path of an answer, which may have the quotes and backslashes of a dropped file."""
    path = Path(text).expanduser()
    if path.exists():
        return path
    try:
        words = split(text)
    except ValueError:  # a quote that is not closed
        return path
    return Path(words[0]).expanduser() if len(words) == 1 else path


def _complete_paths() -> None:
    """Let the tab key complete file names, where the terminal can."""
    try:
        import readline
    except ImportError:
        return

    def complete(text: str, state: int) -> str | None:
        found = sorted(glob(f"{Path(text).expanduser()}{'/' if text.endswith('/') else ''}*"))
        return found[state] if state < len(found) else None

    readline.set_completer_delims("\n")
    readline.set_completer(complete)
    readline.parse_and_bind("tab: complete")
