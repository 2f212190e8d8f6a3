"""Walk: one recipe from its first step to its mount file."""

from collections.abc import Sequence
from pathlib import Path
from shlex import join

from capture_app.calibration.guide.placement import where_it_sits
from capture_app.calibration.guide.prompt import Prompt
from capture_app.calibration.guide.steps import AgainError, GuideState, GuideStep, Recipe
from ingest.mesh import load_mesh
from ingest.mount import Mount
from ingest.mount_file import load_mount
from ingest.report.clamp_checks import mount_checks
from omomo_core.errors import InputError

_TOOL = ("omocap", "calibrate")
_SURENESS = "mount's error"
"""The check of what has just been printed as bounds, and is told again at the end."""


def command_line(words: Sequence[str]) -> str:
    """What a person types, or copies."""
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
