"""Guide: from what a person has to the mount, and to what makes it surer."""

from collections.abc import Callable, Sequence
from pathlib import Path

from capture_app.calibration.guide.afterwards import refine_by_floor, told_at_the_end
from capture_app.calibration.guide.recipes import RECIPES
from capture_app.calibration.guide.step import Known, Recipe
from capture_app.calibration.guide.talk import Talk
from capture_app.calibration.guide.walk import Walk, command_line
from omomo_core.errors import InputError

_MOUNT = "mount.json"


class Guide:
    """One conversation; ended early, it says how to go on."""

    def __init__(
        self,
        talk: Talk,
        run: Callable[[Sequence[str]], None],
        check_output: Callable[[Path], None],
    ) -> None:
        """Take what the guide needs of the command line.

        Args:
            talk: asks and tells.
            run: runs the words of a command of `omocap calibrate`; raises its InputError.
            check_output: refuses a file that the mount cannot be written to.
        """
        self._talk, self._run, self._check_output = talk, run, check_output
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
            self._talk.tell("\nStopped. To go on from here:")
            self._talk.command(command_line(self._next()))
            raise

    def _converse(self) -> None:
        talk = self._talk
        talk.heading("Where is the phone on the object?")
        talk.tell(
            "You are led through recording what tells it, and each recording is looked at at once. "
            "Ctrl-C stops; you are told then how to go on. What do you have?"
        )
        chosen = [
            RECIPES[k]
            for k in talk.choose_some(
                "Number (several, such as 1 9, are done one after the other and combined)",
                [recipe.have for recipe in RECIPES],
            )
        ]
        output = talk.until_right(self._ask_output)
        known = Known(output.parent, self._run)
        path = self._mount(chosen, output, known)
        refined = known.fresh(f"{output.stem}-floor.json")
        self._next = lambda: ["floor", str(path), "RECORDING", *_mesh(known), "-o", str(refined)]
        best = refine_by_floor(talk, known, path, refined)
        told_at_the_end(talk, known, best)

    def _ask_output(self) -> Path:
        path = self._talk.path("Mount file to write", Path(_MOUNT))
        self._check_output(path)
        return path

    def _mount(self, recipes: Sequence[Recipe], output: Path, known: Known) -> Path:
        """Walk each recipe, and combine the results of several."""
        if len(recipes) == 1:
            self._walk(recipes[0], output, known)
            return output
        walks: list[Walk] = []
        results: list[Path] = []
        for recipe in recipes:
            results.append(known.fresh(f"{output.stem}-{recipe.method}.json"))
            walks.append(self._walk(recipe, results[-1], known))
        self._combine(recipes, walks, results, output, known)
        return output

    def _walk(self, recipe: Recipe, output: Path, known: Known) -> Walk:
        self._talk.heading(f"With {recipe.have}")
        walk = Walk(recipe, output, self._talk, known)
        self._next = lambda: walk.words
        walk.go()
        return walk

    def _combine(
        self,
        recipes: Sequence[Recipe],
        walks: Sequence[Walk],
        results: list[Path],
        output: Path,
        known: Known,
    ) -> None:
        """Combine the results; of those that disagree, let one be found again."""
        self._next = lambda: ["combine", *map(str, results), "-o", str(output)]
        while True:
            self._talk.heading("All of them together")
            self._talk.tell(
                "They count as found independently: two results of one recording look surer together "
                "than they are."
            )
            self._talk.command(command_line(self._next()))
            try:
                return self._run(self._next())
            except InputError as error:
                self._talk.problem(error)
                wrong = self._talk.choose(
                    "Which one do you want to do again? (Ctrl-C leaves all of them as they are)",
                    [
                        f"{path}: {recipe.have}"
                        for path, recipe in zip(results, recipes, strict=True)
                    ],
                )
                path = known.fresh(f"{output.stem}-{recipes[wrong].method}.json")
                walks[wrong].again(path)
                results[wrong] = path


def _mesh(known: Known) -> list[str]:
    return ["--object", str(known.mesh_file or "MESH")]
