"""Scene packs: a result, its film, a session or an object as one binary file for the viewer.

The layout of a scene pack: a JSON header, then plain arrays. What is in them is in docs/replay.md.
"""

import json
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import fast_simplification
import numpy as np
import torch
from jaxtyping import Float, Int

from capture_app.commands.spelling import all_in_options
from capture_app.exports.bones import creased, strongest_influences
from capture_app.inspection import Inspection, look_over, refuse_bad
from capture_app.motion_faults import Told, told_faults, told_grips
from capture_app.overlay.aligned import mount_of, session_of
from capture_app.picture_bytes import encoded
from capture_app.replay import PACK_VERSION
from capture_app.replay.session_track import filmed, recording
from capture_app.result import Result, body_of, sample_index
from ingest.mount import Mount
from ingest.report.checked_session import CheckedSession
from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import Reading
from omomo_core.body.kinematics import full_kinematics, vertex_normals
from omomo_core.body.model import BodyModel
from omomo_core.contact.contact_file import HANDS
from omomo_core.errors import InputError
from omomo_core.generation.person import Person
from omomo_core.geometry.rotations import xyzw_from_matrix
from omomo_core.geometry.surface import Surface, sample_surface
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, HumanMotion, ObjectMesh, ObjectMotion
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS
from render.cameras import pinhole
from render.views import share_shown

_ALIGN = 8
_EMPTY: dict[str, Any] = {
    "start_time": 0.0,
    "object": None,
    "body": None,
    "samples": 0,
    "unsolved": [],
    "chosen": 0,
    "first": 0,
    "scores": [],
    "contacts": [],
    "editable": False,
    "stretches": [],
    "floor": None,
    "report": None,
    "events": [],
    "notes": [],
    "faults": [],
    "grips": [],
    "phone": None,
    "filmed": [],
    "film": None,
    "fps": FPS,
    "joint_names": ALL_JOINTS,
    "joint_parents": ALL_PARENTS,
}


