"""iPhones: their sizes, and where the camera is in the body.

Bodies, screens and lenses to a hundredth of a millimetre are from Apple's dimensional drawings
("Accessory Design Guidelines for Apple Devices"), as three open projects wrote them down:
ARHeadsetKit (SE to 13), HoloKit (XS to 15) and idcrook's OpenSCAD models (11 Pro to 17 Pro Max).
A lens that two of them agree on, or that follows from a neighbour's the same way, has the smaller
sigma. The others are Apple's published sizes, and pixels over pixels per inch. Where nobody wrote
the lens down, there is none: it is to be measured.
"""

import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.session import R_CAMERA_DEVICE
from ingest.uncertainty import of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse


class LensCentre(NamedTuple):
    """The centre of the main (wide) camera's lens, as a drawing gives it, millimetres."""

    from_top: float
    """From the body's top edge."""
    from_side: float
    """From the body's right edge as you look at the screen (the left one from behind)."""
    depth: float
    """Depth of the optical centre behind the front glass; drawings state where its cone of view begins."""
    sigma: float
    """Sigma of the first two; 0.3 where sources agree."""


class Model(NamedTuple):
    """One model's sizes, millimetres."""

    body: tuple[float, float, float]
    """Width, height (upright), thickness without the camera."""
    screen: tuple[float, float]
    """Width and height of what lights up, in the middle of the body."""
    pixels: tuple[int, int]
    lens: LensCentre | None


_SMALL, _LARGE = (64.58, 139.77), (71.13, 153.90)
_ISLAND, _ISLAND_LARGE = (65.08, 141.09), (71.21, 154.34)


def _at(per_inch: int, across: int, down: int) -> tuple[float, float]:
    return 25.4 * across / per_inch, 25.4 * down / per_inch


