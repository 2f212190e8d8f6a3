"""Which phone is meant: by its model, or by four measurements of it."""

from capture_app.commands.calibrate.by_camera import Ruler
from ingest.calibration.phone_body import Phone, phone_named
from omomo_core.errors import InputError


def phone_of(name: str | None, ruler: Ruler | None) -> Phone | None:
    """The phone; None when neither is given.

    Raises:
        InputError: as `phone_named`.
    """
    if ruler is not None:
        return phone_named(name or "measured phone", ruler)
    return phone_named(name) if name else None


def need(phone: Phone | None) -> Phone:
    """The phone, where there must be one.

    Raises:
        InputError: "phone-needed".
    """
    if phone is None:
        raise InputError(
            "phone-needed",
            "The model of the phone is not given.",
            where="--phone",
            fix='Name it, such as --phone "iPhone 15", or measure it with a ruler (--ruler).',
        )
    return phone
