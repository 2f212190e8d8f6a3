"""`omocap scan`: a film or photos of an object, or a mesh of another app, become its mesh."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from capture_app.cli.console import errors as problems
from capture_app.cli.console import output as console
from capture_app.cli.console import say
from capture_app.cli.derived import derived
from capture_app.commands.request import validated
from capture_app.commands.scan import ScanRequest

if TYPE_CHECKING:
    from capture_app.scanning.scan_object import ObjectScan

Output = Annotated[
    Path,
    typer.Option("-o", "--output", help="Mesh to write: .glb, .ply or .obj.", show_default=False),
]


@derived(ScanRequest)
def scan(mesh: Output, **said: Any) -> None:
    """Make the object's mesh from a film of it: metres, z up, standing on its base.

    Walk around the object twice, once level with it and once from above. Beside object.glb comes the
    folder object.scan with a report (how good it is, what to film again) and the COLMAP model for
    `omocap calibrate scan`. An interrupted scan goes on when the same command is given again.
    """
    from capture_app.cli.console import progress_bars
    from capture_app.scanning.scan_object import scan_object

    request = validated(ScanRequest, {**said, "output": mesh}, "option-invalid")
    _estimate(request)
    with progress_bars() as progress:
        made = scan_object(request, progress)
    _show(made)
    if not made.report.usable:
        raise typer.Exit(2)


def _estimate(request: ScanRequest) -> None:
    """About how long it will take; a mesh of another app takes no time, and what is missing none."""
    from capture_app.scanning.scan_folder import estimate_seconds, in_words
    from ingest.scan.scan_sources import is_mesh

    if request.method == "mesh" or request.at is not None:
        return
    if request.source.exists() and not is_mesh(request.source):
        pictures = f"for {request.frames} pictures" if not request.draft else "for a draft"
        about = in_words(estimate_seconds(request.frames, request.draft))
        problems.print(f"This takes about {about} {pictures}, less for fewer.", highlight=False)


def _show(made: "ObjectScan") -> None:
    """Print the paths of what was made, and what the user should know about it."""
    from ingest.report.take_inspection import REPORT_PAGE

    request, report, mesh = made.request, made.report, made.cleaned.mesh
    sides = " x ".join(
        f"{side:.2f}" for side in mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    )
    _headline(made)
    tight = "closed" if made.cleaned.watertight else "open"
    tight += " by what is made up" if made.cleaned.watertight and report.cut_off else ""
    console.print(f"{sides} m, {len(mesh.vertices):,} vertices, {tight}", highlight=False)
    for check in (*report.of("bad"), *report.of("warn")):
        colour = "red" if check.severity == "bad" else "yellow"
        say(check.name.capitalize(), f"{check.message} {check.fix}".strip(), colour)
    say("Report", str(request.work / REPORT_PAGE), "bold")
    if made.found is not None and report.usable:
        say("Next", _next(request, made), "bold")


def _headline(made: "ObjectScan") -> None:
    """The worst that was found, first."""
    took, output = f"{sum(made.seconds.values()):.0f} s", made.request.output
    if made.report.usable:
        limits = "; usable with limits" if made.report.severity == "warn" else ""
        say("Done", f"in {took}: {output}{limits}", "green" if not limits else "yellow")
        return
    why = ", ".join(check.name for check in made.report.of("bad"))
    if made.report.cut_off:
        why = "the film does not show the whole object"
    say("Not usable as it is", f"{why}; {output}, made in {took}, is for looking at.", "red")


def _next(request: ScanRequest, made: "ObjectScan") -> str:
    """Return the command that finds the phone in this scan once it is clamped."""
    from capture_app.scanning.scan_folder import MODEL

    assert made.found is not None
    return (
        f"omocap calibrate scan {request.work / MODEL} --images {made.found.registered.images} "
        f"--object {request.output} --session CLAMPED -o mount.json"
    )
