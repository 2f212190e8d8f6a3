"""`omocap data`: training clips from recorded motion, a look at clips, and object motion from markers."""

import json
from collections import Counter
from dataclasses import asdict, fields
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from capture_app.cli import options
from capture_app.cli.console import counting, output, say
from capture_app.cli.derived import derived
from capture_app.commands.request import validated
from capture_app.commands.train import SynthesisRequest
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from omomo_core.body.model import BodyModel
    from omomo_core.learning.recordings.clips import Clip
    from omomo_core.learning.recordings.marker_solve import MarkedMotion, Span
    from omomo_core.learning.recordings.marker_tracks import Places
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


_OFF_SURFACE = 0.03
"""Metres between a marker's place and the scan beyond which the place was hardly meant."""
_TOLD = 8


class WorldUp(StrEnum):
    """Which axis of the recording's world points up."""

    z = "z"
    y = "y"


def markers(
    tracks: Annotated[
        Path, typer.Argument(help="Marker tracks: CSV (Vicon's, or time, NAME_x...) or npz.")
    ],
    mesh: Annotated[Path, typer.Argument(help="The object's scan, in any unit.")],
    places: Annotated[
        Path,
        typer.Argument(help="CSV of name,x,y,z: where the markers sit on the scan, in its unit."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The motion to write (npz).")],
    unit: Annotated[
        str | None, typer.Option(help="Of the tracks: m, cm or mm; else what their file says.")
    ] = None,
    up: Annotated[WorldUp, typer.Option(help="Axis of the recording that points up.")] = WorldUp.z,
    start: Annotated[float | None, typer.Option(help="Leave out what is before, seconds.")] = None,
    end: Annotated[float | None, typer.Option(help="Leave out what is after, seconds.")] = None,
    tolerance: Annotated[
        float, typer.Option(help="Metres a marker may be off the others in a frame.", min=1e-4)
    ] = 0.01,
    bridge: Annotated[
        float, typer.Option(help="Seconds without enough markers that may be filled.", min=0.0)
    ] = 0.25,
) -> None:
    """Turn the tracks of markers on an object into the motion of its scan, at 30 fps.

    The scan's scale, rotation and place are the Procrustes solution between the markers and their
    places on it, as in the OMOMO paper. Markers that contradict the others are left out of their
    frames; gaps and what was left out are told.
    """
    from omomo_core.learning.recordings.marker_solve import Solving, solve, write_motion
    from omomo_core.learning.recordings.marker_tracks import read_places, read_tracks
    from omomo_core.whole_file import check_target

    check_target(out, (".npz",))
    where = read_places(places)
    recorded = read_tracks(tracks, unit).between(start, end)
    motion = solve(recorded, where, Solving(tolerance, bridge))
    beside = _off_surface(mesh, where, motion.scale)
    write_motion(out, motion, up.value)
    _show_fit(motion, where, beside)
    seconds = (len(motion.T_world_object) - 1) / 30
    say("Done", f"{seconds:.2f} s from {motion.start:.2f} s on, in {out}", "green")
    then = f"omocap run {out} --object {mesh} --mesh-scale {motion.scale:.6g} -o RESULT"
    output.print(f"The person who moves it: {then}", soft_wrap=True, markup=False)


def _off_surface(mesh: Path, places: "Places", scale: float) -> "list[float]":
    """Return the distance of each place from the scan, metres; the scan is read at its right size."""
    from ingest.axes import T_ZUP_ARKIT
    from ingest.mesh import load_mesh
    from omomo_core.geometry.surface import sample_surface

    solid = load_mesh(mesh, scale=scale)
    points = places.points * scale
    if mesh.suffix.lower() in (".glb", ".gltf"):
        # Such a mesh has been turned z up; places are in the axes of its file.
        points = points @ T_ZUP_ARKIT[:3, :3].T
    distance, _ = sample_surface(solid).tree.query(points)
    return [float(d) for d in distance]


def _show_fit(motion: "MarkedMotion", places: "Places", beside: "list[float]") -> None:
    table = Table("marker", "off its place", "off the others", box=None, pad_edge=False)
    for k, name in enumerate(places.names):
        table.add_row(name, _millimetres(motion.picked_off[k]), _millimetres(motion.jitter[k]))
    output.print(table)
    for name, distance in zip(places.names, beside, strict=True):
        if distance > _OFF_SURFACE:
            say(name, f"its place is {100 * distance:.0f} cm from the scan's surface", "yellow")
    _tell("no pose", motion.gaps)
    _tell("left out", motion.outliers)
    output.print(f"1 unit of the scan is {motion.scale:.6g} m.")


def _tell(label: str, spans: "Sequence[Span]") -> None:
    for span in spans[:_TOLD]:
        say(label, str(span), "yellow")
    if len(spans) > _TOLD:
        say(label, f"{len(spans) - _TOLD} more times", "yellow")


def _millimetres(metres: float) -> str:
    return f"{1000 * metres:.1f} mm" if metres == metres else "never seen"


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


app.command("inspect")(inspect)
app.command("markers")(markers)
