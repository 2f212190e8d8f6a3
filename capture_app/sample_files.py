"""What a result folder holds of its chosen sample alone: contacts, GLB and video."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from capture_app.exports.glb import write_glb
from capture_app.manifest import CONTACTS, GLB, VIDEO
from capture_app.progress import Progress
from omomo_core.body.model import BodyModel
from omomo_core.contact.file import write_contacts
from omomo_core.generation.person import Person
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from render.third_person import frames
from render.video import write_video
from render.views import View, shot


def export_sample(
    folder: Path, person: Person, object_motion: ObjectMotion, body: BodyModel, contacts: bool
) -> None:
    """Write the files that other programs open.

    Args:
        folder: of the result.
        person: the chosen sample.
        object_motion: the object, as many frames as the person.
        body: whose bones the person moves.
        contacts: write contacts.json; the published rule has none.
    """
    if contacts:
        write_contacts(folder / CONTACTS, person.segments, len(object_motion.valid))
    write_glb(folder / GLB, person.human, object_motion, body)


def draw_sample(
    folder: Path,
    person: Person,
    object_motion: ObjectMotion,
    body: BodyModel,
    size: tuple[int, int],
    view: View,
    progress: Progress,
) -> None:
    """Write the video.

    Args:
        folder, person, object_motion, body: as for `export_sample`.
        size: width and height in pixels.
        view: where it is seen from.
        progress: progress callback of the stage "video".
    """
    pictures = _watched(person.human, object_motion, body, size, view, progress)
    write_video(folder / VIDEO, pictures, FPS)


def _watched(
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
    size: tuple[int, int],
    view: View,
    progress: Progress,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """The video's pictures; `progress` is called as they are drawn."""
    width, height = size
    seen = shot(view, human, object_motion, width, height)
    pictures = frames(
        human,
        object_motion,
        body,
        width=width,
        height=height,
        cameras=seen.cameras,
        extra=seen.tracks,
        pixels_per_metre=seen.pixels_per_metre,
    )
    for k, picture in enumerate(pictures):
        yield picture
        progress("video", (k + 1) / len(human.root))
