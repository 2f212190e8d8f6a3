"""`./run`: what README says first, and that nothing is installed twice."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import REPO
from tests.docs.hurry import write_shim
from tests.docs.inputs import Given
from tests.docs.running import Stage, run_page

DEV, PLAIN = ".installed[dev]", ".installed"
PIP = """#!/bin/sh
case "$*" in
list*) cat torch 2>/dev/null ;;
*) echo "$@" >> installed ;;
esac
case "$*" in *+cpu) ! [ -f unseen ] ;; esac
"""
"""Lists the file "torch", and cannot find the CPU build of PyTorch where there is a file "unseen"."""


@pytest.fixture(autouse=True)
def without_gpu(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("OMOCAP_TORCH", "cpu")


def stand_in(folder: Path) -> Path:
    """A copy of the script with an environment that has our command, and a pip that only notes."""
    shutil.copy(REPO / "run", folder / "run")
    for name in ("pyproject.toml", "constraints.txt"):
        (folder / name).symlink_to(REPO / name)
    write_shim(folder / ".venv" / "bin" / "omocap")
    pip = folder / ".venv" / "bin" / "pip"
    pip.write_text(PIP)
    pip.chmod(0o755)
    return folder


def stamp(folder: Path, name: str, text: str | None = None) -> None:
    """What the script leaves when it has installed."""
    files = [str(REPO / name) for name in ("pyproject.toml", "constraints.txt")]
    both = subprocess.run(["cat", *files], capture_output=True, check=True).stdout
    sum_ = subprocess.run(["cksum"], input=both, capture_output=True, check=True).stdout.decode()
    (folder / ".venv" / name).write_text(f"{sum_.strip()} cpu\n" if text is None else text)


def run(folder: Path, *words: str, says: str = "") -> str:
    """What was installed by the script."""
    done = subprocess.run(
        ["./run", *words], cwd=folder, capture_output=True, check=False, text=True
    )
    assert says in done.stderr
    noted = folder / "installed"
    return noted.read_text() if noted.exists() else ""


@pytest.mark.parametrize("name", [DEV, PLAIN])
def test_what_is_installed_is_not_installed_again(tmp_path: Path, name: str):
    stamp(stand_in(tmp_path), name)
    assert run(tmp_path, "formats") == ""


def test_what_is_missing_is_installed(tmp_path: Path):
    stand_in(tmp_path)
    first, second = run(tmp_path, "formats").splitlines()
    assert first.endswith(f"{torch_line()}+cpu")
    assert second.endswith("-e .")
    assert run(tmp_path, "formats").count("\n") == 2
    assert run(tmp_path, "test").endswith("-e .[dev]\n")


def torch_line() -> str:
    lines = (REPO / "constraints.txt").read_text().splitlines()
    return next(line for line in lines if line.startswith("torch=="))


def test_a_cpu_build_that_pip_cannot_see_is_told_of(tmp_path: Path):
    stand_in(tmp_path)
    (tmp_path / "unseen").touch()
    assert run(tmp_path, "formats", says="PIP_EXTRA_INDEX_URL").endswith("-e .\n")


def test_the_cuda_build_takes_the_place_of_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("OMOCAP_TORCH", "cuda")
    (stand_in(tmp_path) / "torch").write_text(f"{torch_line()}+cpu\n")
    first, second = run(tmp_path, "formats").splitlines()
    assert first == "uninstall --quiet --yes torch"
    assert second.endswith("-e .")


def test_other_dependencies_are_installed(tmp_path: Path):
    stamp(stand_in(tmp_path), DEV, "1 2\n")
    stamp(tmp_path, PLAIN, "1 2\n")
    assert run(tmp_path, "formats").endswith("-e .\n")


@pytest.mark.runs("demo", elsewhere=True)
def test_the_blocks_of_the_readme(given: Given):
    stamp(stand_in(given.place), DEV)
    run_page("README.md", given.place, Stage())
    demo = given.place / "out" / "demo"
    assert json.loads((demo / "manifest.json").read_text())["faults"] == []
    assert (demo / "motion.glb").stat().st_size > 1e6
    assert (demo / "motion.mp4").is_file()
    assert not (given.place / "installed").exists()
