"""Where the camera is in a phone's body: the frame of the body, and points on it that have names."""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from ingest.calibration.phone.models import MODELS, LensCentre
from ingest.session import R_CAMERA_DEVICE
from ingest.uncertainty import of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

LENS = "lens"
_DEPTH_SIGMA = 1.5e-3
"""Of the optical centre behind the glass: drawings give where the cone of view begins instead."""
_TILT_SIGMA = np.radians(0.5)
"""Of the camera in the body, about each axis; nobody publishes it, autofocus and assembly allow it."""
_RULER_SIGMA = 1.0
"""Millimetres, of a lens found with a ruler."""
_USUAL_DEPTH, _USUAL_THICKNESS = 7.0, 8.0
_MODEL_TOLERANCE = 2.5


@dataclass(frozen=True)
class Phone:
    """A phone's sizes, metres.

    The body's frame: origin in the middle of the front glass, x to the right and y to the top as
    you look at the screen, z out of the screen to you.
    """

    name: str
    body: tuple[float, float, float]
    """Width, height, thickness."""
    lens: tuple[float, float, float]
    """Optical centre of the main camera in the body's frame."""
    lens_sigma: float
    """Of its x and y; z is less certain."""
    screen: tuple[float, float] | None
    """Width and height of what lights up; None if unknown."""
    pixels: tuple[int, int] | None


def phone_named(name: str, ruler: tuple[float, float, float, float] | None = None) -> Phone:
    """The phone of a model, or of measurements.

    Args:
        name: such as "iPhone 15 Pro"; capitals, blanks and the word Apple do not matter.
        ruler: body width and height, the main lens' centre from the top edge and from the right
            edge as you look at the screen (the left one from behind), millimetres. Needed where the
            model's lens is not known; it may be any phone then.

    Raises:
        InputError: "phone-unknown", "phone-lens" (a known model without a known lens) or
            "phone-ruler".
    """
    known = {_plain(key): key for key in MODELS}
    key = known.get(_plain(name))
    if ruler is not None:
        return _measured(name, key, ruler)
    if key is None:
        raise InputError(
            "phone-unknown",
            f"The sizes of '{name}' are not known. Known are {', '.join(MODELS)}.",
            where="--phone",
            fix=_MEASURE,
        )
    model = MODELS[key]
    if model.lens is None:
        raise InputError(
            "phone-lens",
            f"Where the lens of an {key} is, is not known.",
            where="--phone",
            fix=_MEASURE,
        )
    return _phone(key, model.body, model.lens, model.screen, model.pixels)


_MEASURE = (
    "Measure four numbers with a ruler, in millimetres, and pass them as --ruler "
    '"WIDTH HEIGHT TOP SIDE": the body\'s width and height, and from the back the middle of the main '
    "(1x) lens from the top edge and from the left edge. The main lens is the one that darkens the "
    "1x picture when you cover it."
)


def _plain(name: str) -> str:
    words = re.sub(r"apple|generation|gen\b|[^a-z0-9 ]", "", name.lower()).split()
    return "".join(re.sub(r"^(\d)(nd|rd)$", r"\1", word) for word in words)


def _measured(name: str, key: str | None, ruler: tuple[float, float, float, float]) -> Phone:
    width, height, top, side = ruler
    plausible = 50 < width < 95 < height < 190 and 0 < top < height and 0 < side < width
    if not plausible:
        raise InputError(
            "phone-ruler",
            f"A phone of {width:g} x {height:g} mm with its lens {top:g} mm from the top and "
            f"{side:g} mm from the side cannot be.",
            where="--ruler",
            fix=_MEASURE,
        )
    lens = LensCentre(top, side, _USUAL_DEPTH, _RULER_SIGMA)
    if key is None:
        return _phone(name, (width, height, _USUAL_THICKNESS), lens, None, None)
    model = MODELS[key]
    if max(abs(width - model.body[0]), abs(height - model.body[1])) > _MODEL_TOLERANCE:
        raise InputError(
            "phone-ruler",
            f"An {key} measures {model.body[0]:g} x {model.body[1]:g} mm, not {width:g} x "
            f"{height:g} mm.",
            where="--ruler",
            fix="Take it out of its case to measure; or it is another model.",
        )
    return _phone(key, model.body, lens, model.screen, model.pixels)


def _phone(
    name: str,
    body: tuple[float, float, float],
    lens: LensCentre,
    screen: tuple[float, float] | None,
    pixels: tuple[int, int] | None,
) -> Phone:
    width, height, thickness = (size / 1e3 for size in body)
    return Phone(
        name=name,
        body=(width, height, thickness),
        lens=(
            width / 2 - lens.from_side / 1e3,
            height / 2 - lens.from_top / 1e3,
            -lens.depth / 1e3,
        ),
        lens_sigma=lens.sigma / 1e3,
        screen=(screen[0] / 1e3, screen[1] / 1e3) if screen else None,
        pixels=pixels,
    )


def phone_body(phone: Phone) -> tuple[Float64[np.ndarray, "4 4"], Float64[np.ndarray, "6 6"]]:
    """T_phone_body, which maps the body's frame into ARKit's camera frame, and its covariance."""
    T_body_phone = np.eye(4)
    T_body_phone[:3, :3] = R_CAMERA_DEVICE.T
    T_body_phone[:3, 3] = phone.lens
    sigmas = [_TILT_SIGMA] * 3 + [phone.lens_sigma] * 2 + [_DEPTH_SIGMA]
    return inverse(T_body_phone), of_inverse(T_body_phone, np.diag(np.square(sigmas)))


_WORDS = {
    "left": (0, -1),
    "right": (0, 1),
    "bottom": (1, -1),
    "top": (1, 1),
    "back": (2, -1),
    "front": (2, 1),
    "screen": (2, 1),
}
_FILLING = {"corner", "edge", "middle", "centre", "center", "of", "the", "side"}


def body_point(phone: Phone, name: str) -> Float64[np.ndarray, "3"]:
    """A point of the body by its name, in the body's frame, metres.

    "lens" is the main camera's optical centre. Any other name says front or back and, as you look
    at the screen, left or right and top or bottom: "top left back corner", "top middle front",
    "left middle back", "centre of the back". Corners are where the straight edges would meet if
    they were not rounded, so middles of edges are easier to touch.

    Raises:
        InputError: "phone-point".
    """
    words = re.findall(r"[a-z]+", name.lower())
    if words == [LENS]:
        return np.array(phone.lens)
    place = [0, 0, 0]
    for word in words:
        axis, side = _WORDS.get(word, (0, 0))
        if (word not in _WORDS and word not in _FILLING) or place[axis] * side < 0:
            raise _no_point(name)
        place[axis] = side or place[axis]
    if place[2] == 0:
        raise _no_point(name)
    width, height, thickness = phone.body
    depth = 0.0 if place[2] > 0 else -thickness
    return np.array([place[0] * width / 2, place[1] * height / 2, depth])


def _no_point(name: str) -> InputError:
    return InputError(
        "phone-point",
        f"'{name}' names no point of a phone.",
        fix='Write "lens", or front or back with left or right and top or bottom as you look at the '
        'screen: "top left back corner", "left middle front", "centre back".',
    )
