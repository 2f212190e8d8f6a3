"""The options that say when the clamped phone stands still."""

from collections.abc import Sequence
from typing import Annotated

import typer

from omomo_core.errors import InputError

Spans = Annotated[
    list[str] | None,
    typer.Option(
        "--still",
        help="Seconds from the start of the log in which the clamped phone stands still and the "
        "object where it was scanned, e.g. 12.5:14; may be given several times. Found if not given.",
        show_default=False,
    ),
]
ClampedAt = Annotated[
    float,
    typer.Option(
        help="Seconds from the start of the log after which the phone is clamped.", min=0.0
    ),
]


def spans_of(texts: Sequence[str] | None) -> tuple[tuple[float, float], ...]:
    """Stretches of time as written after --still.

    Raises:
        InputError: "still-unreadable".
    """
    return tuple(_span(text) for text in texts or ())


def _span(text: str) -> tuple[float, float]:
    try:
        start, stop = (float(part) for part in text.split(":"))
        if not 0 <= start < stop:
            raise ValueError("the first comes before the second")
    except ValueError:
        raise InputError(
            "still-unreadable",
            f"{text!r} is no stretch of time.",
            where="--still",
            fix="Write two numbers of seconds with a colon, e.g. 12.5:14.",
        ) from None
    return start, stop
