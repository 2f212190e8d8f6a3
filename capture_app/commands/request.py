"""Request: what all commands have in common, and what pydantic found wrong, in the words of our errors."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from capture_app.commands.text_values import read_size
from omomo_core.errors import InputError


def first_problem(errors: Sequence[Any]) -> tuple[str, str]:
    """The first wrong field by its dotted path, and what is wrong with it.

    Args:
        errors: as a ValidationError of pydantic lists them.
    """
    first = errors[0]
    # Before what our own validators say, pydantic puts the kind of the exception.
    return ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")


class Request(BaseModel):
    """A file or folder to be made, and from what; it can be stored, sent and compared."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    KIND: ClassVar[str]
    """Kind of the job that does it; see `capture_app.jobs.job_kinds`."""
    READS: ClassVar[tuple[str, ...]] = ()
    """Fields that are paths of inputs."""

    name: str = ""
    """What its owner calls the job."""
    output: Path
    """The file or folder to make."""

    @property
    def inputs(self) -> dict[str, Path]:
        """The inputs that are given, by role."""
        given: dict[str, Path | None] = {role: getattr(self, role) for role in self.READS}
        return {role: path for role, path in given.items() if path is not None}

    @property
    def options(self) -> dict[str, Any]:
        """What else is asked for, as JSON has it."""
        return self.model_dump(mode="json", exclude={"name", "output", *self.READS})


class ItemRequest(Request):
    """Something for the library of the page; as a job, its output is the folder of the item."""

    facts: Annotated[dict[str, Any], Field(default_factory=dict)]
    """What the library notes of it beside what is found out."""


Asked = TypeVar("Asked", bound=BaseModel)


def validated(model: type[Asked], said: Mapping[str, Any], code: str, **context: str) -> Asked:
    """Return the request, or a part of one, that was typed on a command line or in a table.

    Args:
        model: of the request or the part.
        said: values by the names of its fields; text is parsed.
        code: of the error where a value is out of bounds.
        context: `where` is the place in errors; else they name the field.

    Raises:
        InputError: with that code, or that of the parser of a field.
    """
    try:
        return model.model_validate(said, context=context)
    except ValidationError as error:
        field, problem = first_problem(error.errors())
        raise InputError(
            code,
            f"{field}: {problem}.",
            where=context.get("where", ""),
            field=field.split(".")[0],
            fix="Correct it in the table or on the command line.",
        ) from error


def place_of(info: Any) -> str:
    """Return where the user typed a field, for the error about it.

    Args:
        info: the ValidationInfo that pydantic gives to a validator.
    """
    context: dict[str, str] = info.context or {}
    return context.get("where") or f"‹{info.field_name}›"


def _size(value: object, info: Any) -> object:
    return read_size(value, place_of(info)) if isinstance(value, str) else value


VideoSize = Annotated[
    tuple[Annotated[int, Field(ge=16, le=7680)], Annotated[int, Field(ge=16, le=4320)]],
    BeforeValidator(_size),
]
"""Width and height in pixels; text is written as 960x540."""
