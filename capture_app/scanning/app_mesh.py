"""made_by_app: a mesh that another app made, ready as it is or cut out of the mesh of a room."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from capture_app.commands.scan import ScanRequest
from ingest.axes import T_ZUP_ARKIT
from ingest.formats.registry import read_session
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.cut_surface import cut_out, place_looked_at
from ingest.scan.mesh_sources import APP, read_scan_mesh, room_file
from ingest.scan.room_parts import has_floor, read_room, read_room_of_session
from ingest.scan.scan_sources import mesh_in
from ingest.scan.work import ready_mesh
from omomo_core.errors import InputError


def made_by_app(request: ScanRequest) -> CleanMesh | None:
    """The object's mesh as an app made it.

    Returns:
        None where the surface is to be measured in pictures.

    Raises:
        InputError: "scan-at" for a point that nothing is cut out at; those of `read_scan_mesh`, `cut_out`
            and `room_file`.
    """
    mesh = mesh_in(request.source)
    _check_at(request, mesh)
    if mesh is None:
        return _out_of_session(request) if request.method == "mesh" else None
    if request.method == "mesh" or request.at is not None:
        return _out_of_file(request, mesh)
    height = request.cameras.height
    ready = ready_mesh(
        read_scan_mesh(
            mesh, name=request.object_name, unit=request.unit, height=height, up=request.up
        )
    )
    if height is None and request.unit is None:
        _check_no_room(ready, mesh)
    return ready


def _check_no_room(ready: CleanMesh, path: Path) -> None:
    """Refuse the mesh of a room that nobody says to be the object.

    Raises:
        InputError: "scan-room".
    """
    turned = ready.mesh.vertices @ T_ZUP_ARKIT[:3, :3].T
    if has_floor(ready.mesh.vertices, ready.mesh.faces) or has_floor(turned, ready.mesh.faces):
        raise InputError(
            "scan-room",
            f"{path.name} shows a floor with things on it, not an object alone.",
            where=str(path),
            fix="Cut the object out of it (--method mesh, or --at with a point on it); if all of it is "
            "the object, say its unit (--units) or its height (--height).",
        )


def _check_at(request: ScanRequest, mesh: Path | None) -> None:
    cuts = request.method == "mesh" or mesh is not None
    if request.at is not None and not cuts:
        raise InputError(
            "scan-at",
            "A point on the object is of use only where the object is cut out of an app's mesh.",
            where=str(request.source),
            fix="Add --method mesh, or leave out --at.",
        )


def _out_of_file(request: ScanRequest, mesh: Path) -> CleanMesh:
    """Cut out of a mesh that was given."""
    room = read_room(mesh, unit=request.unit, up=request.up)
    at = None if request.at is None else np.array(request.at)
    return _to_height(cut_out(room, mesh.stem, at=at, box=request.given_box), request)


def _out_of_session(request: ScanRequest) -> CleanMesh:
    """Cut out of the room's mesh of a session, where the phone was held towards if nobody says it."""
    session = read_session(request.source, request.format)
    room = read_room_of_session(room_file(request.room or APP, session.source))
    name, box = request.output.stem, request.given_box
    at = None if request.at is None else np.array(request.at)
    seen = place_looked_at(session) if at is None and box is None else None
    if seen is not None:
        try:
            return _to_height(cut_out(room, name, at=seen), request)
        except InputError as error:
            if error.code != "scan-nothing-there":
                raise
    return _to_height(cut_out(room, name, at=at, box=box), request)


def _to_height(cleaned: CleanMesh, request: ScanRequest) -> CleanMesh:
    """The object scaled to a height that somebody knows better."""
    if request.cameras.height is None:
        return cleaned
    mesh = cleaned.mesh
    factor = request.cameras.height / float(np.ptp(mesh.vertices[:, 2]))
    return replace(cleaned, mesh=replace(mesh, vertices=factor * mesh.vertices))
