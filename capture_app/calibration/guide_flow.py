"""The guide: from what a person has to a recipe, through its steps, to the mount and what comes after it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from shlex import join

from capture_app.calibration import guide_phone_steps as files
from capture_app.calibration import guide_recordings as record
from capture_app.calibration.guide_phone_steps import (
    BOARD_PLACE,
    DRAWN_PLACE,
    DRAWN_TURN,
    MODEL,
    PICKED,
    PRINT,
)
from capture_app.calibration.guide_steps import (
    AgainError,
    Finding,
    GuideState,
    GuideStep,
    Prompt,
    Recipe,
    where_it_sits,
)
from ingest.calibration.drawn_mount import numbers
from ingest.calibration.floor_contacts import find_contacts, flat_sides, standings, track
from ingest.calibration.posterior import TILT_IT
from ingest.formats.registry import read_session
from ingest.mesh import load_mesh
from ingest.mount import Mount
from ingest.mount_file import load_mount
from ingest.report.clamp_checks import mount_checks
from ingest.session import CaptureSession
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_TOOL = ("omocap", "calibrate")
_SURENESS = "mount's error"
"""The check of what has just been printed as bounds, and is told again at the end."""


def command_line(words: Sequence[str]) -> str:
    """Return a command of `omocap calibrate` as a person types or copies it."""
    return join([*_TOOL, *words])


class Wizard:
    """The steps of a recipe, what each has given to the command line, and the result."""

    def __init__(self, recipe: Recipe, output: Path, prompt: Prompt, state: GuideState) -> None:
        self._recipe, self._output = recipe, output
        self._prompt, self._state = prompt, state
        self._given: dict[GuideStep, list[str]] = {}
        self._found = False

    @property
    def words(self) -> list[str]:
        """The command line, with capitals for what is not known yet; once run, a look at its result."""
        if self._found:
            return ["show", str(self._output)]
        parts = [self._given.get(step, step.open) for step in self._recipe.steps]
        flat = [word for part in parts for word in part]
        return [self._recipe.method, *flat, "-o", str(self._output)]

    def go(self) -> Mount:
        """Do all steps, and those again that turn out wrong, until there is a mount."""
        for number, step in enumerate(self._recipe.steps, start=1):
            self._do(step, f"{number} of {len(self._recipe.steps)}: ")
        mount = self._result()
        return self._until_found() if mount is None else mount

    def again(self, output: Path) -> Mount:
        """Do a step again whose mount was found, but is not right; the new one goes elsewhere."""
        self._output, self._found = output, False
        return self._until_found()

    def _until_found(self) -> Mount:
        while True:
            names = [step.title for step in self._recipe.steps]
            chosen = self._prompt.choose("Which step do you want to do again?", names)
            del self._given[self._recipe.steps[chosen]]
            self._do(self._recipe.steps[chosen], "Again: ")
            if (mount := self._result()) is not None:
                return mount

    def _do(self, step: GuideStep, number: str) -> None:
        self._prompt.heading(f"{number}{step.title}")
        if len(step.do) == 1:
            self._prompt.tell(step.do[0])
        elif step.do:
            self._prompt.numbered(step.do)
        while step not in self._given:
            try:
                self._given[step] = self._prompt.until_right(
                    lambda: step.ask(self._prompt, self._state)
                )
            except AgainError:
                self._prompt.tell("Once more, then.")

    def _result(self) -> Mount | None:
        """The mount, if the command finds one and the person believes it."""
        self._prompt.heading("The mount")
        words = self.words
        self._prompt.command(command_line(words))
        try:
            self._state.run(words)
        except InputError as error:
            self._prompt.problem(error)
            return None
        self._found = True
        mount = load_mount(self._output)
        if self._believed(mount):
            return mount
        for name in filter(None, (self._output.name, mount.picture)):
            self._output.with_name(name).unlink(missing_ok=True)
        self._found = False
        self._prompt.tell(f"{self._output} is taken away again.")
        return None

    def _believed(self, mount: Mount) -> bool:
        assert self._state.mesh_file is not None
        mesh = load_mesh(self._state.mesh_file, scale=mount.object_scale)
        look = f" Look at {self._output.with_name(mount.picture)}." if mount.picture else ""
        self._prompt.tell(f"By this mount {where_it_sits(mount, mesh)}.{look}")
        checks = mount_checks(mesh, mount)
        doubts = [c for c in checks if c.severity != "ok" and c.name != _SURENESS]
        for check in doubts:
            self._prompt.doubt(f"{check.message}. {check.fix}")
        but = ", but for what was not seen" if mount.free else ""
        return self._prompt.yes(f"Is that where the phone is{but}?", default=not doubts)


_SURE_MM = 15.0
"""95 % bound of a mount's place within which hands are seen to hold the object, millimetres."""
_SURE_DEG = 2.0
"""The same of its direction, degrees."""


