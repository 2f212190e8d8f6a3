"""What several pages begin with: a recorded take and a motion that was made of it."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from capture_app.simulator.demo_take import DEMO
from tests.conftest import WriteClip
from tests.docs.hurry import write_shim
from tests.docs.inputs import Given
from tests.docs.preloaded import preloaded as running
from tests.docs.running import copy, environment
from tests.once import once


@pytest.fixture(scope="session")
def preloaded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The socket of a process whose children run the commands of pages."""
    with running(tmp_path_factory.mktemp("preloaded"), environment()) as address:
        yield address


@pytest.fixture(scope="session")
def motion(tmp_path_factory: pytest.TempPathFactory, preloaded: Path) -> Path:
    """The result folder of the take that comes with the program, as quickly as it can be made."""

    def make(folder: Path) -> Path:
        write_shim(folder / "omocap", preloaded)
        given = ["--object", DEMO / "box.obj", "--mount", DEMO / "mount.json"]
        command = [folder / "omocap", "run", DEMO / "session", *given, "-o", folder / "motion"]
        subprocess.run([str(word) for word in command], check=True, capture_output=True)
        return folder / "motion"

    return once(tmp_path_factory, "page_motion", make)


@pytest.fixture
def given(
    tmp_path: Path, motion: Path, write_clip: WriteClip, request: pytest.FixtureRequest
) -> Given:
    """The folder in which a page's commands are typed, and what may be put there."""
    folder = tmp_path / "place"
    folder.mkdir()

    def clip(name: str, at: Path) -> None:
        write_clip(name)
        copy(tmp_path / f"{name}.npz", at / f"{name}.npz")
        copy(tmp_path / "meshes", at / "meshes")

    return Given(folder, motion, clip, lambda: request.getfixturevalue("shared"))
