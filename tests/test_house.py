"""The house stays as it was drawn: its size, its names, its arrows, and the first lines of its docstrings."""

import ast
import re
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import REPO

PACKAGES = ("capture_app", "ingest", "omomo_core", "render")
KINDS = {"cli", "commands", "formats"}
"""Folders that say what kind of thing a file holds, so that its name may stand elsewhere, too."""
LONGEST_FILE, LONGEST_FUNCTION = 600, 60
PASSED = 1.02
"""Part of its budget that a package may reach."""
NO_BEGINNING = re.compile(r"(Of|By|As|Not|For|Where)\b")
"""First words with which a docstring says neither what a thing is nor what it returns."""


@cache
def sources() -> dict[Path, str]:
    files = (path for room in PACKAGES for path in sorted((REPO / room).rglob("*.py")))
    return {path.relative_to(REPO): path.read_text(encoding="utf-8") for path in files}


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(sources()[path])


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_keeps_its_budget_of_lines(package: str):
    """Whoever raises a budget says in the commit what the lines buy."""
    budgets = tomllib.loads((REPO / "pyproject.toml").read_text())["tool"]["omocap"]["lines"]
    lines = sum(text.count("\n") for path, text in sources().items() if path.parts[0] == package)
    assert lines <= PASSED * budgets[package]


def test_what_a_package_holds_beside_its_code_is_installed_with_it():
    """Data of `omocap` itself, such as the page and the demo: setuptools takes what a pattern names."""
    kept = tomllib.loads((REPO / "pyproject.toml").read_text())["tool"]["setuptools"][
        "package-data"
    ]
    named = {
        path.relative_to(REPO)
        for package, patterns in kept.items()
        for pattern in patterns
        for folder in (PACKAGES if package == "*" else [package.replace(".", "/")])
        for path in (REPO / folder).glob(f"**/{pattern}" if package == "*" else pattern)
    }
    there = {
        path.relative_to(REPO)
        for package in PACKAGES
        for path in (REPO / package).rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc") and path.name[0] != "."
    }
    assert there - named == set()


def test_no_file_and_no_function_is_too_long():
    files = [path for path, text in sources().items() if text.count("\n") > LONGEST_FILE]
    functions = [
        f"{path}: {node.name}"
        for path in sources()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        if node.end_lineno is not None
        if node.end_lineno - node.lineno >= LONGEST_FUNCTION
    ]
    assert (files, functions) == ([], [])


def test_a_files_name_is_unique_in_its_package():
    named = Counter(
        (path.parts[0], path.name)
        for path in sources()
        if path.name != "__init__.py" and not KINDS & set(path.parts)
    )
    assert [name for name, count in named.items() if count > 1] == []


def test_modules_import_each_other_in_no_circle():
    modules = {".".join(path.with_suffix("").parts): path for path in sources()}
    graph = {name: set(_imported(path, modules)) for name, path in modules.items()}
    while bottom := {name for name, needed in graph.items() if not needed & graph.keys()}:
        graph = {name: needed for name, needed in graph.items() if name not in bottom}
    assert sorted(graph) == []


def _imported(path: Path, modules: dict[str, Path]) -> Iterator[str]:
    """Modules that a module imports, inside of functions too."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in modules else node.module


def test_docstrings_say_what_a_thing_is():
    vague: defaultdict[str, list[str]] = defaultdict(list)
    for path in sources():
        for node in ast.walk(tree(path)):
            body = getattr(node, "body", None)
            for statement in body if isinstance(body, list) else ():
                if (text := _words(statement)) and NO_BEGINNING.match(text):
                    vague[str(path)].append(text.splitlines()[0])
    assert vague == {}


def _words(statement: ast.stmt) -> str:
    """The text of a docstring, of a module, class, function or value; "" for other statements."""
    value = statement.value if isinstance(statement, ast.Expr) else None
    text = value.value if isinstance(value, ast.Constant) else None
    return text.strip() if isinstance(text, str) else ""
