"""Which phone is meant, by the words of --phone and --ruler."""

from capture_app.calibration.calibrate import need, phone_of
from capture_app.commands.text_values import read_ruler
from ingest.calibration.phone_body import Phone


def maybe_phone(name: str | None, ruler: str | None) -> Phone | None:
    """Return the phone of --phone and --ruler; None when neither is given.

    Raises:
        InputError: "drawing-numbers", or as `phone_of`.
    """
    return phone_of(name, None if ruler is None else read_ruler(ruler, "--ruler"))


def needed_phone(name: str | None, ruler: str | None) -> Phone:
    """Return the phone as `maybe_phone` does, but there must be one.

    Raises:
        InputError: "phone-needed", or as `maybe_phone`.
    """
    return need(maybe_phone(name, ruler))
