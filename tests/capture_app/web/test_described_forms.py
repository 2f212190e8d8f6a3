"""A form of the page: what a model says of a field is what the page makes of it."""

from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, Field

from capture_app.commands.inputs import OptionGroup, shown
from capture_app.web.described_forms import form_of
from capture_app.web.routes.about import choices
from capture_app.web.routes.orders import RunOptions


class Whole(BaseModel):
    """One field of each kind."""

    size: Annotated[
        float | None,
        OptionGroup.RESULT,
        shown("m"),
        Field(title="Size", ge=1, le=3, description="How large."),
    ] = None
    count: Annotated[
        int, Field(title="Count", ge=2, description="Run `omocap it`. Count; how many.")
    ] = 3
    on: Annotated[bool, Field(title="On", description="On.")] = True
    way: Annotated[
        Literal["a", "b", "c"],
        shown(words="a: one way; b: another"),
        Field(title="Way"),
    ] = "a"
    may: Annotated[bool | None, shown(words=": if it can"), Field(title="May")] = None
    text: Annotated[str, Field(title="Text")] = "so"
    place: Annotated[tuple[float, float] | None, Field(title="Place")] = None


def test_each_kind_of_field_is_as_it_is_described():
    size, count, on, way, may, text, place = form_of(Whole)
    assert size == {
        "name": "size", "kind": "number", "title": "Size", "hint": "How large.", "unit": "m",
        "required": False, "min": 1, "max": 3, "group": "more",
    }  # fmt: skip
    assert (count["required"], count["value"], count["step"]) == (True, 3, 1)
    assert count["hint"] == "How many."
    assert (on["kind"], on["value"], on["hint"]) == ("tick", True, "")
    assert way["options"] == [["a", "one way"], ["b", "another"]]
    assert may["options"] == [["", "if it can"], ["true", "true"], ["false", "false"]]
    assert (text["kind"], text["value"], place["kind"]) == ("text", "so", "own")


def test_what_a_server_knows_is_offered_and_what_is_left_out_is_not():
    (way, text) = form_of(
        Whole,
        leave_out={"size", "count", "on", "may", "place"},
        known={"text": ["x", "y"], "way": ["b"]},
    )
    assert way["options"] == [["b", "another"]]
    assert text["options"] == [["x", "x"], ["y", "y"]]


def test_every_option_of_a_motion_stands_in_its_form():
    form = {one["name"]: one for one in choices()["forms"]["run"]}
    assert set(form) == set(RunOptions.model_fields)
    assert [name for name, one in form.items() if one["kind"] == "own"] == [
        *("up", "stood", "ends", "side"),
    ]


@pytest.mark.parametrize("kind", ["run", "resolve", "render", "overlay", "export", "scan"])
def test_a_form_has_words_for_people(kind: str):
    for one in choices()["forms"][kind]:
        assert "omocap" not in one["hint"]
        assert one["kind"] == "own" or "_" not in one["title"]
        assert all(words != "" for _, words in one.get("options", []))
