"""`omocap data`: make training clips from recorded human motion."""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli import data_inspect, data_markers
from capture_app.cli.derived import derived
from capture_app.commands.request import validated
from capture_app.commands.train import SynthesisRequest

app = typer.Typer(no_args_is_help=True)


@app.callback()
def data() -> None:
    """Training data from recorded motion, and object motion from markers."""


@app.command()
def build(
    mocap: Annotated[
        Path, typer.Argument(help="Folder of BVH files and npz clips; see docs/data.md.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The npz of clips to write.")],
    share_alike: Annotated[
        bool, typer.Option(help="Use share-alike sources (HDM05); weights inherit the licence.")
    ] = True,
    object_split: Annotated[
        bool,
        typer.Option(
            "--object-split", help="Of the OMOMO release, only the paper's ten training objects."
        ),
    ] = False,
) -> None:
    """Retarget recorded motion to our body, for `omocap data synthesise` and `omocap train`.

    Files that cannot be used are skipped and counted by reason, never trained on.
    """
    from capture_app.cli.console import counting, output, say
    from omomo_core.body.model import load_body
    from omomo_core.learning.recordings.clips import save_clips
    from omomo_core.learning.recordings.recordings import build_mocap
    from omomo_core.whole_file import check_target

    check_target(out)
    dropped = Counter[str]()
    with counting("retarget") as progress:
        clips = build_mocap(
            mocap,
            load_body(),
            share_alike=share_alike,
            progress=progress,
            dropped=dropped,
            object_split=object_split,
        )
    save_clips(out, clips)
    for reason, count in dropped.most_common():
        say("left out", f"{count} x {reason}", "yellow")
    output.print(f"{len(clips)} recorded clips in {out}")


Mocap = Annotated[
    list[Path],
    typer.Argument(
        help="Recordings (folders or files), clips that `omocap data build` made of them, or data sets."
    ),
]
DataSet = Annotated[
    Path, typer.Option("-o", "--out", help="Folder of the data set; given again, it goes on.")
]


@app.command()
@derived(SynthesisRequest)
def synthesise(mocap: Mocap, out: DataSet, **said: Any) -> None:
    """Make clips of people who carry, push, pull, lift and turn things, out of recorded motion.

    Interrupt it when you like: the same command goes on with the files that are missing. A larger
    --count adds clips. What could not be held, or went wrong otherwise, is counted by reason.
    """
    from capture_app.cli.training_console import TrainingConsole
    from capture_app.training import synthesise_data

    asked = {**said, "mocap": mocap, "output": out}
    request = validated(SynthesisRequest, asked, "option-invalid")
    synthesise_data(request, TrainingConsole())


app.command("inspect")(data_inspect.inspect)
app.command("markers")(data_markers.markers)
