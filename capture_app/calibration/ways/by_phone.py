"""Mounts by what the clamped phone itself recorded: with the object's scan, a board, or the floor."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from capture_app.commands.calibrate.by_phone import FloorWay, ScanWay, SessionWay
from capture_app.mesh_file import MeshFile
from capture_app.progress import Progress
from capture_app.scanning.folder import IMAGES, MODEL
from ingest.calibration.board.board_place import load_place, parse_grid
from ingest.calibration.board.board_track import track_session
from ingest.calibration.floor_fit import refine
from ingest.calibration.pose_file import load_pose, load_similarity
from ingest.calibration.scan_landmarks import read_landmarks
from ingest.calibration.scan_mount import Views, scan_mount, views_in, views_of
from ingest.calibration.session_mount import (
    ObjectPlacement,
    load_scan,
    placed_by_board,
    placed_by_hand,
    placed_by_scan,
    session_mount,
)
from ingest.calibration.still import CARRIED, Still, clamped_stills, named_stills
from ingest.formats.registry import read_session
from ingest.mount import Mount
from ingest.mount_file import load_mount
from ingest.report.inspect import work_folder
from ingest.scan.mesh_sources import model_in
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh


def by_session(way: SessionWay, progress: Progress) -> Mount:
    """By one recording in which the object is seen first and the phone clamped afterwards.

    Raises:
        InputError: those of what is read, and of `session_mount`.
    """
    log, mesh = read_session(way.session, way.format), MeshFile(way.object, way.mesh_scale).load()
    stills, note = chosen_stills(log, way.stills, way.clamped_at, CARRIED)
    placed = _placed(way, log, mesh, stills[0].start, progress)
    return replace(session_mount(log, mesh, placed, stills), note=note)


def _placed(
    way: SessionWay, log: CaptureSession, mesh: ObjectMesh, before: float, progress: Progress
) -> ObjectPlacement:
    """Where the object stood until the clamped phone stood still, seconds on the log's clock."""
    if way.object_pose is not None:
        pose = load_pose(way.object_pose)
        return placed_by_hand(log, mesh, pose, before, str(way.object_pose))
    if way.scan is not None:
        return placed_by_scan(log, mesh, load_scan(way.scan), before, str(way.scan))
    assert way.board is not None
    assert way.place is not None
    board = parse_grid(way.board)
    place = load_place(way.place, board)
    return placed_by_board(log, track_session(log, board, progress=progress), place, before)


def by_scan(way: ScanWay, progress: Progress) -> Mount:
    """By the clamped phone's pictures found in a scan; progress is called with the stage "localise".

    Raises:
        InputError: "scan-missing", those of what is read, and of `scan_mount`.
    """
    places, note = _places(way)
    T, scale = (
        (np.eye(4), 1.0) if way.model_to_object is None else load_similarity(way.model_to_object)
    )
    T[:3, :3] *= scale
    landmarks = read_landmarks(*_model(way), way.database, T)
    mount = scan_mount(landmarks, places, scale_sd=way.scale_sd / 100, progress=progress)
    return replace(mount, note=" ".join(text for text in (mount.note, note) if text))


def _model(way: ScanWay) -> tuple[Path, Path | None]:
    """The model's folder, also where the folder around it is given, and that of its pictures."""
    if way.model is None:
        work = work_folder(way.object)
        if not (work / MODEL).is_dir():
            raise InputError(
                "scan-missing",
                "The scan that made this mesh is not beside it: there are no pictures to find the phone "
                "in.",
                where=str(work),
                fix="Name the COLMAP model of the object's scan, or make the mesh with `omocap scan`.",
            )
        return work / MODEL, way.images or work / IMAGES
    model = model_in(way.model) if way.model.is_dir() else None
    beside = way.model / "images"
    return model or way.model, way.images or (beside if beside.is_dir() else None)


def _places(way: ScanWay) -> tuple[list[Views], str]:
    if way.photos is not None:
        return [views_in(way.photos, np.array(way.intrinsics))], ""
    assert way.session is not None
    log = read_session(way.session, way.format)
    stills, note = chosen_stills(log, way.stills, way.clamped_at, 0.0)
    return [views_of(log, one) for one in stills], note


def by_floor(way: FloorWay) -> Mount:
    """An earlier mount, refined by how the object stands on the floor.

    Raises:
        InputError: of what is read, and of `refine`.
    """
    first = load_mount(way.mount)
    metric = MeshFile(way.object, way.mesh_scale).load(first.object_scale)
    session = read_session(way.session, way.format)
    return refine(first, session, metric, phone_height=way.phone_height, floor=way.floor)


def chosen_stills(
    session: CaptureSession,
    spans: Sequence[tuple[float, float]],
    clamped_at: float,
    carried: float,
) -> tuple[list[Still], str]:
    """The stills that are named, or those found after the clamping, and a note about them.

    Args:
        session: the log.
        spans: seconds from its start; none are looked for.
        clamped_at: seconds from its start after which the phone is clamped; 0 where nobody says.
        carried: metres that the phone was carried before it was clamped, at least.

    Raises:
        InputError: those of `ingest.calibration.still`.
    """
    if spans:
        return named_stills(session, spans), ""
    return clamped_stills(session, after=clamped_at, path=0.0 if clamped_at else carried)
