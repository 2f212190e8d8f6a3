"""What is printed at the end of a run."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rich.table import Table

from capture_app.cli.console import output, progress_bars, say
from capture_app.commands.run import ResultRequest

if TYPE_CHECKING:
    from capture_app.progress import Progress
    from capture_app.result import Result


def show_result(request: ResultRequest, make: "Callable[[Any, Progress], Result]") -> None:
    """Make a result, tell of it as soon as it stands, and only then draw its video.

    Args:
        request: of a run or a correction.
        make: makes the result without its video.
    """
    from capture_app.manifest import to_look_at

    with progress_bars() as progress:
        made = make(request, progress)
    summarise(made)
    if request.video is not None:
        _draw(request)
    if looked_at := to_look_at(made.manifest):
        say("Done, but look at", ", ".join(looked_at), "bold yellow")


def _draw(request: ResultRequest) -> None:
    from capture_app.staged_result import draw_video

    assert request.video is not None
    try:
        with progress_bars() as progress:
            draw_video(request, progress)
    except BaseException:
        say(
            "Note",
            "the result is complete, but has no video; draw one with `omocap render`.",
            "yellow",
        )
        raise
    say("Video", str(request.video.output), "green")


def summarise(result: "Result") -> None:
    """Print the paths of what was made, and what the user should know about it."""
    manifest = result.manifest
    table = Table(box=None, pad_edge=False, show_header=False)
    about = {
        "motion.glb": "person and object, for Blender, Unity, Unreal",
        "motion.npz": "the numbers; see docs/format.md",
        "contacts.json": "which hand holds when and where; correct it with omocap resolve",
        "manifest.json": "how it was made",
    }
    for name, what in about.items():
        if (result.folder / name).is_file():
            table.add_row(f"  {name}", f"[dim]{what}[/]")
    frames, samples = len(result.object_motion.valid), len(result.people)
    say("Done", f"in {sum(manifest.timings.values()):.0f} s: {result.folder}", "green")
    output.print(table)
    output.print(
        f"{frames / 30:.1f} s of motion at 30 fps; sample {manifest.chosen + 1} of {samples} chosen; "
        f"body {manifest.body.name}, {manifest.body.height:.2f} m."
    )
    options = manifest.options
    if (
        not manifest.correction
        and options["configuration"] == "capture"
        and not (options.get("stood") or options.get("side"))
    ):
        x, y = result.start.tolist()
        output.print(
            f"The person begins at {x:z.1f},{y:z.1f}. If that is the wrong side of the object, say where the "
            "person stood (--stood x,y) or held it (--side x,y)."
        )
    for grip in manifest.grips:
        output.print(grip)
    for finding in manifest.findings:
        say("Look at", finding.sentence, "yellow")
    for note in (*manifest.notes, *manifest.faults):
        say("Note", note, "yellow")
