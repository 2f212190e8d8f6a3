"""`./run`: what README says first, and that nothing is installed twice."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import REPO
from tests.docs.hurry import write_shim
from tests.docs.inputs import Given
from tests.docs.running import Stage, run_page

DEV, PLAIN = ".installed[dev]", ".installed"


def stand_in(folder: Path) -> Path:
    """A copy of the script with an environment that has our command, and a pip that only notes."""
    shutil.copy(REPO / "run", folder / "run")
    for name in ("pyproject.toml", "constraints.txt"):
        (folder / name).symlink_to(REPO / name)
    write_shim(folder / ".venv" / "bin" / "omocap")
    pip = folder / ".venv" / "bin" / "pip"
    pip.write_text('#!/bin/sh\necho "$@" >> installed\n')
    pip.chmod(0o755)
    return folder


def stamp(folder: Path, name: str, text: str | None = None) -> None:
    """What the script leaves when it has installed."""
    files = [str(REPO / name) for name in ("pyproject.toml", "constraints.txt")]
    both = subprocess.run(["cat", *files], capture_output=True, check=True).stdout
    sum_ = subprocess.run(["cksum"], input=both, capture_output=True, check=True).stdout.decode()
    (folder / ".venv" / name).write_text(sum_ if text is None else text)


def run(folder: Path, *words: str) -> str:
    """What was installed by the script."""
    subprocess.run(["./run", *words], cwd=folder, capture_output=True, check=False)
    noted = folder / "installed"
    return noted.read_text() if noted.exists() else ""


@pytest.mark.parametrize("name", [DEV, PLAIN])
def test_what_is_installed_is_not_installed_again(tmp_path: Path, name: str):
    stamp(stand_in(tmp_path), name)
    assert run(tmp_path, "formats") == ""


def test_what_is_missing_is_installed(tmp_path: Path):
    stand_in(tmp_path)
    assert run(tmp_path, "formats").endswith("-e .\n")
    assert run(tmp_path, "formats").count("\n") == 1
    assert run(tmp_path, "test").endswith("-e .[dev]\n")


def test_other_dependencies_are_installed(tmp_path: Path):
    stamp(stand_in(tmp_path), DEV, "1 2\n")
    stamp(tmp_path, PLAIN, "1 2\n")
    assert run(tmp_path, "formats").endswith("-e .\n")


def test_the_blocks_of_the_readme(given: Given):
    stamp(stand_in(given.place), DEV)
    run_page("README.md", given.place, Stage())
    assert (given.place / "out" / "demo" / "motion.mp4").is_file()
    assert not (given.place / "installed").exists()
