"""`omocap data inspect`: look at clips, and measure what is wrong with them."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from capture_app.cli import options
from capture_app.cli.console import counting, output, say
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from omomo_core.body.model import BodyModel
    from omomo_core.learning.recordings.clips import Clip
    from omomo_core.learning.recordings.quality import Quality

_ROWS = 5
"""Clips on a sheet."""


def inspect(
    data: Annotated[
        Path, typer.Argument(help="Data set of `omocap data synthesise`, or a file of clips.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for sheets, video and numbers.")],
    clips: Annotated[int, typer.Option(help="Random clips to look at.", min=1)] = 20,
    name: Annotated[
        list[str] | None,
        typer.Option(help="Clips with this in their name instead; may be given several times."),
    ] = None,
    videos: Annotated[int, typer.Option(help="Clips to show in the video.", min=0)] = 3,
    measure_only: Annotated[
        bool, typer.Option("--measure-only", help="Draw nothing, only measure.")
    ] = False,
    seed: Annotated[int, typer.Option(help="The same seed picks the same clips.", min=0)] = 0,
    backend: options.Backend = options.DrawingBackend.auto,
) -> None:
    """Draw contact sheets and a video of random clips with objects, and measure them.

    Writes sheet_NN.png (a row for each clip, palms green while they touch), clips.mp4 and
    quality.json: palms off the surface, object inside the body, floating, skating, jerk, joints
    bent as none can be. Clips out of bounds are flagged, and come first in the video.
    """
    from omomo_core.body.model import load_body
    from omomo_core.learning.recordings.quality import judge

    body, chosen = load_body(), _choose(data, clips, name or [], seed)
    out.mkdir(parents=True, exist_ok=True)
    judged: list[Quality] = []
    with counting("measure") as progress:
        for clip in chosen:
            judged.append(judge(clip, body))
            progress(len(judged), len(chosen))
    rows = [asdict(q) for q in judged]
    (out / "quality.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    _show(judged)
    if not measure_only:
        _draw_sheets(out, chosen, judged, body, backend)
        if videos:
            _draw_video(out / "clips.mp4", chosen, judged, body, backend, videos)
    flagged = sum(bool(q.flags) for q in judged)
    say("Done", f"{flagged} of {len(judged)} clips flagged; see {out}", "green")


def _choose(data: Path, count: int, names: list[str], seed: int) -> "list[Clip]":
    """Random clips with objects, or those named, reading only the files they are in."""
    import numpy as np

    from omomo_core.learning.recordings.clips import clip_files, load_clips, read_index

    places = [
        (file, k, row["name"])
        for file in clip_files(data)
        for k, row in enumerate(read_index(file)[0])
        if row["object"] is not None
    ]
    if names:
        places = [place for place in places if any(name in place[2] for name in names)]
    if not places:
        raise InputError(
            "no-such-clip",
            "There is no clip with an object" + (" of that name." if names else "."),
            where=str(data),
            fix="Give a data set of `omocap data synthesise`, and --name a part of a clip's name.",
        )
    if not names and len(places) > count:
        picked = np.random.default_rng(seed).choice(len(places), count, replace=False)
        places = [places[k] for k in sorted(picked)]
    held: dict[Path, list[Clip]] = {}
    chosen: list[Clip] = []
    for file, k, _ in places:
        if file not in held:
            held = {file: load_clips(file)}
        chosen.append(held[file][k])
    return chosen


def _draw_sheets(
    out: Path,
    clips: "list[Clip]",
    judged: "list[Quality]",
    body: "BodyModel",
    backend: options.DrawingBackend,
) -> None:
    from render.clip_view import clip_row
    from render.video import contact_sheet, write_png

    pairs = list(zip(clips, judged, strict=True))
    with counting("draw") as progress:
        for first in range(0, len(pairs), _ROWS):
            part = pairs[first : first + _ROWS]
            rows = [
                clip_row(clip, body, _label(quality), backend=backend.value)
                for clip, quality in part
            ]
            write_png(out / f"sheet_{first // _ROWS:02d}.png", contact_sheet(rows, 1))
            progress(first + len(part), len(pairs))


def _draw_video(
    file: Path,
    clips: "list[Clip]",
    judged: "list[Quality]",
    body: "BodyModel",
    backend: options.DrawingBackend,
    count: int,
) -> None:
    from omomo_core.motion import FPS
    from render.clip_view import clip_video
    from render.video import write_video

    worst = sorted(range(len(clips)), key=lambda k: -len(judged[k].flags))[:count]
    pictures = (
        picture
        for k in worst
        for picture in clip_video(
            clips[k], body, _label(judged[k]), backend=backend.value, stride=2
        )
    )
    write_video(file, pictures, FPS / 2)


def _label(quality: "Quality") -> str:
    return quality.name + (f": {', '.join(quality.flags)}" if quality.flags else "")


def _show(judged: "list[Quality]") -> None:
    import numpy as np

    measures = [f.name for f in fields(judged[0]) if f.name not in ("name", "flags")]
    table = Table("measure", "median", "worst", "of", box=None, pad_edge=False)
    for measure in measures:
        values = np.array([getattr(quality, measure) for quality in judged])
        lower_is_worse = "_min_" in measure or measure == "lowest_cm"
        worst = int(values.argmin() if lower_is_worse else values.argmax())
        median, extreme = np.median(values), values[worst]
        table.add_row(measure, f"{median:.1f}", f"{extreme:.1f}", judged[worst].name)
    output.print(table)
    for quality in judged:
        if quality.flags:
            say(quality.name, ", ".join(quality.flags), "yellow")
