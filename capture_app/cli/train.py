"""`omocap train`: train the networks of a method on clips; stop and resume at any time."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.derived import derived
from capture_app.commands.request import validated
from capture_app.commands.train import MethodName, TrainRequest

Method = Annotated[
    MethodName, typer.Argument(help="Whose networks; capture is the one that ships.")
]
Data = Annotated[
    list[Path],
    typer.Argument(
        help="Recordings (folders or files: BVH, npz, AMASS, the OMOMO release's .p), or clips "
        "of `omocap data build` and data sets of `omocap data synthesise`."
    ),
]
Out = Annotated[
    Path, typer.Option("-o", "--out", help="Folder of the run; given again, it resumes.")
]


@derived(TrainRequest)
def train(method: Method, data: Data, out: Out, **said: Any) -> None:
    """Train the networks of a method and write their weights.

    Recordings become clips on our skeleton, people who move things are synthesised from them, and
    both are kept in the folder of the run; unusable files are skipped and counted by reason. The
    folder then holds `<network>.safetensors` (averaged weights; those of capture and omomo are ready
    for `omocap run --weights`) and `<network>.resume`. Interrupt it when you like: the same command
    goes on where it stopped. Several processes share each batch when torchrun starts them (see
    docs/training.md).
    """
    from capture_app.cli.training_console import TrainingConsole
    from capture_app.training import train as run

    asked = {**said, "method": method, "data": data, "output": out}
    run(validated(TrainRequest, asked, "option-invalid"), TrainingConsole())
