"""`omocap data synthesise`: recorded motion becomes a data set of people who move things."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.derived import derived
from capture_app.commands.request import validated
from capture_app.commands.train import SynthesisRequest

Mocap = Annotated[
    list[Path],
    typer.Argument(
        help="Recordings (folders or files), clips that `omocap data build` made of them, or data sets."
    ),
]
Out = Annotated[
    Path, typer.Option("-o", "--out", help="Folder of the data set; given again, it goes on.")
]


@derived(SynthesisRequest)
def synthesise(mocap: Mocap, out: Out, **said: Any) -> None:
    """Make clips of people who carry, push, pull, lift and turn things, out of recorded motion.

    Interrupt it when you like: the same command goes on with the files that are missing. A larger
    --count adds clips. What could not be held, or went wrong otherwise, is counted by reason.
    """
    from capture_app.cli.training_console import TrainingConsole
    from capture_app.synthesis import synthesise_data

    asked = {**said, "mocap": mocap, "output": out}
    request = validated(SynthesisRequest, asked, "option-invalid", prefix="--")
    synthesise_data(request, TrainingConsole())
