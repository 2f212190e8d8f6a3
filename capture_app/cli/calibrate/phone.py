"""Which phone is meant, by its model or by four measurements."""

from ingest.mount.drawing.directions import numbers
from ingest.mount.phone.body import Phone, phone_named


def maybe_phone(name: str | None, ruler: str | None) -> Phone | None:
    """The phone of --phone and --ruler; None when neither is given.

    Raises:
        InputError: as `phone_named`, or "drawing-numbers" for a ruler that is not four numbers.
    """
    if ruler is None:
        return phone_named(name) if name else None
    width, height, top, side = numbers(ruler, 4, "--ruler").tolist()
    return phone_named(name or "measured phone", (width, height, top, side))


def needed_phone(name: str | None, ruler: str | None) -> Phone:
    """As `maybe_phone`, but there must be one.

    Raises:
        InputError: "phone-needed", or as `maybe_phone`.
    """
    from omomo_core.errors import InputError

    phone = maybe_phone(name, ruler)
    if phone is None:
        raise InputError(
            "phone-needed",
            "The model of the phone is not given.",
            where="--phone",
            fix='Pass --phone "iPhone 15", or measure it for --ruler.',
        )
    return phone
