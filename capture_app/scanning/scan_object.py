"""A film of an object, or an app's mesh of it, becomes its mesh with a report beside it."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from capture_app.commands.scan import ScanRequest
from capture_app.commands.spelling import all_in_options, in_options
from capture_app.progress import Progress, StageClock
from capture_app.scanning.scan_folder import MODEL, OUTLINE, VIEWS, forget_empty, open_folder, tidy
from capture_app.scanning.scan_report import outline_picture, report_data, scan_page, views_picture
from ingest.axes import T_ZUP_ARKIT
from ingest.formats.registry import read_session
from ingest.report.take_inspection import REPORT_DATA, REPORT_PAGE
from ingest.scan.cameras.register import register
from ingest.scan.clean_mesh import CleanMesh, clean, main_piece, save_mesh
from ingest.scan.cut_surface import cut_out, place_looked_at
from ingest.scan.dense.dense import DenseSurface, dense_surface
from ingest.scan.dense.depth_maps import measure_depths, surface_points
from ingest.scan.dense.stereo import DepthMaps, SmallPictures
from ingest.scan.mesh_sources import APP, read_scan_mesh, room_depth, room_file
from ingest.scan.region import aim_at, check_logged_aim, find_region
from ingest.scan.room_parts import has_floor, read_room, read_room_of_session
from ingest.scan.scan_choices import DRAFT, DRAFT_PICTURES, WHOLE
from ingest.scan.scan_pictures import pick_frames
from ingest.scan.scan_quality import ScanReport, inspect_ready, inspect_scan, one_sided
from ingest.scan.scan_sources import mesh_in, read_source
from ingest.scan.scan_types import Frames, Region, Registered, ScanSource
from ingest.scan.scan_work import ready_mesh
from ingest.scan.scanned_object import ScannedObject, to_height, write_object_model
from ingest.scan.silhouettes import Mask, find_silhouettes
from ingest.scan.texture_atlas import add_texture
from omomo_core.errors import InputError
from omomo_core.whole_file import write_whole
from render.video import write_png


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
            fix="Cut the object out of it (‹method› mesh, or ‹at› with a point on it); if all of it is "
            "the object, say its unit (‹unit›) or its height (‹height›).",
        )


def _check_at(request: ScanRequest, mesh: Path | None) -> None:
    cuts = request.method == "mesh" or mesh is not None
    if request.at is not None and not cuts:
        raise InputError(
            "scan-at",
            "A point on the object is of use only where the object is cut out of an app's mesh.",
            where=str(request.source),
            fix="Add ‹method› mesh, or leave out ‹at›.",
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


_SIDES = "The mesh from four sides: in its colours, and its shape alone."
_RIMS = "Two of the pictures: orange is the mesh's outline, blue the box that it was looked for in."


def write_report(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    scanned: ScannedObject | None,
    seconds: dict[str, float],
) -> None:
    """Write everything that says how good a scan is.

    Raises:
        InputError: those of `whole_file`.
    """
    work = request.work
    pictures: dict[str, UInt8[np.ndarray, "h w 3"]] = {_SIDES: views_picture(cleaned)}
    write_png(work / VIEWS, pictures[_SIDES])
    if scanned is not None and (outlined := outline_picture(scanned)) is not None:
        pictures[_RIMS] = outlined
        write_png(work / OUTLINE, outlined)
    data = report_data(request, cleaned, report, scanned, seconds)
    write_whole(work / REPORT_DATA, json.dumps(all_in_options(data), indent=1) + "\n")
    page = scan_page(request, cleaned, report, scanned, pictures)
    write_whole(work / REPORT_PAGE, in_options(page))


@dataclass(frozen=True)
class ObjectScan:
    """A mesh that was written, and how good it is."""

    request: ScanRequest
    cleaned: CleanMesh
    report: ScanReport
    found: ScannedObject | None
    """None for a ready mesh."""
    seconds: dict[str, float]
    """Seconds by stage."""


def scan_object(request: ScanRequest, progress: Progress) -> ObjectScan:
    """Turn a film of an object into its mesh; an interrupted one goes on where it was.

    Args:
        request: the inputs and options.
        progress: called with each stage ("look", "frames", "features", "compare", "match", "cameras",
            "board", "stereo", "silhouettes", "fusion", "colours", "clean", "texture", "report") and how
            far it is.

    Raises:
        InputError: what was given cannot become a mesh, or the output cannot be written.
    """
    open_folder(request)
    try:
        return _scanned(request, StageClock(progress))
    except InputError:
        forget_empty(request)
        raise


def _scanned(request: ScanRequest, clock: StageClock) -> ObjectScan:
    ready = made_by_app(request)
    found = find_object(request, clock) if ready is None else None
    cleaned = found.cleaned if found is not None else ready
    assert cleaned is not None
    clock("report", 0.0)
    report = inspect_ready(cleaned) if found is None else inspect_scan(found)
    if found is not None:
        model = request.work / MODEL
        write_object_model(
            found.registered.model, found.cleaned.T_world_object, found.stretched, model
        )
    scan = ObjectScan(request, cleaned, report, found, clock.seconds)
    write_report(scan.request, cleaned, report, found, scan.seconds)
    clock("report", 1.0)
    save_mesh(cleaned, request.output)
    if not request.keep:
        tidy(request)
    return scan


def find_object(request: ScanRequest, clock: Progress) -> ScannedObject:
    """The stages from pictures to the mesh, in metres; each keeps what it made in the folder."""
    work = request.work
    source = read_source(
        request.source, images=request.images, poses=request.cameras.poses, app=request.format
    )
    count = min(request.frames, DRAFT_PICTURES) if request.draft else request.frames
    picked = pick_frames(source, work, count=count, progress=clock)
    if request.cameras.poses and request.given_box is None:
        check_logged_aim(picked.frames)
    registered = register(source, picked, work, options=request.cameras, progress=clock)
    clock("cameras", 1.0)
    region, masks, surface = _measured(request, source, picked, registered, clock)
    clock("clean", 0.0)
    cleaned = clean(
        surface.vertices,
        surface.faces,
        surface.colours,
        region,
        request.output.stem,
        seen=surface.seen,
        most=request.vertices,
    )
    clock("clean", 1.0)
    if request.texture and not request.draft and request.output.suffix.lower() == ".glb":
        clock("texture", 0.0)
        cleaned = add_texture(cleaned, registered.views, masks)
        clock("texture", 1.0)
    found = ScannedObject(
        picked,
        registered,
        region,
        cleaned,
        surface.voxel,
        surface.method,
        _cut(surface),
        surface.mirror,
    )
    return to_height(found, request.cameras.height)


def _measured(
    request: ScanRequest,
    source: ScanSource,
    picked: Frames,
    registered: Registered,
    clock: Progress,
) -> tuple[Region, list[Mask | None], DenseSurface]:
    """Return the object's region, its outlines in all views, and its surface."""
    assert request.method != "mesh"  # made_by_app has cut the object out
    detail = DRAFT if request.draft else WHOLE
    aim = aim_at(registered.views, request.given_box)
    room = _room(request, source, registered, picked)
    depths = measure_depths(
        registered,
        aim,
        request.work,
        method=request.method,
        width=detail.matched,
        room=room,
        progress=clock,
    )
    region = find_region(registered, request.given_box, surface_points(depths, aim))
    pictures = SmallPictures(registered.views, detail.outlined)
    masks = find_silhouettes(pictures, depths, region, progress=clock)
    mirrored = request.symmetry == "on" or (
        request.symmetry == "auto" and one_sided(registered.views, region)
    )
    surface = dense_surface(
        depths,
        region,
        masks=masks,
        symmetry=mirrored,
        voxel=detail.voxel,
        progress=clock,
    )
    return region, masks, surface


def _room(
    request: ScanRequest, source: ScanSource, registered: Registered, picked: Frames
) -> DepthMaps | None:
    """Depth by the room's mesh, where one is given."""
    if request.room is None:
        return None
    if source.T_world_camera is None:
        raise InputError(
            "scan-mesh-elsewhere",
            "A mesh of the room needs the poses of the phone that made it.",
            where=str(request.source),
            fix="Give the session of the app, or leave out ‹room›.",
        )
    file = room_file(request.room, source.where)
    return room_depth(read_room_of_session(file).surface, registered, picked.frames, str(file))


def _cut(surface: DenseSurface) -> float:
    """Part of the surface that is not the object's, by area."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return 1 - float(area[main_piece(surface.vertices, surface.faces)].sum() / area.sum())
