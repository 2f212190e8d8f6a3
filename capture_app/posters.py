"""Small pictures by which a result, an object or a mount is known in a list."""

from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from capture_app.inspection import Inspection
from capture_app.result import Result, body_of
from ingest.calibration.phone_body import Phone, phone_body, phone_named
from ingest.mount import Mount
from ingest.uncertainty import bounds_95
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.generation.person import Person
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from omomo_core.whole_file import whole_file
from render.backends import open_renderer
from render.cameras import orbit, pinhole
from render.mount_view import mount_picture, take_picture
from render.props import solid
from render.scene import Scene
from render.third_person import frames
from render.video import write_png
from render.views import shot

RGB = UInt8[np.ndarray, "h w 3"]
_ANY_PHONE = "iPhone 13"
"""Drawn where the model is not known; phones differ by millimetres."""


def draw_mount(mount: Mount, mesh: ObjectMesh, path: Path) -> None:
    """Draw the object, in metres, with the phone on it into a PNG file."""
    label = mount.method
    if mount.covariance is not None:
        bounds = bounds_95(mount.covariance)
        label += f": {bounds.mm:.1f} mm, {bounds.deg:.1f} deg"
    write_png(path, mount_views(mount, mesh, label=label))


def mount_views(
    mount: Mount, mesh: ObjectMesh, *, label: str = "", side: int = 420
) -> UInt8[np.ndarray, "h w 3"]:
    """Three views of the object, in metres, with the phone on it, beside each other.

    Args:
        mount: where the phone is.
        mesh: of the object.
        label: in the corner of the first view.
        side: of each view, pixels.
    """
    phone = _drawn_phone(mount.phone)
    T_phone_body = phone_body(phone)[0]
    return mount_picture(
        mesh, mount.T_phone_object, T_phone_body, phone.body, label=label, side=side
    )


def take_views(inspection: Inspection, *, side: int = 420) -> RGB | None:
    """Draw the object with the phone on it at rest and in mid-motion; None where the object is not known.

    Args:
        inspection: of the take.
        side: of each view, pixels.
    """
    if inspection.take is None or inspection.mesh is None or not len(inspection.mesh.faces):
        return None
    motion, phone = inspection.take.motion, _drawn_phone(inspection.mount.phone)
    start, stop = inspection.take.segments[inspection.take.chosen]
    away = np.linalg.norm(
        motion.T_world_object[start:stop, :3, 3] - motion.T_world_object[start, :3, 3], axis=1
    )
    highest = start + int((motion.T_world_object[start:stop, 2, 3] + 0.1 * away).argmax())
    moments = {
        f"{name}, {frame / FPS:.1f} s": frame
        for name, frame in (("first", start), ("in mid-motion", highest), ("last", stop - 1))
    }
    T_phone_body = phone_body(phone)[0]
    return take_picture(
        motion, moments, inspection.mount.T_phone_object, T_phone_body, phone.body, side=side
    )


def _drawn_phone(name: str) -> Phone:
    try:
        return phone_named(name)
    except InputError:
        return phone_named(_ANY_PHONE)


_SIZE = (480, 270)
_SIDE = 270
_FOV, _MARGIN, _AZIMUTH, _LIFT = 0.55, 1.1, -0.7, 0.4
_QUALITY = 80


def person_picture(person: Person, moved: ObjectMotion, body: BodyModel) -> RGB:
    """Draw a sample in the middle of its longest contact."""
    longest = max(person.segments, key=lambda one: one.stop - one.start, default=None)
    frame = len(moved.valid) // 2 if longest is None else (longest.start + longest.stop) // 2
    pictures = frames(
        person.human,
        moved,
        body,
        width=_SIZE[0],
        height=_SIZE[1],
        cameras=shot("third", person.human, moved, *_SIZE).cameras,
        samples=4,
        only=[min(frame, len(moved.valid) - 1)],
    )
    return next(iter(pictures))


def result_poster(path: Path, result: Result) -> None:
    """Write the poster of a result: its chosen sample."""
    person = result.people[result.manifest.chosen]
    _write(path, person_picture(person, result.object_motion, body_of(result)))


def object_poster(path: Path, mesh: ObjectMesh) -> None:
    """Draw an object, seen from in front of it and from above."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    distance = _MARGIN * float(np.linalg.norm(high - low)) / 2 / np.sin(_FOV / 2)
    T = orbit((low + high) / 2, distance, _AZIMUTH, _LIFT)
    with open_renderer(_SIDE, _SIDE) as renderer:
        renderer.show(Scene([solid(mesh)]))
        _write(path, renderer.color(pinhole(T, _FOV, _SIDE, _SIDE)))


def mount_poster(path: Path, mount: Mount, mesh: ObjectMesh) -> None:
    """Draw the phone on the object, in metres."""
    _write(path, mount_views(mount, mesh, side=_SIDE)[:, :_SIDE])


def take_poster(path: Path, inspection: Inspection) -> bool:
    """Draw the object with the phone on it at three moments of a take; returns whether it is known."""
    picture = take_views(inspection)
    if picture is not None:
        _write(path, picture)
    return picture is not None


def _write(path: Path, picture: RGB) -> None:
    with whole_file(path) as partial:
        Image.fromarray(picture).save(partial, "WEBP", quality=_QUALITY)
