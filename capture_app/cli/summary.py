"""What is printed at the end of a run."""

from typing import TYPE_CHECKING

from rich.table import Table

from capture_app.cli.console import output, say

if TYPE_CHECKING:
    from capture_app.result import Result


def summarise(result: "Result") -> None:
    """Where everything is, and what the user should know about it."""
    manifest = result.manifest
    table = Table(box=None, pad_edge=False, show_header=False)
    about = {
        "motion.glb": "person and object, for Blender, Unity, Unreal",
        "motion.mp4": "video",
        "motion.npz": "the numbers; see docs/format.md",
        "contacts.json": "which hand holds when and where; correct it with omocap resolve",
        "manifest.json": "how it was made",
    }
    for name, what in about.items():
        if (result.folder / name).is_file():
            table.add_row(f"  {name}", f"[dim]{what}[/]")
    frames, samples = len(result.object_motion.valid), len(result.motions)
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
        and not options.get("stood")
    ):
        x, y = result.motions[manifest.chosen].root[0, :2].tolist()
        output.print(
            f"The person begins at {x:z.1f},{y:z.1f}. If that is the wrong side of the object, say where the "
            "person stood: --stood x,y."
        )
    for note in (*manifest.notes, *manifest.faults):
        say("Note", note, "yellow")
