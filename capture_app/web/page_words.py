"""page_words: texts of the program with the words of the page in place of the command line's.

Errors and reports name an option as the command line spells it ("--mesh-scale"). The title of the field of a
request is its label on the page. They also name commands ("`omocap scan`"), which are buttons on the page.
"""

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel

from capture_app.commands.calibrate import (
    BoardWay,
    FloorWay,
    ScanWay,
    ScreenWay,
    SessionWay,
    TrackerWay,
)
from capture_app.commands.export import ExportRequest
from capture_app.commands.inputs import option_of
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.commands.scan import ScanRequest

_ASKED: dict[str, tuple[type[BaseModel], ...]] = {
    "run": (RunRequest,),
    "calibrate": (BoardWay, ScreenWay, TrackerWay, SessionWay, ScanWay, FloorWay),
    "scan": (ScanRequest,),
    "export": (ExportRequest,),
    "overlay": (OverlayRequest,),
    "render": (RenderRequest,),
    "compare": (CompareRequest,),
    "resolve": (ResolveRequest,),
}
"""By kind of job; where a text belongs to none, an earlier one's label is taken."""
_BUTTONS = {
    "calibrate": "Find it now, step by step",
    "formats": "Recorded with",
    "resolve": "Solve again",
    "run": "Make the motion",
    "scan": "Make it from a film",
}
"""What the page calls a command; others are only named."""
_COMMAND = re.compile(r"`omocap ([a-z-]+)([^`]*)`")
_OPTION = re.compile(r"(?<![\w-])--(no-)?([a-z][a-z-]*[a-z])\b")


def in_page_words(text: str, kind: str = "") -> str:
    """Return a text with the page's label in place of each option, in quotation marks.

    An option that the page does not have is said by its words alone. A command is said by its button.

    Args:
        text: of an error, a check or a note.
        kind: of the job that it is about; "" if none.
    """
    text = _COMMAND.sub(lambda found: f"“{_BUTTONS.get(found[1], f'omocap {found[1]}')}”", text)
    return _OPTION.sub(lambda found: _said(found[1] or "", found[2], kind), text)


def all_in_page_words(value: Any, kind: str = "") -> Any:
    """Return JSON with all its texts in the page's words."""
    if isinstance(value, str):
        return in_page_words(value, kind)
    if isinstance(value, Mapping):
        return {key: all_in_page_words(part, kind) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [all_in_page_words(part, kind) for part in value]
    return value


def _said(no: str, option: str, kind: str) -> str:
    labels = _labels(kind)
    whole = f"--{no}{option}"
    if whole in labels:
        return f"“{labels[whole]}”"
    label = labels.get(f"--{option}", option.replace("-", " "))
    return f"“{label}” switched off" if no else f"“{label}”"


@cache
def _labels(kind: str) -> dict[str, str]:
    first = _ASKED.get(kind, ())
    rest = (model for models in _ASKED.values() for model in models)
    labels: dict[str, str] = {}
    for model in (*first, *rest, *_forms()):
        for name, field in model.model_fields.items():
            if field.title:
                labels.setdefault(option_of(name, field), field.title)
    return labels


def _forms() -> tuple[type[BaseModel], ...]:
    """Mounts that are made from a form alone, which no command asks for by a request."""
    from capture_app.web.routes.mounts import Drawing, Points

    return (Drawing, Points)
