"""The commands of the command line, and the tests that are marked to call them."""

import ast
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import typer

from capture_app.cli.app import app

TESTS = Path(__file__).resolve().parent


def commands() -> dict[str, Any]:
    """All commands that do something, by the words that call them, e.g. "calibrate board"."""
    return dict(_leaves(typer.main.get_command(app), ()))


def _leaves(command: Any, words: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    inner = getattr(command, "commands", None)
    if inner is None:
        yield " ".join(words), command
        return
    for name, child in inner.items():
        yield from _leaves(child, (*words, name))


def callback_of(command: Any) -> Callable[..., object]:
    """The function behind a command, whichever application it hangs in."""
    return inspect.unwrap(command.callback)


def marked_tests() -> dict[str, list[str]]:
    """Fast tests by the command that they are marked to run."""
    found: dict[str, list[str]] = {}
    for file in sorted(TESTS.rglob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                marks = [ast.unparse(mark) for mark in node.decorator_list]
                if "pytest.mark.slow" in marks:
                    continue
                for mark in node.decorator_list:
                    if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.runs":
                        command = ast.literal_eval(mark.args[0])
                        found.setdefault(command, []).append(f"{file.name}::{node.name}")
    return found
