"""The names that a script imports from capture_app: all there, described, and cheap to import."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import capture_app
from tests.conftest import REPO

_FILE = REPO / "capture_app" / "__init__.py"
_HEAVY = (
    "torch",
    "numpy",
    "scipy",
    "trimesh",
    "pydantic",
    "typer",
    "ingest",
    "omomo_core",
    "render",
)


def imported_for_type_checkers() -> Iterator[tuple[str, str]]:
    """Name and module of each import of the file that only a type checker sees."""
    for node in ast.walk(ast.parse(_FILE.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in (
            "capture_app",
            "ingest",
            "omomo_core",
            "render",
        ):
            yield from ((item.name, str(node.module)) for item in node.names)


@pytest.mark.parametrize("name", capture_app.__all__)
def test_a_name_is_there_and_described(name: str):
    value = getattr(capture_app, name)
    assert value.__name__ == name
    # A dataclass without a docstring is given its signature for one.
    assert value.__doc__
    assert not value.__doc__.startswith(f"{name}(")


def test_type_checkers_see_the_same_names_at_the_same_places():
    assert dict(imported_for_type_checkers()) == capture_app._HOME
    assert sorted(capture_app._HOME) == sorted(capture_app.__all__)


def test_no_module_of_the_package_hides_a_name():
    modules = {path.stem for path in _FILE.parent.iterdir()}
    assert modules & set(capture_app.__all__) == set()


def test_all_names_are_listed_for_completion():
    assert set(capture_app.__all__) <= set(dir(capture_app))


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match=r"capture_app.*run_it"):
        _ = capture_app.run_it
    with pytest.raises(ImportError, match="run_it"):
        exec("from capture_app import run_it")


@pytest.mark.parametrize("line", ["import capture_app", "import capture_app; dir(capture_app)"])
def test_the_import_brings_nothing_heavy(line: str, tmp_path: Path):
    code = f"{line}; import sys; print([name for name in {_HEAVY} if name in sys.modules])"
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(REPO)!r}); {code}"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.strip() == "[]"
