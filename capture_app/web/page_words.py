"""page_words: texts of the program in the words of the page.

A reference to a field, such as ‹mesh_scale›, is said by its label on the page, a command by its button.
"""

from functools import partial
from typing import Any

from capture_app.commands.spelling import labels
from omomo_core.errors import all_spelled, spelled

_BUTTONS = {
    "calibrate": "Find it now, step by step",
    "formats": "Recorded with",
    "resolve": "Keep it as a new motion",
    "run": "Make the motion",
    "scan": "Make it from a film",
}
"""What the page calls a command; others are only named."""


def in_page_words(text: str, kind: str = "") -> str:
    """Return a text with the page's label in place of each reference, in quotation marks.

    A field that the page does not have is said by its name alone.

    Args:
        text: of an error, a check or a note.
        kind: of the job that it is about; "" if none.
    """
    return spelled(text, partial(_as_label, kind))


def all_in_page_words(value: Any, kind: str = "") -> Any:
    """Return JSON with all its texts in the page's words."""
    return all_spelled(value, partial(_as_label, kind))


def _as_label(kind: str, reference: str) -> str:
    if reference.startswith("omocap "):
        return f"“{_BUTTONS.get(reference.split()[1], reference)}”"
    field = reference.removeprefix("no ")
    label = labels(kind).get(field, field.replace("_", " "))
    return f"“{label}” switched off" if field != reference else f"“{label}”"
