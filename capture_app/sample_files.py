"""What a result folder holds of its chosen sample alone: contacts and GLB."""

from pathlib import Path

from capture_app.exports.glb import write_glb
from capture_app.manifest import CONTACTS, GLB
from omomo_core.body.model import BodyModel
from omomo_core.contact.file import write_contacts
from omomo_core.generation.person import Person
from omomo_core.motion import ObjectMotion


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
