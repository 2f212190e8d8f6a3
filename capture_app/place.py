"""Where somebody stood, as a user writes it."""

import math
from typing import Literal

from omomo_core.errors import InputError

Place = tuple[float, float]
"""On the floor of a result's world, metres."""
Stood = Place | Literal["phone"]
"""There, or before the phone's screen."""


def read_place(text: str | None, where: str) -> Stood | None:
    """The two numbers of "0.8,-1.2", or the word phone; None where nothing is said.

    Raises:
        InputError: "place-invalid": it is written otherwise.
    """
    if text is None or text == "phone":
        return text
    try:
        x, y = (float(part) for part in text.split(","))
        if math.isfinite(x + y):
            return x, y
    except ValueError:
        pass
    raise InputError(
        "place-invalid",
        f"{text!r} is no place.",
        where=where,
        fix="Write two numbers with a comma between them, e.g. 0.8,-1.2, or the word phone.",
    )
