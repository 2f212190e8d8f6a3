"""ReadingOptions: what the user knows better than a phone's log."""

from dataclasses import fields
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat

from capture_app.commands.inputs import LogFormat, OptionGroup, shown
from capture_app.commands.request import place_of
from capture_app.commands.text_values import read_up
from ingest.trajectory.trajectory_config import Reading, Top


def _up(value: object, info: Any) -> object:
    return read_up(value, place_of(info)) if isinstance(value, str) else value


Up = Annotated[tuple[FiniteFloat, FiniteFloat, FiniteFloat] | Top, BeforeValidator(_up)]


class ReadingOptions(BaseModel):
    """How a log is read; None leaves it to what the log shows."""

    model_config = ConfigDict(extra="forbid")

    floor: Annotated[
        FiniteFloat | None,
        shown("m"),
        OptionGroup.READING,
        Field(
            title="Height of the floor",
            description="Height of the floor in the phone's world, metres (0 is where recording began, "
            "so it is negative). Found where the object rests if not given. In an animation, the "
            "height in its file; the object's lowest point if not given.",
        ),
    ] = None
    up: Annotated[
        Up | None,
        OptionGroup.READING,
        Field(
            title="Which way is up",
            description="Which way is up, where the log does not say: a direction in the phone's world, "
            "e.g. 0,1,0; or the axis of the mesh that points up where the object rests, e.g. object:z "
            "or object:-y. What the log says, if not given.",
        ),
    ] = None
    stitch: Annotated[
        bool,
        OptionGroup.READING,
        Field(
            title="Put tracking jumps back together",
            description="Move what follows a tracking jump back to where it belongs, instead of "
            "splitting the take there.",
        ),
    ] = False
    closure: Annotated[
        bool,
        OptionGroup.READING,
        Field(
            title="The object ends on the mark where it began",
            description="The object ends on the mark where it began: the drift in between is removed.",
        ),
    ] = False
    segment: Annotated[
        int | None,
        OptionGroup.READING,
        Field(
            title="Stretch to use",
            ge=1,
            lt=2**31,
            description="Which stretch of a take that tracking failures split, from 1; the longest if "
            "not given.",
        ),
    ] = None
    format: Annotated[LogFormat, OptionGroup.READING] = None

    @property
    def reading(self) -> Reading:
        """What the user knows better than the log."""
        return Reading(**{field.name: getattr(self, field.name) for field in fields(Reading)})
