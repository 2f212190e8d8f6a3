"""Links, pictures, paths and modules that pages and docstrings name are there."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import REPO
from tests.docs.pages import markdown, prose, spans, text_of

_ROOMS = "capture_app|ingest|omomo_core|render|tests|benchmarks|tools|examples"
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_PATH = re.compile(rf"(?<![\w/.])((?:{_ROOMS}|docs)/[\w/.\-]*\w/?)")
_MODULE = re.compile(rf"(?<![\w/.])((?:{_ROOMS})(?:\.[A-Za-z_]\w*)+)")
_FILE = re.compile(r"^[\w/\-]+\.(?:py|sh)$")
_SOURCES = [
    path for room in _ROOMS.split("|") for path in sorted((REPO / room).rglob("*.py"))
]  # fmt: skip
_NAMES = {path.name for path in _SOURCES} | {path.name for path in REPO.rglob("tools/*.sh")}


def missing_links(page: str, text: str) -> list[str]:
    """Links of a page to files or headings that are not there."""
    found = []
    for link in _LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, heading = link.partition("#")
        target = (REPO / page).parent / path if path else REPO / page
        if not target.exists() or (heading and heading not in _headings(target)):
            found.append(link)
    return found


def _headings(page: Path) -> set[str]:
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def missing_names(text: str) -> list[str]:
    """Paths, source files and modules that a text names and that are not there."""
    paths = [path for path in _PATH.findall(text) if not (REPO / path).exists()]
    modules = [name for name in _MODULE.findall(text) if not _there(name)]
    files = [span for span in spans(text) if _FILE.match(span) and not _file(span)]
    files = [name for name in files if name not in paths]
    return [*paths, *modules, *files]


def _there(name: str) -> bool:
    """Whether a dotted name is a file, a module, or something in a module; nothing is imported."""
    stem, _, ending = name.rpartition(".")
    if (REPO / f"{stem.replace('.', '/')}.{ending}").exists():
        return True
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        path = REPO.joinpath(*parts[:k])
        if path.is_dir() and k == len(parts):
            return True
        module = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if module.exists():
            return _defined(ast.parse(module.read_text(encoding="utf-8")).body, parts[k:])
    return False


def _defined(body: list[ast.stmt], names: list[str]) -> bool:
    """Whether a body defines a name, and that what follows it."""
    if not names:
        return True
    for node in body:
        match node:
            case ast.ClassDef() if node.name == names[0]:
                return _defined(node.body, names[1:])
            case ast.FunctionDef() | ast.AsyncFunctionDef() if node.name == names[0]:
                return len(names) == 1
            case ast.Assign() | ast.AnnAssign():
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                if names[0] in {
                    x.id for t in targets for x in ast.walk(t) if isinstance(x, ast.Name)
                }:
                    return True
            case ast.Import() | ast.ImportFrom():
                if names[0] in {(item.asname or item.name) for item in node.names}:
                    return True
            case ast.If() if _defined(node.body, names):  # what only a type checker imports
                return True
            case _:
                pass
    return False


def _file(name: str) -> bool:
    if "/" in name:
        return (REPO / name).exists() or any(str(path).endswith(f"/{name}") for path in _SOURCES)
    return name in _NAMES


def _docstrings(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield ast.get_docstring(node) or ""
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield str(node.value.value)


@pytest.mark.parametrize("page", markdown())
def test_a_page_leads_nowhere_that_is_not_there(page: str):
    assert missing_links(page, prose(page)) == []
    assert missing_names(text_of(page)) == []


@pytest.mark.parametrize("room", _ROOMS.split("|"))
def test_docstrings_name_what_is_there(room: str):
    missing = {
        str(path.relative_to(REPO)): gone
        for path in sorted((REPO / room).rglob("*.py"))
        if (gone := missing_names("\n\n".join(_docstrings(path))))
    }
    assert missing == {}


def test_what_is_not_there_is_found():
    assert missing_links("docs/scan.md", "[a](nowhere.md) [b](scan.md#limits) [c](#none)") == [
        "nowhere.md",
        "#none",
    ]
    text = "`ingest/nowhere.py` ingest.types_of.nothing `fancy_file.py` ingest.errors_x"
    assert missing_names(text) == [
        "ingest/nowhere.py", "ingest.types_of.nothing", "ingest.errors_x", "fancy_file.py"
    ]  # fmt: skip
    assert missing_names("`docs/scan.md` ingest.calibration.phone_body.body_point `load.py`") == []