def refine_by_floor(prompt: Prompt, state: GuideState, path: Path, output: Path) -> Path:
    """Offer to let the floor refine a mount; the file to use then.

    Args:
        talk: asks and tells.
        known: with the mesh.
        path: of the mount.
        output: of the refined mount.
    """
    assert state.mesh_file is not None
    prompt.heading("The floor")
    mount = load_mount(path)
    mesh = load_mesh(state.mesh_file, scale=mount.object_scale)
    recording = _recording(prompt, state, mount, mesh)
    if recording is None or not prompt.yes("Let it refine the mount?", default=True):
        return path
    height = prompt.until_right(lambda: _height(prompt))
    words = ["floor", str(path), str(recording), "--object", str(state.mesh_file)]
    words += [*(["--phone-height", height] if height else []), "-o", str(output)]
    prompt.command(command_line(words))
    try:
        state.run(words)
    except InputError as error:
        prompt.problem(error)
        prompt.tell(f"{path} stays as it is.")
        return path
    return output


def _recording(prompt: Prompt, state: GuideState, mount: Mount, mesh: ObjectMesh) -> Path | None:
    """One in which the object stands on the floor, if there is one."""
    path = state.session_file
    while True:
        try:
            if path is not None:
                session = state.session if path == state.session_file else None
                session = session or read_session(path)
                prompt.good(standing(session, mesh, mount).good)
                return path
        except InputError as error:
            prompt.tell(f"In {path} the floor tells nothing: {error.what} {error.fix}")
        path = prompt.maybe_path(
            "A recording, with the phone on it, in which the object stands on the floor for two "
            "seconds (Enter: none)"
        )
        if path is None:
            return None


def standing(session: CaptureSession, mesh: ObjectMesh, mount: Mount) -> Finding:
    """Return how often the object stands on the floor in a recording.

    Raises:
        InputError: of `ingest.calibration.floor_contacts.track` and
            `ingest.calibration.floor_contacts.standings`.
    """
    stands = standings(find_contacts(track(session)), flat_sides(mesh), mount, str(session.source))
    rests = sum(one.contact.kind == "rest" for one in stands)
    pushed = f", and is pushed over it {len(stands) - rests} times" if len(stands) > rests else ""
    return Finding(f"in the recording the object rests on the floor {rests} times{pushed}")


def _height(prompt: Prompt) -> str:
    answer = prompt.ask(
        "Metres from the floor up to the lens, where the object first rests (Enter: not measured)",
        "",
    )
    if answer:
        numbers(answer, 1, "the height")
    return answer


def print_closing_advice(prompt: Prompt, state: GuideState, best: Path) -> None:
    """Print which file to use and how, what is still open, and what would make it surer."""
    mount = load_mount(best)
    prompt.heading("Done")
    for free in mount.free:
        prompt.doubt(f"Still open: {free}.")
    bounds = bounds_95(mount.covariance) if mount.covariance is not None else None
    sure = bounds is not None and bounds.mm < _SURE_MM and bounds.deg < _SURE_DEG
    if mount.free and not any(TILT_IT in free for free in mount.free):
        prompt.tell(
            "Record once more and turn the object about two directions, by 20 degrees or more."
        )
    if mount.free or not sure:
        prompt.tell(
            "To be surer, calibrate in another way too (omocap calibrate), then combine both:"
        )
        prompt.command(command_line(["combine", str(best), "OTHER.json", "-o", "BOTH.json"]))
    prompt.tell("Use it:")
    words = [
        "run",
        "RECORDING",
        "--object",
        str(state.mesh_file),
        "--mount",
        str(best),
        "-o",
        "OUT",
    ]
    prompt.command(f"omocap {join(words)}")


RECIPES: Sequence[Recipe] = (
    Recipe(
        "board",
        "board",
        "a printer, and a second camera or phone on a tripod (surest)",
        (files.MESH, PRINT, BOARD_PLACE, record.WITNESSED, record.FILM),
    ),
    Recipe(
        "filmed",
        "session",
        "a printer, and only the phone",
        (files.MESH, PRINT, BOARD_PLACE, record.FILMED),
    ),
    Recipe(
        "meshed",
        "session",
        "only the phone, and its app makes a mesh of what it sees (LiDAR)",
        (files.MESH, record.SCANNED, files.SCAN),
    ),
    Recipe(
        "scan",
        "scan",
        "a scan of the object with its surroundings (a COLMAP model)",
        (
            files.MESH,
            files.COLMAP,
            files.MODEL_PICTURES,
            files.MODEL_TO_OBJECT,
            record.STOOD,
        ),
    ),
    Recipe(
        "tracker",
        "tracker",
        "motion capture, or a tracker on the object",
        (files.MESH, record.TRACKED, record.POSES),
    ),
    Recipe(
        "drawing",
        "drawing",
        "a drawing of the holder (printed in 3D, milled)",
        (files.MESH, MODEL, DRAWN_PLACE, DRAWN_TURN),
    ),
    Recipe(
        "points",
        "points",
        "only a ruler (quick, rough)",
        (files.MESH, MODEL, PICKED),
    ),
)


