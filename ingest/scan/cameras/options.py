"""CameraOptions: what somebody says about a scan's cameras, and how long something in it is."""

from dataclasses import dataclass

from ingest.calibration.board.reference import Reference
from ingest.scan.cameras.agreement import AS_LOGGED
from omomo_core.errors import InputError


@dataclass(frozen=True)
class Sight:
    """A point that somebody has picked in a picture."""

    picture: str
    """Name of the picture, with or without its ending."""
    x: float
    y: float
    """Pixels of the picture as it was picked; (0, 0) is the centre of the first."""


@dataclass(frozen=True)
class Length:
    """The distance of two points, each picked in two pictures or more."""

    metres: float
    a: tuple[Sight, ...]
    b: tuple[Sight, ...]


@dataclass(frozen=True)
class CameraOptions:
    """How to find the cameras, and what gives the scale."""

    poses: bool = True
    """Use the poses that the phone logged."""
    axes: str = AS_LOGGED
    """How they are to be read, see `ingest.scan.cameras.agreement.readings`."""
    board: Reference | None = None
    """A board or markers beside the object; they go before all other scales."""
    length: Length | None = None
    height: float | None = None
    """Of the object, metres."""
    metric: bool = False
    """A COLMAP model that is in metres already, and z up."""
    draft: bool = False
    """Find fewer features. It has no effect without logged poses, which then come from the features alone."""


def check_scale(options: CameraOptions, logged: bool, where: str) -> None:
    """Refuse a scan whose scale nothing would tell, before the long work begins.

    Args:
        options: what somebody says.
        logged: whether there are poses that a phone has logged.
        where: the source, for messages.

    Raises:
        InputError: "scan-scale" or "scan-length".
    """
    for metres in (options.height, options.length and options.length.metres):
        if metres is not None and not 0.01 <= metres <= 10:
            raise InputError(
                "scan-length",
                f"{metres:g} m cannot be right for a length on an object.",
                where=where,
                fix="Give it in metres, e.g. 0.84.",
            )
    scale_sources = (options.board, options.length, options.height)
    if logged or options.metric or any(one is not None for one in scale_sources):
        return
    raise InputError(
        "scan-scale",
        "Nothing says how large the object is: pictures alone do not.",
        where=where,
        fix="Give the object's height in metres (--height 0.84), or lay a printed board or marker "
        "beside it and film again (--board A4), or film with an app that logs ARKit's poses.",
    )


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
        picture, x, y = sight.strip().rsplit(",", 2)
        sights.append(Sight(picture.strip(), float(x), float(y)))
    return tuple(sights)
