"""`omocap data`: make training clips from recorded human motion."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import data_inspect, data_markers, data_synthesise

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
    from capture_app.cli.bars import counting
    from capture_app.cli.console import output, say
    from omomo_core.body.load import load_body
    from omomo_core.learning.recordings.build import build_mocap
    from omomo_core.learning.recordings.clips import save_clips
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


app.command("synthesise")(data_synthesise.synthesise)
app.command("inspect")(data_inspect.inspect)
app.command("markers")(data_markers.markers)
