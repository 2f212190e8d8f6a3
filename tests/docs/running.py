"""Running all shell blocks of one page in its order, in one shell, in a folder of its own."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from tests.conftest import REPO
from tests.docs.hurry import write_shim
from tests.docs.pages import blocks

PYTHON = sys.executable


@dataclass(frozen=True)
class Stage:
    """What is prepared for a page."""

    before: dict[int, str] = field(default_factory=dict)
    """Shell lines by the number of the block (from 0, of those that are run) before which they run:
    what happens between two blocks beside the program, such as people who send their votes."""
    instead: dict[str, str] = field(default_factory=dict)
    """Addresses of this machine that are taken, and which are used."""
    seconds: float = 280.0
    """That the page may take."""


def run_page(page: str, folder: Path, stage: Stage, preloaded: Path | None = None) -> None:
    """Run a page's shell blocks in order; the first command that fails fails the test.

    Commands are children of the preloaded process of this socket, or interpreters of their own.
    """
    write_shim(folder.parent / "bin" / "omocap", preloaded)
    script = folder.parent / "page.sh"
    script.write_text(_script(page, stage))
    home = folder.parent / "home"
    home.mkdir(exist_ok=True)
    env = {
        **environment(),
        "PATH": f"{folder.parent / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(home),
    }
    done = subprocess.run(
        ["bash", "-ex", str(script)],
        cwd=folder,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=stage.seconds,
    )
    assert done.returncode == 0, f"{page} stopped in the middle:\n{done.stdout[-4000:]}"


def environment() -> dict[str, str]:
    """Environment variables of commands on pages."""
    ours = {"PYTHONPATH": str(REPO), "COLUMNS": "200", "OMP_NUM_THREADS": "1"}
    return {**os.environ, **ours}


def _script(page: str, stage: Stage) -> str:
    parts = []
    for number, block in enumerate(b for b in blocks(page) if b.shell and b.reason is None):
        parts += [f": {page}:{block.line}", stage.before.get(number, ""), block.text]
    text = "\n".join(parts)
    for address, free in stage.instead.items():
        text = text.replace(address, free)
    return text + "\n"


def copy(source: Path, target: Path) -> Path:
    """A file or a folder under another name; folders on the way are made."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target)
    else:
        shutil.copy(source, target)
    return target
