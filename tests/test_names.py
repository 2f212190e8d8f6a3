"""One name has one meaning: no public class name is defined twice in what the project ships or runs."""

import ast
from collections import defaultdict

from tests.conftest import REPO

ROOMS = ("omomo_core", "ingest", "render", "capture_app", "benchmarks", "examples", "tools")


def owners() -> dict[str, list[str]]:
    """Modules that define each public top-level class."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for room in ROOMS:
        for path in sorted((REPO / room).rglob("*.py")):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(str(path.relative_to(REPO)))
    return found


def test_no_public_class_name_is_defined_twice():
    assert {name: files for name, files in owners().items() if len(files) > 1} == {}


def test_the_classes_of_the_rooms_are_found():
    assert owners()["ObjectMotion"] == ["omomo_core/motion.py"]