_W19, _H19 = 1170, 2532
MODELS: dict[str, Model] = {
    "iPhone SE (2nd generation)": Model(
        (67.27, 138.44, 7.31), (58.50, 104.05), (750, 1334), LensCentre(10.24, 10.44, 5.31, 0.5)
    ),
    "iPhone SE (3rd generation)": Model(
        (67.27, 138.44, 7.31), (58.50, 104.05), (750, 1334), LensCentre(10.24, 10.44, 5.31, 0.5)
    ),
    "iPhone XR": Model(
        (75.72, 150.91, 8.32), (64.58, 139.78), (828, 1792), LensCentre(12.28, 12.28, 6.85, 0.3)
    ),
    "iPhone XS": Model(
        (70.94, 143.57, 7.70),
        _at(458, 1125, 2436),
        (1125, 2436),
        LensCentre(11.82, 11.82, 5.86, 0.3),
    ),
    "iPhone XS Max": Model(
        (77.42, 157.53, 7.70),
        _at(458, 1242, 2688),
        (1242, 2688),
        LensCentre(11.82, 11.82, 5.86, 0.3),
    ),
    "iPhone 11": Model(
        (75.72, 150.91, 8.32), (64.58, 139.78), (828, 1792), LensCentre(12.48, 12.48, 6.60, 0.5)
    ),
    "iPhone 11 Pro": Model(
        (71.36, 143.99, 8.10), (62.33, 134.95), (1125, 2436), LensCentre(12.04, 12.04, 5.91, 0.3)
    ),
    "iPhone 11 Pro Max": Model(
        (77.84, 157.95, 8.10), (68.81, 148.91), (1242, 2688), LensCentre(12.04, 12.04, 5.91, 0.3)
    ),
    "iPhone 12 mini": Model(
        (64.21, 131.50, 7.39), (57.67, 124.96), (1080, 2340), LensCentre(24.95, 10.67, 5.01, 0.3)
    ),
    "iPhone 12": Model(
        (71.52, 146.71, 7.39), _SMALL, (_W19, _H19), LensCentre(27.01, 12.73, 5.01, 0.3)
    ),
    "iPhone 12 Pro": Model(
        (71.52, 146.71, 7.39), _SMALL, (_W19, _H19), LensCentre(12.16, 12.16, 5.51, 0.3)
    ),
    "iPhone 12 Pro Max": Model(
        (78.07, 160.84, 7.39), _LARGE, (1284, 2778), LensCentre(30.90, 13.43, 5.91, 0.3)
    ),
    "iPhone 13 mini": Model(
        (64.21, 131.50, 7.65), (57.67, 124.96), (1080, 2340), LensCentre(23.21, 23.21, 6.33, 0.3)
    ),
    "iPhone 13": Model(
        (71.52, 146.71, 7.65), _SMALL, (_W19, _H19), LensCentre(24.24, 24.24, 6.33, 0.3)
    ),
    "iPhone 13 Pro": Model(
        (71.52, 146.71, 7.65), _SMALL, (_W19, _H19), LensCentre(31.35, 13.43, 7.27, 0.3)
    ),
    "iPhone 13 Pro Max": Model(
        (78.07, 160.84, 7.65), _LARGE, (1284, 2778), LensCentre(31.35, 13.43, 7.27, 0.3)
    ),
    # The 14's upper lens is where the 13's is; the main one is taken to be, too.
    "iPhone 14": Model(
        (71.52, 146.71, 7.80), _SMALL, (_W19, _H19), LensCentre(24.24, 24.24, 6.33, 1.0)
    ),
    "iPhone 14 Plus": Model(
        (78.07, 160.84, 7.80), _LARGE, (1284, 2778), LensCentre(24.91, 24.91, 6.33, 1.0)
    ),
    "iPhone 14 Pro": Model(
        (71.45, 147.46, 7.85), _ISLAND, (1179, 2556), LensCentre(33.52, 14.28, 7.84, 0.3)
    ),
    "iPhone 14 Pro Max": Model(
        (77.58, 160.71, 7.85), _ISLAND_LARGE, (1290, 2796), LensCentre(33.52, 14.28, 7.80, 0.3)
    ),
    "iPhone 15": Model(
        (71.63, 147.64, 7.80), _ISLAND, (1179, 2556), LensCentre(25.64, 25.64, 6.9, 0.3)
    ),
    "iPhone 15 Plus": Model(
        (77.76, 160.89, 7.80), _ISLAND_LARGE, (1290, 2796), LensCentre(25.64, 25.64, 6.9, 0.3)
    ),
    # The Pro's side is the Pro Max's: the same camera, at the same place from the top.
    "iPhone 15 Pro": Model(
        (70.60, 146.61, 8.25), _ISLAND, (1179, 2556), LensCentre(33.41, 14.17, 7.59, 0.5)
    ),
    "iPhone 15 Pro Max": Model(
        (76.73, 159.86, 8.25), _ISLAND_LARGE, (1290, 2796), LensCentre(33.41, 14.17, 7.73, 0.3)
    ),
    "iPhone 16e": Model((71.5, 146.7, 7.80), _at(460, _W19, _H19), (_W19, _H19), None),
    "iPhone 16": Model((71.6, 147.6, 7.80), _at(460, 1179, 2556), (1179, 2556), None),
    "iPhone 16 Plus": Model((77.8, 160.9, 7.80), _at(460, 1290, 2796), (1290, 2796), None),
    "iPhone 16 Pro": Model((71.5, 149.6, 8.25), _at(460, 1206, 2622), (1206, 2622), None),
    "iPhone 16 Pro Max": Model((77.6, 163.0, 8.25), _at(460, 1320, 2868), (1320, 2868), None),
    "iPhone 17": Model((71.5, 149.6, 7.95), _at(460, 1206, 2622), (1206, 2622), None),
    "iPhone Air": Model((74.7, 156.2, 5.64), _at(460, 1260, 2736), (1260, 2736), None),
    "iPhone 17 Pro": Model((71.85, 150.01, 8.75), _at(460, 1206, 2622), (1206, 2622), None),
    "iPhone 17 Pro Max": Model((77.98, 163.43, 8.75), (72.86, 158.31), (1320, 2868), None),
}


LENS = "lens"
_DEPTH_SIGMA = 1.5e-3
"""Sigma of the optical centre's depth: drawings give where the cone of view begins instead."""
_TILT_SIGMA = np.radians(0.5)
"""Sigma of the camera's tilt about each axis; nobody publishes it, autofocus and assembly allow it."""
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
    """Sigma of its x and y, metres; z is less certain."""
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
            field="phone",
            fix=_MEASURE,
        )
    model = MODELS[key]
    if model.lens is None:
        raise InputError(
            "phone-lens",
            f"Where the lens of an {key} is, is not known.",
            field="phone",
            fix=_MEASURE,
        )
    return _phone(key, model.body, model.lens, model.screen, model.pixels)


_MEASURE = (
    "Measure four numbers with a ruler, in millimetres, and pass them as ‹ruler› "
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
            field="ruler",
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
            field="ruler",
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
