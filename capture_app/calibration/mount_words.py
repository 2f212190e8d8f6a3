"""How a mount was found, how sure it is and how well it fits: one set of sentences for all."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from ingest.uncertainty import ConfidenceRadii

FAR_MM = 20.0
"""95 % bound of the place beyond which hands may be clearly off the object, millimetres."""
FAR_DEG = 3.0
"""The same of the direction, degrees."""

METHODS = {
    "board": "a board and a second camera",
    "session": "scan and clamp in one recording",
    "scan": "a scan that shows the phone",
    "screen": "pictures of the phone's screen",
    "tracker": "motion capture",
    "drawing": "numbers of a drawing",
    "points": "points on phone and object",
    "floor": "standing on the floor",
    "combine": "several calibrations",
    "identity": "taken as the phone itself",
}


class FitSentence(NamedTuple):
    """A residual of a calibration as a sentence around its number."""

    words: str
    """With # where the number stands."""
    unit: str = ""
    """Behind the number; a number without a unit is a count."""
    good: float | None = None
    """Up to where it is a good one, in that unit; None where that cannot be said."""


FITS = {
    "rms_mm": FitSentence("What was measured fits to # on average", "mm", 5),
    "worst_mm": FitSentence("The point that fits worst is # off", "mm", 5),
    "rms_deg": FitSentence("Its directions fit to # on average", "°", 1),
    "world held still_mm": FitSentence("With the phone's drift left in it fits to #", "mm"),
    "world held still_deg": FitSentence("Its directions fit to # then", "°"),
    "drift taken out_m": FitSentence("The phone drifted by # in all, which is taken out", "m"),
    "drift per metre walked_mm": FitSentence("It drifted by # for each metre walked", "mm", 7),
    "phone's lengths too short by_%": FitSentence(
        "The phone took lengths for # shorter than they are", "%"
    ),
    "moments used_%": FitSentence("# of the recording were used", "%"),
    "corners_px": FitSentence("Corners of the board are found to # of the film", "pixels", 1),
    "board place_mm": FitSentence("The place of the board on the object fits to #", "mm", 5),
    "board_mm": FitSentence("Views of the board agree to #", "mm", 5),
    "board_deg": FitSentence("Their directions agree to #", "°", 1),
    "stills_mm": FitSentence("Pictures of the rest agree to #", "mm", 5),
    "stills_deg": FitSentence("Their directions agree to #", "°", 1),
    "scan_mm": FitSentence("The scan and the object's mesh fit to #", "mm", 5),
    "scan_seen_%": FitSentence("# of the scan lie on the mesh", "%"),
    "reprojection_px": FitSentence(
        "What was recognised is found again to # of a picture", "pixels", 2
    ),
    "views_mm": FitSentence("Pictures by the phone agree to #", "mm", 5),
    "views_deg": FitSentence("Their directions agree to #", "°", 1),
    "floor_tilt_deg": FitSentence("The object stands within # of upright where it rests", "°", 1),
    "floor_height_mm": FitSentence("It stands within # of the floor there", "mm", 10),
    "inliers": FitSentence("# points were found again"),
    "apart_sigma": FitSentence("The calibrations are # apart", "standard deviations", 3),
}
"""Sentences by the names that methods give residuals; what is not here tells only programs."""


def mount_words(
    method: str, bounds: ConfidenceRadii | None, residuals: Mapping[str, float]
) -> dict[str, Any]:
    """Return `found`, a line for lists; `sure`, sentences; and `warnings`, what may put hands off the object.

    Args:
        method: of the mount.
        bounds: within what it is true 95 times of 100; None where nobody can tell.
        residuals: what it left over, by name with unit, as `ingest.mount.Mount` has them.
    """
    way = METHODS.get(method, method)
    if method == "identity":
        return {"found": way, "sure": [], "warnings": []}
    fits = [fit_sentence(name, value) for name, value in residuals.items()]
    return {
        "found": f"by {way}, {_within(bounds)}",
        "sure": [*_sure(bounds), *filter(None, fits)],
        "warnings": _far(bounds),
    }


def fit_sentence(name: str, value: float) -> str:
    """Return a residual as a sentence; "" for what tells only programs."""
    if (known := FITS.get(name)) is None:
        return ""
    number = _few(value) if known.unit else f"{value:.0f}"
    good = (
        ""
        if known.good is None
        else f"; a good fit is under {_with_unit(f'{known.good:g}', known.unit)}"
    )
    return f"{known.words.replace('#', _with_unit(number, known.unit))}{good}."


def _sure(bounds: ConfidenceRadii | None) -> list[str]:
    if bounds is None:
        return ["How sure it is is not known."]
    return [
        f"The phone's place on the object is sure to ± {_few(bounds.mm)} mm; hands need ± {FAR_MM:.0f} mm.",
        f"Its direction is sure to ± {_few(bounds.deg)}°; hands need ± {FAR_DEG:.0f}°.",
        "Both are true 95 times of 100, if the numbers it was made from are right.",
    ]


def _within(bounds: ConfidenceRadii | None) -> str:
    return (
        "error unknown"
        if bounds is None
        else f"within {_few(bounds.mm)} mm and {_few(bounds.deg)}°"
    )


def _far(bounds: ConfidenceRadii | None) -> list[str]:
    if bounds is None or (bounds.mm <= FAR_MM and bounds.deg <= FAR_DEG):
        return []
    return [
        f"This mount is only known {_within(bounds)}: hands may be that far off the object. "
        "A board or more points make it surer."
    ]


def _with_unit(number: str, unit: str) -> str:
    return f"{number}{'' if unit == '°' else ' '}{unit}".rstrip()


def _few(value: float) -> str:
    """Return a number with decimals where they say something."""
    return f"{value:.{2 if value < 0.1 else 1 if value < 10 else 0}f}"
