"""Method session: the object is scanned and the phone clamped within one ARKit session."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import igl
import numpy as np
from jaxtyping import Bool, Float64

from ingest.axes import T_ZUP_ARKIT
from ingest.calibration.board.board_place import BoardPlace
from ingest.calibration.board.board_track import BoardTrack
from ingest.calibration.posterior import average
from ingest.calibration.session_align import register
from ingest.calibration.still import MAP_ERROR, Still, break_between, disagreeing, walked
from ingest.formats.json_log import load_object
from ingest.mesh import load_mesh
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.uncertainty import between, of_inverse, of_product
from omomo_core.errors import InputError, in_words
from omomo_core.geometry.surface import inside_mesh
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh

_FAR, _DEEP = 0.6, 0.05
"""Metres that a clamped phone's camera may be off the object's surface, and inside a rough mesh."""
_NEAR_ENOUGH = 3.0
"""Metres from which a phone sees the object well."""
_HALF_VIEW = np.radians(30.0)
"""Between the viewing axis and what is well inside the picture."""
_MIN_LOOKS = 1.0
"""Seconds that a scan takes at least."""
_GIVEN_SHIFT, _GIVEN_TURN = 0.003, np.radians(0.3)
"""Standard deviation on each axis (m, rad) of a pose that somebody gives."""


@dataclass(frozen=True)
class ObjectPlacement:
    """Pose of the object in the session's world before the phone was clamped to it."""

    T_world_object: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`, in the world's axes."""
    seen: float
    """Seconds from the start of the log when the phone last looked at it."""
    residuals: dict[str, float] = field(default_factory=dict[str, float])


def placed_by_scan(
    session: CaptureSession, mesh: ObjectMesh, scan: ObjectMesh, before: float, where: str
) -> ObjectPlacement:
    """The object where the session's own scan shows it.

    Args:
        session: the log.
        mesh: the object, in its own frame.
        scan: in the session's world.
        before: seconds from the start of the log when the phone was clamped.
        where: the scan's file, for messages.

    Raises:
        InputError: those of `register`, and "scan-elsewhere" when the phone never looked there.
    """
    found = register(mesh, scan, where)
    return ObjectPlacement(
        found.T_scan_object,
        found.covariance,
        _last_look(session, mesh, found.T_scan_object, before, where),
        {"scan_mm": 1e3 * found.rms, "scan_seen_%": 100 * found.overlap},
    )


def placed_by_hand(
    session: CaptureSession,
    mesh: ObjectMesh,
    T_world_object: Float64[np.ndarray, "4 4"],
    before: float,
    where: str,
) -> ObjectPlacement:
    """The object where somebody says that it is; see `placed_by_scan`."""
    covariance = np.diag(np.repeat([_GIVEN_TURN**2, _GIVEN_SHIFT**2], 3))
    seen = _last_look(session, mesh, T_world_object, before, where)
    return ObjectPlacement(T_world_object, covariance, seen)


def session_mount(
    session: CaptureSession, mesh: ObjectMesh, placed: ObjectPlacement, stills: Sequence[Still]
) -> Mount:
    """Return the mount: T_phone_object = inverse(T_world_phone) T_world_object.

    Args:
        session: the log.
        mesh: the object, in its own frame.
        placed: where it stood in the session's world.
        stills: of the clamped phone, with the object standing there.

    Raises:
        InputError: "session-broken" when the tracking broke between scan and still,
            "session-slipped" when two stills disagree, "session-place" when the phone would be
            where no clamp holds it.
    """
    first = stills[0]
    if (fault := break_between(session, placed.seen, first.stop)) is not None:
        raise InputError(
            "session-broken",
            f"Between the scan and the clamped phone's rest ({first}) {fault}: the world of the "
            "scan may not be that of the rest.",
            where=str(session.source),
            fix="Scan, clamp and record in one session without covering the camera or leaving the "
            "app; move calmly while you clamp.",
        )
    T = np.array([still.T_world_phone for still in stills])
    covariances = np.array(
        [still.covariance(walked(session, placed.seen, still.start)) for still in stills]
    )
    _check_agreement(session, stills, T, covariances)
    phone = average(T, covariances)
    # The mean takes the map's error for that of each still, but they share it.
    shared = MAP_ERROR * (1 - 1 / len(stills))
    T_phone_world = inverse(phone.T)
    mount = Mount(
        T_phone_world @ placed.T_world_object,
        "session",
        covariance=of_product(
            T_phone_world,
            of_inverse(phone.T, phone.covariance + shared),
            placed.T_world_object,
            placed.covariance,
        ),
        residuals={**placed.residuals, **_spread(phone.T, T)},
    )
    _check_place(session, mesh, mount)
    return mount


def _spread(
    mean: Float64[np.ndarray, "4 4"], T: Float64[np.ndarray, "stills 4 4"]
) -> dict[str, float]:
    """How far the stills are from their mean."""
    if len(T) < 2:
        return {}
    steps = between(mean[None], T).reshape(-1, 2, 3)
    turn, shift = np.sqrt((steps**2).sum(axis=-1).mean(axis=0))
    return {"stills_mm": 1e3 * float(shift), "stills_deg": float(np.degrees(turn))}


def _check_agreement(
    session: CaptureSession,
    stills: Sequence[Still],
    T: Float64[np.ndarray, "stills 4 4"],
    covariances: Float64[np.ndarray, "stills 6 6"],
) -> None:
    pair = disagreeing(T, covariances)
    if pair is None:
        return
    step = between(T[pair[0]], T[pair[1]])
    raise InputError(
        "session-slipped",
        f"The phone is {1e3 * np.linalg.norm(step[3:]):.0f} mm and "
        f"{np.degrees(np.linalg.norm(step[:3])):.1f} deg elsewhere at {stills[pair[1]]} than at "
        f"{stills[pair[0]]}: the object was moved, or the phone slipped on it.",
        where=str(session.source),
        fix="Put the object back on its mark before each rest, tighten the clamp and record again; "
        "or name only the seconds in which it stood where it was scanned (‹stills›).",
    )


def _last_look(
    session: CaptureSession,
    mesh: ObjectMesh,
    T_world_object: Float64[np.ndarray, "4 4"],
    before: float,
    where: str,
) -> float:
    """When the phone last had the object well in its picture, seconds from the start."""
    seconds = session.times - session.times[0]
    looks = (seconds < before) & _looks(session, mesh, T_world_object)
    period = float(np.median(np.diff(session.times)))
    if looks.sum() * period < _MIN_LOOKS:
        raise InputError(
            "scan-elsewhere",
            f"In the {before:.0f} s before it was clamped, the phone looked for "
            f"{looks.sum() * period:.1f} s at where the object would be.",
            where=where,
            fix="Give a scan in the world of this very session (y up, metres, as the app exports it; "
            "not one that was turned, moved or cropped to a new origin).",
        )
    return float(seconds[np.flatnonzero(looks)[-1]])


def _looks(
    session: CaptureSession, mesh: ObjectMesh, T_world_object: Float64[np.ndarray, "4 4"]
) -> Bool[np.ndarray, " frames"]:
    """Whether the middle of the object is in front of the camera, near enough and not too near."""
    box = np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
    middle = T_world_object[:3, :3] @ box.mean(axis=0) + T_world_object[:3, 3]
    seen = np.einsum(
        "nji,nj->ni", session.T_world_phone[:, :3, :3], middle - session.T_world_phone[:, :3, 3]
    )
    distance = np.linalg.norm(seen, axis=1)
    ahead = -seen[:, 2] > np.cos(_HALF_VIEW) * distance
    radius = np.linalg.norm(np.ptp(box, axis=0)) / 2
    return ahead & (distance > radius / 2) & (distance < _NEAR_ENOUGH + radius)


def _check_place(session: CaptureSession, mesh: ObjectMesh, mount: Mount) -> None:
    """Refuse a phone far from the object, or deep inside it."""
    phone = inverse(mount.T_phone_object)[None, :3, 3]
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    kind = igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    distance = np.asarray(igl.signed_distance(phone, vertices, faces, sign_type=kind)[0]).item()
    inside = inside_mesh(mesh, phone).item()
    if distance < (_DEEP if inside else _FAR):
        return
    raise InputError(
        "session-place",
        f"The clamped phone's camera would be {distance:.2f} m "
        f"{'inside' if inside else 'from'} the object.",
        where=str(session.source),
        fix="The object must stay where it was scanned until the phone is clamped and has stood "
        "still; name those seconds (‹stills›) if others were taken.",
    )


_MIN_SEEN = 10
_POSE = np.diag([np.radians(0.1) ** 2] * 3 + [0.001**2] * 3)
"""Covariance of each of the phone's poses (rad, m)."""
_LENS = np.diag([np.radians(0.1) ** 2] * 3 + [0.0015**2] * 3)
"""Covariance of what all pictures of one camera share (rad, m)."""


def placed_by_board(
    session: CaptureSession, track: BoardTrack, place: BoardPlace, before: float
) -> ObjectPlacement:
    """The object where the board on it was seen.

    Args:
        session: the log.
        track: the board in the session's own pictures.
        place: the board on the object.
        before: seconds from the start of the log when the phone was clamped.

    Raises:
        InputError: "board-few" when the board was hardly seen before the clamping.
    """
    seconds = track.times - session.times[0]
    chosen = np.flatnonzero(seconds < before)
    if track.T_world_camera is None or len(chosen) < _MIN_SEEN:
        raise InputError(
            "board-few",
            f"The phone saw the board in {len(chosen)} pictures before it was clamped.",
            where=str(session.source),
            fix="Film the board on the object from several sides for ten seconds, then clamp the "
            "phone without stopping the log.",
        )
    T_world_camera = track.T_world_camera[chosen]
    T = T_world_camera @ track.T_camera_board[chosen]
    covariances = np.array(
        [
            of_product(camera, _POSE, board, covariance)
            for camera, board, covariance in zip(
                T_world_camera, track.T_camera_board[chosen], track.covariance[chosen], strict=True
            )
        ]
    )
    mean = average(T, covariances)
    off = between(mean.T[None], T[mean.kept]).reshape(-1, 2, 3)
    turn, shift = np.sqrt((off**2).sum(axis=-1).mean(axis=0))
    T_board_object = inverse(place.T_object_board)
    covariance = of_product(
        mean.T,
        mean.covariance + _LENS,
        T_board_object,
        of_inverse(place.T_object_board, place.covariance),
    )
    return ObjectPlacement(
        mean.T @ T_board_object,
        covariance,
        float(seconds[chosen[-1]]),
        {
            "board_mm": 1e3 * float(shift),
            "board_deg": float(np.degrees(turn)),
            "board_seen": float(mean.kept.sum()),
        },
    )


_GLTF = (".glb", ".gltf")
_POLYCAM = "mesh_info.json"


def load_scan(path: Path) -> ObjectMesh:
    """Read a scan's mesh in ARKit's axes: y up, metres, as its app exports it.

    Polycam turns and moves what it exports, and says how in the mesh_info.json beside it; that is
    undone.

    Raises:
        InputError: those of `load_mesh`, or "scan-damaged" for a mesh_info.json that is none.
    """
    mesh = load_mesh(path)
    vertices = np.asarray(mesh.vertices, np.float64)
    if path.suffix.lower() in _GLTF:  # which load_mesh has turned z up
        vertices = vertices @ T_ZUP_ARKIT[:3, :3]
    T = np.linalg.inv(_alignment(path.parent / _POLYCAM))
    return replace(mesh, vertices=vertices @ T[:3, :3].T + T[:3, 3])


def _alignment(path: Path) -> Float64[np.ndarray, "4 4"]:
    """What maps the session's world into Polycam's export: 16 numbers, column by column."""
    if not path.is_file():
        return np.eye(4)
    try:
        numbers = np.array(load_object(path)["alignmentTransform"], np.float64)
        T = numbers.reshape(4, 4).T
        if not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-3):
            raise ValueError("alignmentTransform is no rotation with an offset")
    except (ValueError, KeyError, TypeError) as problem:
        raise InputError(
            "scan-damaged",
            f"Polycam's file does not say how the mesh was moved: {in_words(problem)}.",
            where=str(path),
            fix="Export the raw data again.",
        ) from problem
    return T
