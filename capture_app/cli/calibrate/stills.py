"""The options that say when the clamped phone stands still."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from omomo_core.errors import InputError

if TYPE_CHECKING:
    from ingest.mount.still import Still
    from ingest.session import CaptureSession

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


def chosen_stills(
    session: "CaptureSession", spans: Sequence[str] | None, clamped_at: float, carried: float
) -> "tuple[list[Still], str]":
    """The stills that are named, or those found after the clamping, and a note about them.

    Args:
        session: the log.
        spans: as written after --still.
        clamped_at: seconds from the start of the log.
        carried: metres that the phone was carried before it was clamped, at least.

    Raises:
        InputError: "still-unreadable", and those of `ingest.mount.still`.
    """
    from ingest.mount.still import clamped_stills, named_stills

    if spans:
        return named_stills(session, [_span(text) for text in spans]), ""
    return clamped_stills(session, after=clamped_at, path=0.0 if clamped_at else carried)


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
