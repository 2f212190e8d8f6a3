"""Sizes of iPhones in millimetres: body, screen, and where the main camera's lens is.

Bodies, screens and lenses to a hundredth of a millimetre are from Apple's dimensional drawings
("Accessory Design Guidelines for Apple Devices"), as three open projects wrote them down:
ARHeadsetKit (SE to 13), HoloKit (XS to 15) and idcrook's OpenSCAD models (11 Pro to 17 Pro Max).
A lens that two of them agree on, or that follows from a neighbour's the same way, has the smaller
sigma. The others are Apple's published sizes, and pixels over pixels per inch. Where nobody wrote
the lens down, there is none: it is to be measured.
"""

from typing import NamedTuple


class LensCentre(NamedTuple):
    """The centre of the main (wide) camera's lens, as a drawing gives it, millimetres."""

    from_top: float
    """From the body's top edge."""
    from_side: float
    """From the body's right edge as you look at the screen (the left one from behind)."""
    depth: float
    """Of the optical centre behind the front glass; drawings state where its cone of view begins."""
    sigma: float
    """Of the first two; 0.3 where sources agree."""


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
