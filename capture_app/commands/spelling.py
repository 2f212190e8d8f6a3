"""References to fields of requests, such as ‹mesh_scale›, as options of the command line and as labels.

Errors, checks and notes name fields without knowing who shows them, see `omomo_core.errors`.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import BaseModel

from capture_app.commands.calibrate import (
    BoardWay,
    DrawingWay,
    FloorWay,
    PointsWay,
    ScanWay,
    SessionWay,
    TrackerWay,
)
from capture_app.commands.export import ExportRequest
from capture_app.commands.inputs import option_of
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.commands.scan import ScanRequest
from omomo_core.errors import all_spelled, spelled

REQUESTS: dict[str, tuple[type[BaseModel], ...]] = {
    "run": (RunRequest,),
    "calibrate": (BoardWay, TrackerWay, SessionWay, ScanWay, FloorWay, DrawingWay, PointsWay),
    "scan": (ScanRequest,),
    "export": (ExportRequest,),
    "overlay": (OverlayRequest,),
    "render": (RenderRequest,),
    "compare": (CompareRequest,),
    "resolve": (ResolveRequest,),
}
"""What can be asked for, by kind of job."""
_OUTPUT = "-o"
"""The option for what is made, of every command."""


def as_option(reference: str) -> str:
    """Return a reference as it is typed: "mesh_scale" is --mesh-scale, "no poses" is --no-poses.

    A command stands in the quotes of code: "omocap scan" is `omocap scan`.
    """
    if reference.startswith("omocap "):
        return f"`{reference}`"
    return _options().get(reference) or f"--{reference.replace('_', '-').replace(' ', '-')}"


def in_options(text: str) -> str:
    """Return a text with the command line's options in place of its references."""
    return spelled(text, as_option)


def all_in_options(value: Any) -> Any:
    """Return JSON with all its texts as `in_options` has them."""
    return all_spelled(value, as_option)


@cache
def labels(kind: str) -> dict[str, str]:
    """Return the titles of fields, which are their labels on the page; first those of this kind of job."""
    titles: dict[str, str] = {}
    for model in (*REQUESTS.get(kind, ()), *_models()):
        for name, field in model.model_fields.items():
            if field.title:
                titles.setdefault(name, field.title)
    return titles


@cache
def _options() -> dict[str, str]:
    """Return the options that have another name than their field."""
    fields: Iterator[tuple[str, Any]] = (
        pair for model in _models() for pair in model.model_fields.items()
    )
    named = {name: option_of(name, field) for name, field in fields}
    usual = {name: f"--{name.replace('_', '-')}" for name in named}
    return {"output": _OUTPUT, **{n: option for n, option in named.items() if option != usual[n]}}


def _models() -> Iterator[type[BaseModel]]:
    return (model for models in REQUESTS.values() for model in models)
