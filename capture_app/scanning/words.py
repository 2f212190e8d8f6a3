"""picked_length: a length between two points that were picked in pictures, as it is typed."""

from ingest.scan.cameras.options import Length, Sight
from omomo_core.errors import InputError

_TWO = 2


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
