"""CameraOptions: what somebody says about a scan's cameras, and how long something in it is."""

from dataclasses import dataclass

from ingest.calibration.board.spec import Board
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
    board: Board | None = None
    """A ChArUco board that lies beside the object; goes before all other scales."""
    length: Length | None = None
    height: float | None = None
    """Of the object, metres."""
    metric: bool = False
    """A COLMAP model that is in metres already, and z up."""


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
    told = (options.board, options.length, options.height)
    if logged or options.metric or any(one is not None for one in told):
        return
    raise InputError(
        "scan-scale",
        "Nothing says how large the object is: pictures alone do not.",
        where=where,
        fix="Give the object's height in metres (--height 0.84), or lay a printed ChArUco board "
        "beside it and film again (--board A4), or film with an app that logs ARKit's poses.",
    )
