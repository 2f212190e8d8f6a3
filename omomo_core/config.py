"""Settings: the numbers that shape a motion, as fields of frozen dataclasses with unit and meaning.

Each room keeps its numbers in a file `config.py`: one dataclass per idea, one instance of each, which the
room's modules read, and one dataclass that holds them all.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TypeVar

_T = TypeVar("_T")
Number = int | float | tuple[float, ...] | tuple[tuple[float, ...], ...]
"""The value of a setting."""


def setting(value: _T, unit: str, meaning: str) -> _T:
    """Return a dataclass field with a default value, its unit, and a sentence that says what it is.

    Args:
        value: a number, or a tuple of numbers.
        unit: such as "m", "frames", "1/m^2"; "share", "count" or "cost" where there is no physical one.
        meaning: what the number decides, and where it comes from.
    """
    return field(default=value, metadata={"unit": unit, "meaning": meaning})


@dataclass(frozen=True)
class Setting:
    """A number of a configuration."""

    name: str
    """Path of fields from the configuration to the number, separated by dots."""
    value: Number
    unit: str
    meaning: str


def settings_of(config: object, prefix: str = "") -> Iterator[Setting]:
    """Yield every number of a configuration and of the configurations in it, in their order.

    Args:
        config: an instance of a dataclass whose fields are settings or such dataclasses.
        prefix: put before each name.
    """
    assert is_dataclass(config)
    for one in fields(config):
        value, name = getattr(config, one.name), prefix + one.name
        if is_dataclass(value):
            yield from settings_of(value, f"{name}.")
        else:
            yield Setting(name, value, one.metadata["unit"], one.metadata["meaning"])
