"""`omocap inspect`: look a take over before spending time on it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from capture_app.cli import options
from capture_app.cli.console import in_options, output, report, say
from capture_app.cli.derived import derived
from capture_app.commands.reading import ReadingOptions
from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest, mount_file
from ingest.report.take_report import folded
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from capture_app.inspection import Inspection

_COLOUR = {"ok": "green", "warn": "yellow", "bad": "red"}
_VERDICT_COLOUR = {"good": "green", "usable with limits": "yellow", "not usable": "red"}

HtmlFile = Annotated[
    Path | None,
    typer.Option(
        "--html", help="Also write the report, with plots, as one HTML file.", show_default=False
    ),
]

PictureFile = Annotated[
    Path | None,
    typer.Option(
        "--picture",
        help="Also draw the object with the phone on it, at rest and in mid-motion, as a PNG.",
        show_default=False,
    ),
]

Images = Annotated[
    bool,
    typer.Option(
        "--images",
        help="Also test on a few images that the poses' axes are read rightly: a second or two.",
        show_default=False,
    ),
]


@derived(ReadingOptions)
@derived(RunRequest, only=("mount", "mesh_scale"))
def inspect(
    session: options.Session,
    mesh: options.OptionalMesh = None,
    images: Images = False,
    html: HtmlFile = None,
    picture: PictureFile = None,
    as_json: options.AsJson = False,
    *,
    mount: Path | None = None,
    mesh_scale: float = 1.0,
    **said: Any,
) -> None:
    """Check a recording: tracking, rate, speeds, gravity, IMU, floor, mesh, mount, video.

    Tells which stretches of it `omocap run` can use. Exit code 0, or 2 when a run would refuse it.
    """
    from capture_app.inspection import inspect_take, inspection_data, refuse_bad

    # Without the object the phone alone is inspected, and needs no mount.
    place = mount_file(mount) if mesh else None
    inspection = inspect_take(
        session,
        mesh,
        place,
        reading=validated(ReadingOptions, said, "option-invalid").reading,
        mesh_scale=mesh_scale,
        images=images,
    )
    refusal = None
    try:
        refuse_bad(inspection)
    except InputError as problem:
        refusal = problem
    if html is not None:
        _write_page(inspection, html)
    if picture is not None:
        _write_picture(inspection, picture)
    if as_json:
        from capture_app.commands.spelling import all_in_options

        output.print_json(data=all_in_options(inspection_data(inspection)))
    else:
        _show(inspection)
        if html is not None:
            say("Page", str(html), "bold")
        if picture is not None:
            say("Picture", str(picture), "bold")
    if refusal is not None:
        if not as_json:
            report(refusal)
        raise typer.Exit(2)


def _write_page(inspection: "Inspection", path: Path) -> None:
    from capture_app.posters import take_views
    from capture_app.report_page import report_page
    from omomo_core.whole_file import write_whole

    write_whole(path, in_options(report_page(inspection, take_views(inspection))))


def _write_picture(inspection: "Inspection", path: Path) -> None:
    from capture_app.posters import take_views
    from render.video import write_png

    picture = take_views(inspection)
    if picture is None:
        raise InputError(
            "picture-none",
            "There is no picture: the object is not given, or the recording gives no motion of it.",
            where=str(path),
            fix="Leave out --picture, or give the object and its mount.",
        )
    write_png(path, picture)


def _show(inspection: "Inspection") -> None:
    output.print(
        f"{inspection.session.source} ({inspection.session.app})", markup=False, soft_wrap=True
    )
    table = Table("", "check", "found", "poses", box=None, pad_edge=False, header_style="dim")
    for checks in folded(inspection.report.checks):
        first = checks[0]
        text = Text(in_options("; ".join(dict.fromkeys(check.message for check in checks))))
        if first.fix:
            text.append(f"\nfix: {in_options(first.fix)}", style="dim")
        names = ", ".join(dict.fromkeys(check.name for check in checks))
        places = [f"{c.frames[0]}-{c.frames[1] - 1}" for c in checks if c.frames]
        severity = Text(first.severity, style=_COLOUR[first.severity])
        table.add_row(severity, names, text, ", ".join(places))
    output.print(table)
    _show_stretches(inspection)
    reason = f": {inspection.reason}" if inspection.reason else ""
    say("Verdict", f"{inspection.verdict}{reason}", f"bold {_VERDICT_COLOUR[inspection.verdict]}")


def _show_stretches(inspection: "Inspection") -> None:
    if inspection.take is None:
        return
    for k, (start, stop) in enumerate(inspection.take.segments):
        used = k == inspection.take.chosen and len(inspection.take.segments) > 1
        note = " (used; --segment chooses another)" if used else ""
        say(f"Segment {k + 1}", f"{start / 30:.1f} to {stop / 30:.1f} s can be used{note}", "bold")
    if inspection.mesh is not None:
        say("Floor", inspection.take.floor.message, "bold")