def pack_bytes(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """A scene pack.

    Args:
        header: what the JSON says besides `version` and `arrays`; what it leaves out is empty.
        arrays: by name; of types that a browser's typed arrays know (no 64 bits).
    """
    header_part: dict[str, Any] = {}
    parts: list[bytes] = []
    offset = 0
    for name, array in arrays.items():
        dtype = array.dtype.newbyteorder("<")
        raw = _padded(np.ascontiguousarray(array, dtype).tobytes())
        header_part[name] = {"dtype": dtype.str[1:], "shape": list(array.shape), "offset": offset}
        parts.append(raw)
        offset += len(raw)
    whole = {"version": PACK_VERSION, **_EMPTY, **header, "arrays": header_part}
    text = json.dumps(whole, allow_nan=False).encode()
    return b"".join([_padded(struct.pack("<I", len(text)) + text), *parts])


def _padded(raw: bytes) -> bytes:
    return raw + bytes(-len(raw) % _ALIGN)


MOST_FACES = 50_000
"""Most faces of an object that is looked at."""
MOST_TEXTURED = 4 * MOST_FACES
"""Most faces of an object with a texture, which it loses when it gets fewer faces."""

Arrays = dict[str, np.ndarray]


def body_arrays(body: BodyModel) -> Arrays:
    """The body at rest: `body_vertices`, `body_normals`, `body_faces`, `skin_*`, `rest_joints`."""
    joints, weights = strongest_influences(body)
    normals = vertex_normals(body.vertices, body.faces).numpy()
    return {
        "body_vertices": body.vertices.numpy().astype(np.float32),
        "body_normals": _bytes_of(normals),
        "body_faces": _indices(body.faces.numpy(), len(body.vertices)),
        "skin_joints": joints.astype(np.uint8),
        "skin_weights": np.rint(255 * weights).astype(np.uint8),
        "rest_joints": body.rest_joints.to(torch.float32).numpy(),
    }


def object_arrays(mesh: ObjectMesh) -> tuple[Arrays, bool]:
    """Return `object_vertices`, `object_normals`, `object_faces` in the object's frame, and if decimated."""
    shown = _light(mesh)
    surface = creased(shown)
    arrays: Arrays = {
        "object_vertices": surface.vertices.astype(np.float32),
        "object_normals": _bytes_of(surface.normals),
        "object_faces": _indices(surface.faces, len(surface.vertices)),
    }
    if surface.uv is not None and shown.texture is not None:
        picture = encoded(shown.texture.image)
        arrays["object_uv"] = surface.uv.astype(np.float32)
        arrays[f"object_{picture.ending}"] = np.frombuffer(picture.data, np.uint8)
    return arrays, shown is not mesh


def _light(mesh: ObjectMesh) -> ObjectMesh:
    if len(mesh.faces) <= (MOST_FACES if mesh.texture is None else MOST_TEXTURED):
        return mesh
    made = fast_simplification.simplify(
        mesh.vertices.astype(np.float64), mesh.faces.astype(np.int32), target_count=MOST_FACES
    )
    vertices, faces = made[0], made[1]
    return ObjectMesh(np.asarray(vertices, float), np.asarray(faces, np.int64), mesh.name)


def _bytes_of(normals: Float[np.ndarray, "n 3"]) -> np.ndarray:
    return np.rint(127 * normals.clip(-1, 1)).astype(np.int8)


def _indices(faces: Int[np.ndarray, "faces 3"], count: int) -> np.ndarray:
    return faces.astype(np.uint16 if count <= np.iinfo(np.uint16).max else np.uint32)


QUATERNION = 32767
"""A quaternion's 1 in 16 bits: turns are exact to 0.002 degrees."""
_MOST_FRAMES = 200_000
_GUESSED_HEIGHT = 1.0
"""Metres above the floor at which a phone is taken to start when nothing says where the floor is."""
_LOOKED_AT, _EVERY = 1000, 10
"""Pixels of a picture's height, and frames from one to the next, when it is asked whom a phone sees."""
_TOLD = ("events", "faults", "grips", "notes")


def pack_result(
    result: Result,
    *,
    name: str | None = None,
    words: Callable[[Any], Any] = all_in_options,
    film: bool = True,
    sample: int | None = None,
) -> bytes:
    """Every sample of a result, the object, and what the phone recorded as far as it is still there.

    Args:
        result: a result folder that is read.
        name: what its owner calls it; the folder's name if not given.
        words: brings what is told of it (checks, faults, notes) into the words of who shows it.
        film: show what the phone filmed, too; decoding it takes some of its length.
        sample: the one that is shown first, from 1; the chosen one if not given.

    Raises:
        InputError: "sample-missing".
        AssetError: the body was the user's own, and is not where it was.
    """
    body, moved, manifest = body_of(result), result.object_motion, result.manifest
    header_part, arrays = _recorded(result, film)
    thing = _object(moved.mesh)
    header = {
        "kind": "result",
        "name": name or result.folder.resolve().name,
        "frames": len(moved.valid),
        "start_time": moved.start_time,
        "body": {"name": body.name, "credit": body.credit, "height": body.height},
        "samples": len(result.people),
        "chosen": manifest.chosen,
        "first": sample_index(result, sample),
        "scores": manifest.scores,
        "editable": any(person.segments for person in result.people),
        "floor": manifest.floor.model_dump(),
        **_told_of_people(result),
        "notes": (*manifest.notes, *header_part.pop("notes", ())),
    }
    header = {**header, **thing[0], **header_part}
    return pack_bytes(
        header | {key: words(header[key]) for key in _TOLD if key in header},
        {
            **body_arrays(body),
            **_people_arrays(result.people, body),
            **thing[1],
            **_object_poses(moved),
            **arrays,
        },
    )


def pack_people(result: Result, *, words: Callable[[Any], Any] = all_in_options) -> bytes:
    """Pack the people of a result alone: what another correction of it changes in its scene.

    Args:
        result: as corrected.
        words: as for `pack_result`.
    """
    told = _told_of_people(result)
    header = {"kind": "people", "frames": len(result.object_motion.valid), **told}
    texts = {key: words(told[key]) for key in ("faults", "grips")}
    return pack_bytes(header | texts, _people_arrays(result.people, body_of(result)))


def _told_of_people(result: Result) -> dict[str, Any]:
    return {
        "unsolved": sorted(result.unsolved),
        "contacts": _contacts(result.people, result.object_motion.mesh),
        "faults": [_faults(result, k) for k in range(len(result.people))],
        "grips": [_placed(told_grips(person)) for person in result.people],
    }


def _faults(result: Result, k: int) -> list[dict[str, Any]]:
    """What could not be satisfied in a sample, as checks; nothing of one that is not solved yet."""
    if k in result.unsolved:
        return []
    told, chosen = told_faults(result.people[k]), k == result.manifest.chosen
    said = {one.sentence for one in told}
    general = [text for text in result.manifest.faults if chosen and text not in said]
    faults: dict[str, Any] = {"kind": "fault", "name": "motion", "severity": "warn", "fix": ""}
    placed = [faults | one for one in _placed(told)]
    return [*placed, *(faults | {"message": t, "start": None, "stop": None} for t in general)]


def _placed(told: Sequence[Told]) -> list[dict[str, Any]]:
    return [{"message": one.sentence, "start": one.start, "stop": one.stop - 1} for one in told]


def pack_film(result: Result) -> bytes:
    """Pack what the phone filmed during a result, apart from the rest, which is packed sooner.

    Args:
        result: a result folder that is read.
    """
    header: dict[str, Any] = {"kind": "film", "frames": len(result.object_motion.valid)}
    try:
        known = _log_of(result)
    except InputError:
        known = None
    if known is None:
        return pack_bytes(header, {})
    mount, session = known
    log = filmed(session, _phone_of(result, mount), result.manifest.segment.start)
    return pack_bytes({**header, **log.header}, log.arrays)


def pack_session(
    inspection: Inspection, *, words: Callable[[Any], Any] = all_in_options, film: bool = True
) -> bytes:
    """A session as it was recorded: the phone's way, and the object where its mesh was given.

    Args:
        inspection: the session, looked over; of one that is not usable all that there is.
        words: as for `pack_result`.
        film: show what the phone filmed, too; decoding it takes some of its length.

    Raises:
        InputError: its times or units make no sense, or it is hours long.
    """
    if not inspection.report.complete:
        refuse_bad(inspection)
    T_world_phone = _phone_poses(inspection)
    if len(T_world_phone) > _MOST_FRAMES:
        raise InputError(
            "replay-too-long",
            f"The session lasts {len(T_world_phone) / FPS / 60:.0f} minutes.",
            where=str(inspection.session.source),
            fix=f"Replay one of at most {_MOST_FRAMES / FPS / 60:.0f} minutes.",
        )
    log = recording(inspection, T_world_phone, 0, film)
    take = inspection.take
    thing, poses = ({}, {}), {}
    if inspection.mesh is not None and take is not None:
        thing, poses = _object(inspection.mesh), _object_poses(take.motion)
    header = {
        "kind": "session",
        "name": inspection.session.source.resolve().name,
        "frames": len(T_world_phone),
        "stretches": take.segments if take else [],
        "floor": {"height": take.floor.height, "source": take.floor.source} if take else None,
        "notes": take.notes if take else [str(inspection.problem)],
    }
    header = {**header, **thing[0], **log.header}
    return pack_bytes(
        header | {key: words(header[key]) for key in _TOLD if key in header},
        {**thing[1], **poses, **_phone_arrays(T_world_phone), **log.arrays},
    )


def pack_object(mesh: ObjectMesh, mount: Mount | None = None) -> bytes:
    """An object alone, in its own frame, raised until it stands on the floor.

    Args:
        mesh: the object, in metres.
        mount: where a phone is on it, to be shown too.
    """
    T = np.eye(4)[None].copy()
    T[0, 2, 3] = -float(mesh.vertices[:, 2].min())
    header_part, arrays = _object(mesh)
    header = {"kind": "object", "name": mesh.name, "frames": 1, **header_part}
    poses = _object_poses(ObjectMotion(mesh, T, np.ones(1, bool)))
    phone = {} if mount is None else _phone_arrays(T @ inverse(mount.T_phone_object))
    return pack_bytes(header, {**arrays, **poses, **phone})


def _recorded(result: Result, film: bool) -> tuple[dict[str, Any], Arrays]:
    """Return what the phone's log adds to a result; a note where the log is gone."""
    try:
        known = _log_of(result)
    except InputError as gone:
        return {"notes": (f"The recording is not shown. {gone.what}",)}, {}
    if known is None:
        return {}, {}
    mount, session = known
    options = result.manifest.options
    given: dict[str, Any] = {k: options[k] for k in Reading.__dataclass_fields__ if k in options}
    inspection = look_over(session, result.object_motion.mesh, mount, Reading(**given))
    T_world_phone = _phone_of(result, mount)
    log = recording(inspection, T_world_phone, result.manifest.segment.start, film)
    if lens := log.header["phone"]:
        log.header["filmed"] = _filmed(result, T_world_phone, lens)
    return log.header, {**log.arrays, **_phone_arrays(T_world_phone)}


def _filmed(
    result: Result, T_world_phone: Float[np.ndarray, "frames 4 4"], lens: Mapping[str, float]
) -> list[float]:
    """Part of the time in which the phone's camera sees each sample."""
    size = round(_LOOKED_AT * lens["aspect"]), _LOOKED_AT
    looks = slice(None, None, _EVERY)
    views = [pinhole(T, lens["fov_y"], *size) for T in T_world_phone[looks]]
    return [round(share_shown(h.joints[looks], views, *size), 3) for h in result.motions]


def _log_of(result: Result) -> tuple[Mount, CaptureSession] | None:
    """The mount and the phone's log of a result; None of an object that was animated.

    Raises:
        InputError: the log is gone, or is another one now.
    """
    if result.manifest.options.get("animated"):
        return None
    return mount_of(result), session_of(result)


def _phone_of(result: Result, mount: Mount) -> Float[np.ndarray, "frames 4 4"]:
    return result.object_motion.T_world_object @ inverse(mount.T_phone_object)


def _phone_poses(inspection: Inspection) -> Float[np.ndarray, "frames 4 4"]:
    """The phone in the world of the take; without one, in the session's turned z up."""
    T, _ = CheckedSession(
        inspection.session, inspection.mesh, inspection.mount, inspection.take
    ).poses
    if inspection.take is not None:
        return T
    shift = np.eye(4)
    shift[:3, 3] = [0.0, 0.0, _GUESSED_HEIGHT] - T[0, :3, 3]
    return shift @ T


def _people_arrays(people: Sequence[Person], body: BodyModel) -> Arrays:
    humans = [person.human for person in people]
    return {
        "root": np.stack([human.root for human in humans]).astype(np.float32),
        "rotations": np.stack([_rotations(human, body) for human in humans]),
        "hand_contact": _shares([human.hand_contact for human in humans]),
        "foot_contact": _shares([human.foot_contact for human in humans]),
        "palm_miss": np.stack([person.miss for person in people]).astype(np.float32),
        "inside": np.stack([person.depth for person in people]).astype(np.float32),
    }


def _rotations(human: HumanMotion, body: BodyModel) -> np.ndarray:
    parts = (torch.from_numpy(x).double() for x in (human.root, human.rotations, human.fingers))
    R = full_kinematics(body, *parts)[1].numpy()
    return np.rint(QUATERNION * xyzw_from_matrix(R)).astype(np.int16)


def _shares(values: Sequence[np.ndarray]) -> np.ndarray:
    return np.rint(255 * np.stack(values).clip(0, 1)).astype(np.uint8)


def _object(mesh: ObjectMesh) -> tuple[dict[str, Any], Arrays]:
    """The header's `object` and the surface; nothing for points without faces."""
    if not len(mesh.faces):
        return {}, {}
    arrays, decimated = object_arrays(mesh)
    header_part = {"name": mesh.name, "faces": len(mesh.faces), "decimated": decimated}
    return {"object": header_part}, arrays


def _object_poses(moved: ObjectMotion) -> Arrays:
    T = moved.T_world_object
    return {
        "object_position": T[:, :3, 3].astype(np.float32),
        "object_rotation": xyzw_from_matrix(T[:, :3, :3]).astype(np.float32),
        "valid": moved.valid.astype(np.uint8),
    }


def _phone_arrays(T_world_phone: Float[np.ndarray, "frames 4 4"]) -> Arrays:
    return {
        "phone_position": T_world_phone[:, :3, 3].astype(np.float32),
        "phone_rotation": xyzw_from_matrix(T_world_phone[:, :3, :3]).astype(np.float32),
    }


def _contacts(people: Sequence[Person], mesh: ObjectMesh) -> list[list[dict[str, Any]]]:
    """Return what the hands of each sample hold, with the nearest place on the surface."""
    surface = sample_surface(mesh) if len(mesh.faces) else None
    return [[_contact(s, surface) for s in person.segments] for person in people]


def _contact(segment: Any, surface: Surface | None) -> dict[str, Any]:
    header_part: dict[str, Any] = {
        "hand": HANDS[segment.hand],
        "start": segment.start,
        "stop": segment.stop,
        "anchor": segment.anchor.round(5).tolist(),
    }
    if surface is not None:
        nearest = int(surface.tree.query(segment.anchor)[1])
        header_part["place"] = surface.points[nearest].round(5).tolist()
        header_part["normal"] = surface.normals[nearest].round(5).tolist()
    return header_part
