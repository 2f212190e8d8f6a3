"""`omocap data`: make training clips from recorded human motion."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True)


@app.callback()
def data() -> None:
    """Training data from recorded motion."""


@app.command()
def build(
    mocap: Annotated[
        Path, typer.Argument(help="Folder of BVH files and npz clips; see docs/training.md.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The npz of clips to write.")],
    synthetic: Annotated[
        int, typer.Option(help="Clips with objects to synthesise from the recorded motion.")
    ] = 2000,
    share_alike: Annotated[
        bool, typer.Option(help="Use share-alike sources (HDM05); weights inherit the licence.")
    ] = True,
    seed: Annotated[int, typer.Option(help="Seed of the synthesis.")] = 0,
    workers: Annotated[int, typer.Option(help="Processes that synthesise.")] = 1,
) -> None:
    """Retarget recorded motion to our body and synthesise people who carry and push things.

    Files that cannot be used are skipped and counted by reason, never trained on.
    """
    from rich.progress import Progress

    from capture_app.cli.console import output, say
    from omomo_core.body.load import load_body
    from omomo_core.data.build import build_mocap
    from omomo_core.data.clips import save_clips
    from omomo_core.data.synthesis.engine import synthesise
    from omomo_core.errors import InputError

    if not out.resolve().parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(out.parent),
            fix="Make it, or give another file with -o.",
        )
    body, dropped = load_body(), Counter[str]()
    with Progress() as bar:
        reading = bar.add_task("retarget", total=None)
        clips = build_mocap(
            mocap,
            body,
            share_alike=share_alike,
            progress=lambda done, total: bar.update(reading, completed=done, total=total),
            dropped=dropped,
        )
        making = bar.add_task("synthesise", total=synthetic)
        made = []
        for clip in synthesise(clips, body, synthetic, seed, workers=workers):
            made.append(clip)
            bar.advance(making)
    save_clips(out, [*clips, *made])
    for reason, count in dropped.most_common():
        say("left out", f"{count} x {reason}", "yellow")
    output.print(f"{len(clips)} recorded and {len(made)} synthetic clips in {out}")
