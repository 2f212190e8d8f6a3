"""Forms of the page as the descriptions of requests have them: an option is added to its model alone."""

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from capture_app.commands.inputs import FromLibrary, OptionGroup, group_of
from capture_app.commands.reading import ReadingOptions

Described = dict[str, Any]
"""A field of a form: `name`, `title`, `hint`, `group`, and `kind` with what that kind needs. The page makes
fields of the kinds "number", "tick", "choice", "text" and, with a list of what is stored, "brought": of the
library's `shelves`, or dropped as `drop` says. Of a field of kind "own" it must know by itself."""

_COMMAND = re.compile(r"\s*[^.]*`omocap[^.]*\.|;[^.;]*`omocap[^.;]*(?=\.)")
"""What a description says of the command line."""


def form_of(
    model: type[BaseModel],
    *,
    leave_out: Collection[str] = (),
    known: Mapping[str, Sequence[str]] | None = None,
) -> list[Described]:
    """Return the fields of the form for a request; the sample is always the one that is shown.

    Args:
        model: the request.
        leave_out: what the page asks otherwise.
        known: the values that a field may have, by its name, where the server knows them all.
    """
    schema = model.model_json_schema()
    named = schema.get("$defs", {})
    return [
        _described(name, said, named, known or {})
        | {"group": _group(model, name)}
        | _brought(model.model_fields[name].metadata)
        for name, said in schema["properties"].items()
        if name not in leave_out and name != "sample"
    ]


def _brought(marks: Sequence[object]) -> Described:
    """Return what a form needs for something that is taken from the library, or dropped."""
    for mark in marks:
        if isinstance(mark, FromLibrary) and mark.drop[0]:
            asked = {"shelves": mark.kinds, "drop": mark.drop, "accept": mark.accept}
            return {"kind": "brought", **asked}
    return {}


def _group(model: type[BaseModel], name: str) -> str:
    if name in ReadingOptions.model_fields:
        return "reading"
    return "main" if group_of(model.model_fields[name]) is OptionGroup.MAIN else "more"


def _described(
    name: str, said: Described, named: Described, known: Mapping[str, Sequence[str]]
) -> Described:
    parts = [named.get(p.get("$ref", "").rpartition("/")[2], p) for p in said.get("anyOf", [said])]
    typed = [part for part in parts if part.get("type") != "null"]
    optional, words = len(typed) < len(parts), said.get("words", {})
    one = typed[0] if len(typed) == 1 else {}
    made = {
        "name": name,
        "title": said["title"],
        "hint": "" if words else _hint(said),
        "unit": said.get("unit"),
        "value": said.get("default"),
        **_kind(one, words, known.get(name), optional),
    }
    return {key: value for key, value in made.items() if value is not None}


def _kind(
    part: Described, words: Mapping[str, str], known: Sequence[str] | None, optional: bool
) -> Described:
    type_ = part.get("type")
    switch = ("true", "false") if type_ == "boolean" and optional else ()
    if values := known or part.get("enum") or switch:
        all_ = not set(words) - {""}
        offered = [str(one) for one in values if all_ or str(one) in words]
        none = [["", words.get("", "as usual")]] if optional else []
        return {"kind": "choice", "options": [*none, *([v, words.get(v, v)] for v in offered)]}
    if type_ in ("number", "integer"):
        bounds = {"min": part.get("minimum"), "max": part.get("maximum")}
        step = 1 if type_ == "integer" else None
        return {"kind": "number", "step": step, "required": not optional, **bounds}
    text = type_ == "string" and not {"pattern", "const"} & set(part)
    return {"kind": "tick" if type_ == "boolean" else "text" if text else "own"}


def _hint(said: Described) -> str:
    """What the description says beside the title."""
    text = _COMMAND.sub("", said.get("description", "")).strip()
    rest = re.sub(rf"^(?i:{re.escape(said['title'])})[.;:]\s*", "", text)
    return rest[:1].upper() + rest[1:]
