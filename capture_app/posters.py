"""Posters: a small picture by which a result, an object or a mount is known in a list."""

from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from capture_app.calibration.picture import mount_views
from capture_app.result import Result, body_of
from ingest.mount import Mount
from omomo_core.body.model import BodyModel
from omomo_core.generation.person import Person
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.whole_file import whole_file
from render.backends import open_renderer
from render.cameras import orbit, pinhole
from render.props import solid
from render.scene import Scene
from render.third_person import frames
from render.views import shot

_SIZE = (480, 270)
_SIDE = 270
_FOV, _MARGIN, _AZIMUTH, _LIFT = 0.55, 1.1, -0.7, 0.4
_QUALITY = 80

RGB = UInt8[np.ndarray, "h w 3"]


def person_picture(person: Person, moved: ObjectMotion, body: BodyModel) -> RGB:
    """Draw a sample in the middle of its longest contact."""
    held = max(person.segments, key=lambda one: one.stop - one.start, default=None)
    frame = len(moved.valid) // 2 if held is None else (held.start + held.stop) // 2
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


def _write(path: Path, picture: RGB) -> None:
    with whole_file(path) as partial:
        Image.fromarray(picture).save(partial, "WEBP", quality=_QUALITY)
