"""Step and Recipe: what a person does for one way of calibrating, and what is known so far."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from capture_app.calibration.guide.prompt import Prompt
from ingest.calibration.board.board_spec import Board
from ingest.calibration.phone_body import Phone
from ingest.session import CaptureSession
from omomo_core.motion import ObjectMesh

Words = list[str]
"""Of a command line."""


@dataclass
class GuideState:
    """What the steps so far have found; later steps, and later ways, build on it."""

    folder: Path
    """For what the guide writes."""
    run: Callable[[Sequence[str]], None]
    """Runs a command of `omocap calibrate`."""
    mesh_file: Path | None = None
    mesh: ObjectMesh | None = None
    session_file: Path | None = None
    session: CaptureSession | None = None
    board: Board | None = None
    phone: Phone | None = None
    typed: dict[str, str] = field(default_factory=dict[str, str])
    """Answers that are offered again when their step is done once more, by what was asked."""

    @property
    def object_mesh(self) -> ObjectMesh:
        """The object's mesh, which every recipe asks for first."""
        assert self.mesh is not None
        return self.mesh

    @property
    def printed(self) -> Board:
        """The board, of a recipe that asks for one."""
        assert self.board is not None
        return self.board

    @property
    def model(self) -> Phone:
        """The phone, of a recipe that asks for its model."""
        assert self.phone is not None
        return self.phone

    @property
    def log(self) -> CaptureSession:
        """The recording, of a recipe that asks for one."""
        assert self.session is not None
        return self.session

    def fresh(self, name: str) -> Path:
        """A file of this name, or numbered if there is one: nothing is overwritten."""
        path, number = self.folder / name, 2
        while path.exists():
            path = self.folder / f"{Path(name).stem}-{number}{Path(name).suffix}"
            number += 1
        return path


class AgainError(Exception):
    """The person does not take what they gave: the step is asked once more."""


@dataclass(frozen=True)
class GuideStep:
    """One thing to do, which ends with an answer that is checked at once."""

    title: str
    do: tuple[str, ...]
    """What to do, one thing each, in plain words; nothing where the question says it all."""
    ask: Callable[[Prompt, GuideState], Words]
    """Asks for what came of it and checks that; returns its words of the command line.

    Raises InputError or AgainError when it is to be asked again.
    """
    open: tuple[str, ...]
    """These words while it is not done."""


@dataclass(frozen=True)
class Recipe:
    """One way to calibrate."""

    key: str
    """Names it among all."""
    method: str
    """The command of `omocap calibrate`."""
    have: str
    """What one must have for it."""
    steps: tuple[GuideStep, ...]
