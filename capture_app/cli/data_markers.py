"""`omocap data markers`: an object that was captured with markers becomes a motion for `omocap run`."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from capture_app.cli.console import output, say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from omomo_core.learning.recordings.marker_solve import MarkedMotion, Span
    from omomo_core.learning.recordings.marker_tracks import Places

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
    _show(motion, where, beside)
    seconds = (len(motion.T_world_object) - 1) / 30
    say("Done", f"{seconds:.2f} s from {motion.start:.2f} s on, in {out}", "green")
    then = f"omocap run {out} --object {mesh} --mesh-scale {motion.scale:.6g} -o RESULT"
    output.print(f"The person who moves it: {then}", soft_wrap=True, markup=False)


def _off_surface(mesh: Path, places: "Places", scale: float) -> "list[float]":
    """How far each place is from the scan, metres; the scan is read at its right size."""
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


def _show(motion: "MarkedMotion", places: "Places", beside: "list[float]") -> None:
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
