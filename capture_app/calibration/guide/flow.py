"""Guide: from what a person has to the mount, and to what makes it surer."""

from collections.abc import Callable, Sequence
from pathlib import Path

from capture_app.calibration.guide.afterwards import print_closing_advice, refine_by_floor
from capture_app.calibration.guide.prompt import Prompt
from capture_app.calibration.guide.recipes import RECIPES
from capture_app.calibration.guide.steps import GuideState, Recipe
from capture_app.calibration.guide.wizard import Wizard, command_line
from omomo_core.errors import InputError

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
                "Number (several, such as 1 9, are done one after the other and combined)",
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
