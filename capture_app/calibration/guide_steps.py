"""The steps of a guided calibration, the prompt that asks for them, and what a mount says in words."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path
from shlex import split
from typing import NamedTuple, TypeVar

import igl
import numpy as np
from jaxtyping import Float64
from rich.console import Console
from rich.table import Table
from rich.text import Text

from capture_app.commands.spelling import in_options
from ingest.calibration.board.board_spec import Board
from ingest.calibration.drawn_mount import body_of_camera
from ingest.calibration.phone_body import Phone
from ingest.mount import Mount
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh


class Finding(NamedTuple):
    """Data that can be used; what cannot be used is an InputError instead."""

    good: str
    """What it is, in one line."""
    doubts: tuple[str, ...] = ()
    """What may spoil the result, each with how to do it better: the person decides."""
    notes: tuple[str, ...] = ()
    """What is worth knowing."""


def both(first: Finding, second: Finding) -> Finding:
    """Return two findings about the same recording joined into one."""
    return Finding(
        f"{first.good}, {second.good}", first.doubts + second.doubts, first.notes + second.notes
    )


_T = TypeVar("_T")
_YES, _NO = ("y", "yes"), ("n", "no")


class Prompt:
    """Questions to a person, and what they are told.

    The end of the input raises EOFError, Ctrl-C KeyboardInterrupt, wherever it comes.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._typed = sys.stdin.isatty()
        if self._typed:
            _complete_paths()

    def heading(self, text: str) -> None:
        """Begin a part."""
        self._console.print(f"\n{text}", style="bold", markup=False)

    def tell(self, text: str) -> None:
        """A paragraph."""
        self._console.print(in_options(text), markup=False)

    def numbered(self, rows: Sequence[str]) -> None:
        """Things to do or to choose from, numbered from 1."""
        table = Table.grid(padding=(0, 1))
        for number, row in enumerate(rows, start=1):
            table.add_row(Text(f"{number:>3}"), Text(row))
        self._console.print(table)

    def command(self, text: str) -> None:
        """A command line, in one line however long, so that it can be copied."""
        self._console.print(f"  {text}", style="cyan", markup=False, soft_wrap=True)

    def good(self, text: str) -> None:
        """Tell what is right."""
        self._label("Good: ", "bold green", text)

    def doubt(self, text: str) -> None:
        """Tell what may be wrong."""
        self._label("But: ", "bold yellow", text)

    def problem(self, error: InputError) -> None:
        """Tell what is wrong, where, and what to do about it."""
        where = f" ({error.where})" if error.where and not error.where.startswith("‹") else ""
        self._label("No: ", "bold red", f"{error.what.rstrip('.')}{where}. {error.fix}")

    def accept(self, finding: Finding) -> bool:
        """Tell a finding; whether the person takes it, doubts or not."""
        self.good(finding.good)
        for note in finding.notes:
            self._label("Note: ", "bold", note)
        for doubt in finding.doubts:
            self.doubt(doubt)
        return not finding.doubts or self.yes("Take it all the same?", default=False)

    def ask(self, question: str, default: str | None = None) -> str:
        """One line of answer, without the blanks around it; the default where it is empty.

        Without a default the question is asked until there is an answer.
        """
        prompt = f"{question} [{default}]: " if default else f"{question}: "
        while True:
            answer = input(prompt).strip()
            if not self._typed:
                self._console.print(answer, markup=False)
            if answer or default is not None:
                return answer or default or ""

    def yes(self, question: str, *, default: bool) -> bool:
        """A question that is answered by yes or no."""
        prompt = f"{question} [{'Y/n' if default else 'y/N'}]"
        while True:
            answer = self.ask(prompt, default="").lower()
            if answer in (*_YES, *_NO, ""):
                return answer in _YES if answer else default
            self.doubt("Answer y or n.")

    def choose(self, question: str, rows: Sequence[str]) -> int:
        """One of several, numbered from 1; returns its place from 0."""
        return self.choose_some(question, rows, most=1)[0]

    def choose_some(self, question: str, rows: Sequence[str], most: int = 9) -> list[int]:
        """Some of several, numbered from 1, each once; returns their places from 0, as answered."""
        self.numbered(rows)
        while True:
            words = self.ask(question).replace(",", " ").split()
            chosen = list(dict.fromkeys(int(w) - 1 for w in words if w.isdecimal()))
            fits = all(0 <= k < len(rows) for k in chosen) and len(chosen) <= most
            if fits and len(chosen) == len(words) > 0:
                return chosen
            self.doubt(f"Answer with a number from 1 to {len(rows)}.")

    def path(self, question: str, default: Path | None = None) -> Path:
        """A file or folder, typed or dropped on the terminal."""
        return as_path(self.ask(question, str(default) if default else None))

    def maybe_path(self, question: str) -> Path | None:
        """Ask for a path as `path` does; nothing where the answer is empty."""
        answer = self.ask(question, "")
        return as_path(answer) if answer else None

    def until_right(self, attempt: Callable[[], _T]) -> _T:
        """Try until it raises no InputError; each is told."""
        while True:
            try:
                return attempt()
            except InputError as error:
                self.problem(error)

    def _label(self, label: str, style: str, text: str) -> None:
        self._console.print(Text.assemble((label, style), in_options(text)))


