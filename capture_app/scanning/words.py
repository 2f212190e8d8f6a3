"""What is typed for a scan, understood: a box, and a length between two picked points."""

import numpy as np

from ingest.scan.cameras.options import Length, Sight
from ingest.scan.region.region import GivenBox
from omomo_core.errors import InputError

_SIX, _TWO = 6, 2


def given_box(text: str | None) -> GivenBox | None:
    """The box of "x0,y0,z0,x1,y1,z1": lowest and highest corner, metres.

    Raises:
        InputError: "scan-box".
    """
    if text is None:
        return None
    try:
        values = np.array([float(part) for part in text.split(",")])
        if len(values) != _SIX:
            raise ValueError("not six numbers")
    except ValueError:
        raise InputError(
            "scan-box",
            f"{text!r} is no box.",
            where="--box",
            fix="Write its lowest and its highest corner in metres, z up, such as "
            "-0.3,-0.2,0,0.4,0.5,1.1; report.json of the scan says the box that was used.",
        ) from None
    return GivenBox(np.minimum(values[:3], values[3:]), np.maximum(values[:3], values[3:]))


def picked_length(text: str | None) -> Length | None:
    """The length of "0.84:00012,310,420;00031,205,411:00012,330,80;00031,214,66".

    Metres, then two points, each as the pixels where two pictures or more show it.

    Raises:
        InputError: "scan-length".
    """
    if text is None:
        return None
    try:
        metres, a, b = text.split(":")
        return Length(float(metres), _point(a), _point(b))
    except ValueError:
        raise InputError(
            "scan-length",
            f"{text!r} is no length between two points.",
            where="--length",
            fix="Write metres, then two points as picture,x,y in two pictures or more, such as "
            "0.84:00012,310,420;00031,205,411:00012,330,80;00031,214,66. The pictures are in the "
            "folder images beside the mesh.",
        ) from None


def _point(text: str) -> tuple[Sight, ...]:
    sights: list[Sight] = []
    for sight in text.split(";"):
        picture, x, y = sight.strip().rsplit(",", _TWO)
        sights.append(Sight(picture.strip(), float(x), float(y)))
    return tuple(sights)
