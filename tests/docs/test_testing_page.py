"""docs/testing.md lists the slow tests that there are, and no others."""

import ast
import re
from pathlib import Path

from tests.conftest import REPO
from tests.docs.pages import text_of

_ROW = re.compile(r"^\| `(tests/[^`]+\.py::\w+)` \| [^|]+ \|[^|]*\|[^|]*\|$", re.MULTILINE)


def slow_in(text: str) -> set[str]:
    """Names of the tests of a file that are slow, or are so for some of their parameters."""
    tree = ast.parse(text)
    # Marks that have a name of their own, such as `every_size = pytest.mark.parametrize(...)`.
    named = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign) and _slow(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    return {
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and node.name.startswith("test_")
        and any(_slow(mark) or ast.unparse(mark) in named for mark in node.decorator_list)
    }


def _slow(mark: ast.expr) -> bool:
    return "pytest.mark.slow" in ast.unparse(mark)


def _name(path: Path) -> str:
    return path.relative_to(REPO).as_posix()


def test_each_slow_test_is_listed_once():
    files = sorted((REPO / "tests").rglob("test_*.py"))
    there = {f"{_name(file)}::{name}" for file in files for name in slow_in(file.read_text())}
    listed = _ROW.findall(text_of("docs/testing.md"))
    assert len(listed) == len(set(listed))
    assert sorted(there - set(listed)) == []
    assert sorted(set(listed) - there) == []


def test_slow_tests_are_found():
    text = "@pytest.mark.slow\ndef test_a(): ...\n@pytest.mark.parametrize('x', [1, pytest.param("
    text += "2, marks=pytest.mark.slow)])\ndef test_b(x): ...\ndef test_c(): ...\n"
    text += "some = pytest.mark.slow\n@some\ndef test_d(): ...\n"
    assert slow_in(text) == {"test_a", "test_b", "test_d"}
