"""`omocap inspect`: look a take over before spending time on it."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table
from rich.text import Text

from capture_app.cli import options as given
from capture_app.cli.console import output, report, say

if TYPE_CHECKING:
    from capture_app.inspection import Inspection

_COLOUR = {"ok": "green", "warn": "yellow", "bad": "red"}


def inspect(
    session: given.Session,
    mesh: given.OptionalMesh = None,
    mount: given.Mount = None,
    floor: given.Floor = None,
    mesh_scale: given.MeshScale = 1.0,
    as_json: given.AsJson = False,
) -> None:
    """Check a recording: rate, tracking failures, speeds, gravity, floor, video.

    Tells which stretches of it `omocap run` can use. Exit code 0, or 2 when it can use none.
    """
    from capture_app.inspection import inspect_take

    # Without the object the phone alone is inspected, and needs no mount.
    place = given.mount_file(mount) if mesh else None
    seen = inspect_take(session, mesh, place, floor=floor, mesh_scale=mesh_scale)
    if as_json:
        output.print_json(data=_as_data(seen))
    else:
        _show(seen, with_floor=mesh is not None)
    if seen.problem:
        if not as_json:
            report(seen.problem)
        raise typer.Exit(2)


def _as_data(seen: "Inspection") -> dict[str, Any]:
    take = seen.take
    return {
        "app": seen.session.app,
        "source": str(seen.session.source),
        "usable": take is not None,
        "problem": str(seen.problem) if seen.problem else None,
        "severity": seen.report.severity,
        "checks": [asdict(check) for check in seen.report.checks],
        "segments": [list(segment) for segment in take.segments] if take else [],
        "floor": {"height": take.floor.height, "source": take.floor.source} if take else None,
        "notes": list(take.notes) if take else [],
    }


def _show(seen: "Inspection", *, with_floor: bool) -> None:
    output.print(f"{seen.session.source} ({seen.session.app})", markup=False, soft_wrap=True)
    table = Table("", "check", "found", "poses", box=None, pad_edge=False, header_style="dim")
    for check in seen.report.checks:
        colour = _COLOUR[check.severity]
        found = Text(check.message)
        if check.fix:
            found.append(f"\nfix: {check.fix}", style="dim")
        poses = f"{check.frames[0]}-{check.frames[1] - 1}" if check.frames else ""
        table.add_row(Text(check.severity, style=colour), check.name, found, poses)
    output.print(table)
    if seen.take is None:
        return
    longest = max(stop - start for start, stop in seen.take.segments)
    for k, (start, stop) in enumerate(seen.take.segments, 1):
        used = stop - start == longest and len(seen.take.segments) > 1
        note = " (the longest: used unless --segment says otherwise)" if used else ""
        say(f"Segment {k}", f"{start / 30:.1f} to {stop / 30:.1f} s can be used{note}", "bold")
    if with_floor:
        say("Floor", seen.take.floor.message, "bold")
