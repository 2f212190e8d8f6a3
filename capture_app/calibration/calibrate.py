"""Recordings, drawings or points become a mount, by any of the ways, and its file."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np

from capture_app.commands.calibrate import (
    AnyWay,
    BoardWay,
    DrawingWay,
    FloorWay,
    HandWay,
    PointsWay,
    Ruler,
    ScanWay,
    SessionWay,
    TrackerWay,
    Way,
)
from capture_app.commands.inputs import MeshFile
from capture_app.progress import Progress, silent
from capture_app.scanning.scan_folder import IMAGES, MODEL
from ingest.archive import is_archive
from ingest.calibration.board.board_place import load_place, parse_grid
from ingest.calibration.board.board_spec import Board, Checkerboard
from ingest.calibration.board.board_track import TIMES, BoardTrack, track_session, track_video
from ingest.calibration.board.camera_file import load_camera
from ingest.calibration.drawn_mount import Drawn, Precision, body_mount, camera_mount
from ingest.calibration.floor_fit import refine
from ingest.calibration.hand_eye.to_mount import (
    calibrate_by_board,
    calibrate_by_motion,
    phone_stream,
    read_pose_log,
    refuse_other_lengths,
    refuse_own_log,
)
from ingest.calibration.phone_body import Phone, phone_named
from ingest.calibration.picked_points import Picked, mount_from_pairs
from ingest.calibration.point_pairs import PointPair, load_pairs
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
from ingest.mount import Mount, object_id
from ingest.mount_file import load_mount, save_mount
from ingest.report.take_inspection import work_folder
from ingest.scan.mesh_sources import model_in
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh


def phone_of(name: str, ruler: Ruler | None) -> Phone | None:
    """Return the phone of this model, or of these measurements; None when neither is given.

    Raises:
        InputError: as `phone_named`.
    """
    if ruler is not None:
        return phone_named(name or "measured phone", ruler)
    return phone_named(name) if name else None


def needed_phone(name: str, ruler: Ruler | None) -> Phone:
    """Return the phone, where there must be one.

    Raises:
        InputError: "phone-needed".
    """
    phone = phone_of(name, ruler)
    if phone is None:
        raise InputError(
            "phone-needed",
            "The model of the phone is not given.",
            field="phone",
            fix='Name it, such as ‹phone› "iPhone 15", or measure it with a ruler (‹ruler›).',
        )
    return phone


def by_board(way: BoardWay, progress: Progress) -> Mount:
    """Return the mount by a film of a board on the object; progress is called with the stage "board".

    Raises:
        InputError: of what is read, of the track, and of `calibrate_by_board`.
    """
    _check_object(way)
    board = parse_grid(way.board)
    place = load_place(way.place, board)
    stream = phone_stream(read_session(way.session, way.format))
    return calibrate_by_board(stream, _track(way, board, progress), place)


def _track(way: BoardWay, board: Board | Checkerboard, progress: Progress) -> BoardTrack:
    """Return the board's track in the film; a second phone's session brings its own intrinsics and poses."""
    known = load_camera(way.camera) if way.camera else None
    film = way.film
    video = film.is_file() and not is_archive(film)
    if video or (film / TIMES).is_file() or not film.exists():
        return track_video(film, board, known, progress=progress)
    return track_session(read_session(film), board, progress=progress)


def by_tracker(way: TrackerWay) -> Mount:
    """Return the mount by the log of a tracker that followed the same motion.

    Raises:
        InputError: of what is read, and of `calibrate_by_motion`.
    """
    _check_object(way)
    T_object_body = load_pose(way.body) if way.body else np.eye(4)
    session = read_session(way.session, way.format)
    phone = phone_stream(session)
    target = read_pose_log(way.poses)
    refuse_own_log(session, target, way.poses)
    refuse_other_lengths(phone, target, way.poses)
    return calibrate_by_motion(
        phone,
        target,
        inverse(T_object_body),
        np.zeros((6, 6)),
        "tracker",
    )


def _check_object(way: Way) -> None:
    """Refuse a mesh that cannot be read before the slow part."""
    if way.mesh_file is not None:
        way.mesh_file.load()


def by_session(way: SessionWay, progress: Progress) -> Mount:
    """Return the mount by one recording in which the object is filmed first and the phone clamped afterwards.

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
    """Return the end of the object's rest under the clamped phone, seconds on the log's clock."""
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
    """Return the mount by the phone's pictures in a scan; progress is called with the stage "localise".

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
                fix="Name the COLMAP model of the object's scan, or make the mesh with ‹omocap scan›.",
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


def by_drawing(way: DrawingWay) -> Mount:
    """Return the mount of a holder whose drawing says where the phone is.

    Raises:
        InputError: the numbers do not make a pose, or the phone is needed and not given.
    """
    drawn = Drawn(
        xyz=_spaced(way.xyz),
        axes=way.axes,
        euler=way.euler,
        quaternion=_spaced(way.quaternion),
        matrix=way.matrix,
    )
    precision = Precision(way.sigma_mm / 1e3, float(np.radians(way.sigma_deg)))
    if way.of == "camera":
        mount, phone = camera_mount(drawn.of_camera(), precision), phone_of(way.phone, way.ruler)
        return replace(mount, phone=phone.name if phone else mount.phone)
    phone = needed_phone(way.phone, way.ruler)
    T = drawn.of_body()
    return replace(body_mount(phone, T[:3, :3], T[:3, 3], way.point, precision), phone=phone.name)


def pairs_of(way: PointsWay) -> list[PointPair]:
    """Return the pairs of the file, and those that were typed or clicked.

    Raises:
        InputError: of `load_pairs`.
    """
    metres = way.sigma_mm / 1e3
    pairs = load_pairs(way.pair_file, metres) if way.pair_file else []
    return [*pairs, *(PointPair(pair.phone, pair.point, metres) for pair in way.pairs)]


def by_points(way: PointsWay) -> Picked:
    """Return the mount that pairs of points give, with how well they fit.

    Raises:
        InputError: the points do not determine it, or do not fit.
    """
    return mount_from_pairs(pairs_of(way), phone_of(way.phone, way.ruler), scaled=way.scale)


def _spaced(numbers: Sequence[float] | None) -> str | None:
    """Return numbers as they are written in a drawing."""
    return None if numbers is None else " ".join(map(repr, numbers))


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


def write_mount(
    mount: Mount,
    path: Path,
    mesh_file: MeshFile | None = None,
    phone: str = "",
    *,
    picture: Path | None,
) -> Mount:
    """Write the mount file; draw it where its object is known.

    Args:
        mount: the calibration; its date is set to today.
        path: of mount.json.
        mesh_file: the object it is for, when it is known.
        phone: its model, when it is known.
        picture: PNG file to draw both into; None draws nothing.

    Returns:
        The mount as it was written.

    Raises:
        InputError: as `load_mesh`, or a file cannot be written.
    """
    mesh = None if mesh_file is None else mesh_file.load(mount.object_scale)
    dated = replace(
        mount,
        date=date.today().isoformat(),
        phone=phone or mount.phone,
        object_id=mount.object_id or (object_id(mesh, mount.object_scale) if mesh else ""),
        picture=picture.name if picture and mesh else "",
    )
    save_mount(dated, path)
    if picture and mesh:
        from capture_app.posters import draw_mount

        draw_mount(dated, mesh, picture)
    return dated


def calibrate(
    way: AnyWay, path: Path, progress: Progress = silent, *, picture: Path | None = None
) -> Mount:
    """Find a mount and write it.

    Args:
        way: what was recorded.
        path: of the mount file.
        progress: called with the stages "board" and "localise".
        picture: PNG file to draw the phone on the object into, where the object is known.

    Returns:
        The mount as it was written.

    Raises:
        InputError: see `find_mount` and `write_mount`; nothing is written then.
    """
    mount = find_mount(way, progress)
    phone = mount.phone if isinstance(way, HandWay) else way.phone
    return write_mount(mount, path, way.mesh_file, phone, picture=picture)


def find_mount(way: AnyWay, progress: Progress) -> Mount:
    """Find it; progress is called with the stages "board" and "localise".

    Raises:
        InputError: what was recorded does not tell it, or cannot be read.
    """
    match way:
        case BoardWay():
            return by_board(way, progress)
        case SessionWay():
            return by_session(way, progress)
        case ScanWay():
            return by_scan(way, progress)
        case DrawingWay():
            return by_drawing(way)
        case PointsWay():
            return by_points(way).mount
        case FloorWay():
            return by_floor(way)
        case _:
            return by_tracker(way)
