"""Where the command line writes: results to stdout, progress and problems to stderr."""

from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text

from capture_app.progress import Progress
from omomo_core.errors import OmocapError

output = Console(highlight=False)
errors = Console(stderr=True, highlight=False)

_STAGES = {
    "read": "Reading the take",
    "object": "Measuring the object",
    "hands": "Placing the hands",
    "contact": "Deciding what they hold",
    "body": "Moving the body",
    "solve": "Fitting the body",
    "export": "Writing the files",
    "video": "Drawing the video",
    "board": "Looking for the board",
    "look": "Looking for sharp pictures",
    "frames": "Picking pictures",
    "features": "Finding features",
    "compare": "Comparing pictures",
    "match": "Matching pictures",
    "cameras": "Placing the cameras",
    "stereo": "Measuring depth",
    "silhouettes": "Cutting out the object",
    "fusion": "Joining depth and outlines",
    "colours": "Colouring",
    "clean": "Cleaning the mesh",
    "texture": "Painting the texture",
    "report": "Writing the report",
}


def say(label: str, text: str, style: str) -> None:
    """Print a result line that begins with a coloured word; the text is shown as it is."""
    output.print(Text.assemble((f"{label}: ", style), text), soft_wrap=True)


def report(error: OmocapError) -> None:
    """Print what is wrong, where, how to fix it, and the code, as one paragraph."""
    text = Text.assemble(("Error: ", "bold red"), error.what)
    for label, value in (("where", error.where), ("fix", error.fix), ("code", error.code)):
        if value:
            text.append(f"\n  {label}: ", style="bold")
            text.append(value)
    errors.print(text, soft_wrap=True)


@contextmanager
def progress_bars() -> Generator[Progress]:
    """A bar for each stage that reports; a line a minute when stderr is not a terminal."""
    from rich.progress import BarColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

    from capture_app.cli.bars import ProgressBars

    columns = (
        TextColumn("{task.description:<18}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    tasks: dict[str, TaskID] = {}
    with ProgressBars(*columns) as bars:

        def advance(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(_STAGES.get(stage, stage), total=1.0)
            bars.update(tasks[stage], completed=fraction)

        yield advance