_MOUNT = "mount.json"


class Guide:
    """One conversation; ended early, it says how to go on."""

    def __init__(
        self,
        prompt: Prompt,
        run: Callable[[Sequence[str]], None],
        check_output: Callable[[Path], None],
    ) -> None:
        """Take what the guide needs of the command line.

        Args:
            talk: asks and tells.
            run: runs the words of a command of `omocap calibrate`; raises its InputError.
            check_output: refuses a file that the mount cannot be written to.
        """
        self._prompt, self._run, self._check_output = prompt, run, check_output
        self._next: Callable[[], list[str]] = list
        """The words of the command line that goes on from here."""

    def go(self) -> None:
        """Ask, guide, check, and write the mount.

        Raises:
            InputError: "guide-ended" at the end of the input, "mounts-disagree" and the like when
                several results do not go together.
        """
        try:
            self._converse()
        except EOFError:
            raise InputError(
                "guide-ended",
                "The answers ended before the guide was through.",
                fix=f"Go on where you stopped: {command_line(self._next())}",
            ) from None
        except KeyboardInterrupt:
            self._prompt.tell("\nStopped. To go on from here:")
            self._prompt.command(command_line(self._next()))
            raise

    def _converse(self) -> None:
        prompt = self._prompt
        prompt.heading("Where is the phone on the object?")
        prompt.tell(
            "You are led through recording what tells it, and each recording is looked at at once. "
            "Ctrl-C stops; you are told then how to go on. What do you have?"
        )
        chosen = [
            RECIPES[k]
            for k in prompt.choose_some(
                "Number (several, such as 1 7, are done one after the other and combined)",
                [recipe.have for recipe in RECIPES],
            )
        ]
        output = prompt.until_right(self._ask_output)
        state = GuideState(output.parent, self._run)
        path = self._mount(chosen, output, state)
        refined = state.fresh(f"{output.stem}-floor.json")
        self._next = lambda: ["floor", str(path), "RECORDING", *_mesh(state), "-o", str(refined)]
        best = refine_by_floor(prompt, state, path, refined)
        print_closing_advice(prompt, state, best)

    def _ask_output(self) -> Path:
        path = self._prompt.path("Mount file to write", Path(_MOUNT))
        self._check_output(path)
        return path

    def _mount(self, recipes: Sequence[Recipe], output: Path, state: GuideState) -> Path:
        """Walk each recipe, and combine the results of several."""
        if len(recipes) == 1:
            self._walk(recipes[0], output, state)
            return output
        walks: list[Wizard] = []
        results: list[Path] = []
        for recipe in recipes:
            results.append(state.fresh(f"{output.stem}-{recipe.method}.json"))
            walks.append(self._walk(recipe, results[-1], state))
        self._combine(recipes, walks, results, output, state)
        return output

    def _walk(self, recipe: Recipe, output: Path, state: GuideState) -> Wizard:
        self._prompt.heading(f"With {recipe.have}")
        walk = Wizard(recipe, output, self._prompt, state)
        self._next = lambda: walk.words
        walk.go()
        return walk

    def _combine(
        self,
        recipes: Sequence[Recipe],
        walks: Sequence[Wizard],
        results: list[Path],
        output: Path,
        state: GuideState,
    ) -> None:
        """Combine the results; of those that disagree, let one be found again."""
        self._next = lambda: ["combine", *map(str, results), "-o", str(output)]
        while True:
            self._prompt.heading("All of them together")
            self._prompt.tell(
                "They count as found independently: two results of one recording look surer together "
                "than they are."
            )
            self._prompt.command(command_line(self._next()))
            try:
                return self._run(self._next())
            except InputError as error:
                self._prompt.problem(error)
                wrong = self._prompt.choose(
                    "Which one do you want to do again? (Ctrl-C leaves all of them as they are)",
                    [
                        f"{path}: {recipe.have}"
                        for path, recipe in zip(results, recipes, strict=True)
                    ],
                )
                path = state.fresh(f"{output.stem}-{recipes[wrong].method}.json")
                walks[wrong].again(path)
                results[wrong] = path


def _mesh(state: GuideState) -> list[str]:
    return ["--object", str(state.mesh_file or "MESH")]
