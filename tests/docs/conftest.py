"""What several pages begin with: a recorded take and a motion that was made of it."""

import subprocess
from pathlib import Path

import pytest

from capture_app.simulator.demo_take import DEMO
from tests.conftest import WriteClip
from tests.docs.hurry import write_shim
from tests.docs.inputs import Given
from tests.docs.running import copy


@pytest.fixture(scope="session")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result folder of the take that comes with the program, as quickly as it can be made."""
    folder = tmp_path_factory.mktemp("motion")
    write_shim(folder / "omocap")
    given = ["--object", DEMO / "box.obj", "--mount", DEMO / "mount.json"]
    command = [folder / "omocap", "run", DEMO / "session", *given, "-o", folder / "chair_motion"]
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    return folder / "chair_motion"


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
