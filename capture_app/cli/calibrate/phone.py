"""Which phone is meant, by the words of --phone and --ruler."""

from capture_app.calibration.phones import need, phone_of
from capture_app.calibration.ways.requests import Ruler
from ingest.calibration.drawing.directions import numbers
from ingest.calibration.phone.body import Phone


def ruler_of(text: str | None) -> Ruler | None:
    """The four measurements of --ruler.

    Raises:
        InputError: "drawing-numbers".
    """
    if text is None:
        return None
    width, height, top, side = numbers(text, 4, "--ruler").tolist()
    return width, height, top, side


def maybe_phone(name: str | None, ruler: str | None) -> Phone | None:
    """The phone of --phone and --ruler; None when neither is given.

    Raises:
        InputError: as `phone_of` and `ruler_of`.
    """
    return phone_of(name, ruler_of(ruler))


def needed_phone(name: str | None, ruler: str | None) -> Phone:
    """As `maybe_phone`, but there must be one.

    Raises:
        InputError: "phone-needed", or as `maybe_phone`.
    """
    return need(maybe_phone(name, ruler))
