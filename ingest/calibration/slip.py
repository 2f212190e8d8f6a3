"""slip_between: whether a mount moved between two calibrations of it."""

from dataclasses import dataclass

from ingest.calibration.difference import difference
from ingest.mount import Mount
from omomo_core.errors import InputError


@dataclass(frozen=True)
class Slip:
    """How far the object moved in the phone's frame."""

    mm: float
    """Of the object's origin."""
    deg: float
    p: float
    """Chance that errors of the two calibrations alone look like that."""


def slip_between(first: Mount, second: Mount) -> Slip | None:
    """The slip between an earlier and a later result of one mount; None when they agree.

    What either leaves open cannot show a slip. In 1 of 1,000 mounts that held, errors look like one.

    Args:
        first: of the start of a take, with a covariance.
        second: of its end, with a covariance.

    Raises:
        InputError: "mount-without-covariance".
    """
    covariances = first.covariance, second.covariance
    if covariances[0] is None or covariances[1] is None:
        raise InputError(
            "mount-without-covariance",
            "A mount does not say how sure it is, so that a slip cannot be told from its error.",
            where=(first if first.covariance is None else second).method,
            fix="Calibrate it by a method that measures.",
        )
    apart = difference(first, second, (covariances[0], covariances[1]))
    return Slip(apart.mm, apart.deg, apart.p) if apart.disagrees else None


def refuse_slip(first: Mount, second: Mount) -> None:
    """Refuse two results of one take, of its start and its end, that a slip lies between.

    Raises:
        InputError: "mount-slipped", and those of `slip_between`.
    """
    slip = slip_between(first, second)
    if slip is None:
        return
    raise InputError(
        "mount-slipped",
        f"The mount slipped during the take: by {slip.mm:.0f} mm and {slip.deg:.1f} deg between its "
        f"start and its end (chance of that without a slip: {slip.p:.1g}).",
        fix="Fix the clamp and record again; or cut the take where it slipped, and use each "
        "calibration for its own part.",
    )
