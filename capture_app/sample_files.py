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
    progress: Progress,
) -> None:
    """Write the video.

    Args:
        folder, person, moved, body: as for `export_sample`.
        size: width and height in pixels.
        progress: told the stage "video".
    """
    pictures = _watched(person.human, object_motion, body, size, progress)
    write_video(folder / VIDEO, pictures, FPS)


def _watched(
    human: HumanMotion,
    object_motion: ObjectMotion,
    body: BodyModel,
    size: tuple[int, int],
    progress: Progress,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """The video's pictures, told to `progress` as they are drawn."""
    for k, picture in enumerate(frames(human, object_motion, body, width=size[0], height=size[1])):
        yield picture
        progress("video", (k + 1) / len(human.root))