def as_path(text: str) -> Path:
    """The path of an answer, which may have the quotes and backslashes of a dropped file."""
    path = Path(text).expanduser()
    if path.exists():
        return path
    try:
        words = split(text)
    except ValueError:  # a quote that is not closed
        return path
    return Path(words[0]).expanduser() if len(words) == 1 else path


def _complete_paths() -> None:
    """Let the tab key complete file names, where the terminal can."""
    try:
        import readline
    except ImportError:
        return

    def complete(text: str, state: int) -> str | None:
        files = sorted(glob(f"{Path(text).expanduser()}{'/' if text.endswith('/') else ''}*"))
        return files[state] if state < len(files) else None

    readline.set_completer_delims("\n")
    readline.set_completer(complete)
    readline.parse_and_bind("tab: complete")


Words = list[str]
"""Words of a command line."""


@dataclass
class GuideState:
    """What the steps so far have found; later steps, and later ways, build on it."""

    folder: Path
    """Folder for what the guide writes."""
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


_OBLIQUE = np.radians(25.0)
"""Off an axis by more, a direction is said to lie between two."""


def where_it_sits(mount: Mount, mesh: ObjectMesh) -> str:
    """The phone by the object's own axes.

    Args:
        mount: of the phone.
        mesh: of the object, in metres: the mount's `object_scale` is in it already.
    """
    T_object_phone = inverse(mount.T_phone_object)
    place = T_object_phone[:3, 3]
    R_object_body = body_of_camera(T_object_phone[:3, :3])
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    reach = np.ptp(mesh.vertices, axis=0) / 2
    side = (place - middle) / np.maximum(reach, 1e-3)
    axis = int(np.abs(side).argmax())
    x, y, z = 100 * place
    return (
        f"the lens is on the object's {_named(np.sign(side[axis]) * np.eye(3)[axis])} side, "
        f"{100 * off_surface(mesh, place[None])[0]:.0f} cm from its surface, at x {x:.0f}, y {y:.0f}, "
        f"z {z:.0f} cm; the screen faces {_named(R_object_body[:, 2])}, the top edge points "
        f"{_named(R_object_body[:, 1])}"
    )


def off_surface(mesh: ObjectMesh, points: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, " n"]:
    """Return the distances of points from the object's surface, metres."""
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distances = igl.signed_distance(points, vertices, faces, sign_type=kind)[0]
    return np.abs(np.asarray(distances, np.float64)).reshape(-1)


def astray(
    mesh: ObjectMesh, names: Sequence[str], points: Float64[np.ndarray, "n 3"], far: float
) -> tuple[str, ...]:
    """A doubt about the point that is farthest from the surface, if that is far.

    Args:
        mesh: of the object.
        names: of the points.
        points: in the object's frame, metres.
        far: metres.
    """
    off = off_surface(mesh, points)
    worst = int(off.argmax())
    if off[worst] < far:
        return ()
    return (
        f"'{names[worst]}' is {100 * off[worst]:.0f} cm from the mesh's surface. Measure in the "
        "mesh's own axes, in metres: Blender, for one, turns an OBJ on import unless you choose Y "
        "forward and Z up.",
    )


def _named(direction: Float64[np.ndarray, "3"]) -> str:
    """The nearest axis with its sign, or the two nearest."""
    order = np.argsort(-np.abs(direction))
    names = [f"{'-' if direction[k] < 0 else '+'}{'xyz'[k]}" for k in order[:2]]
    if np.arccos(np.abs(direction[order[0]]).clip(0, 1)) < _OBLIQUE:
        return names[0]
    return f"between {names[0]} and {names[1]}"
