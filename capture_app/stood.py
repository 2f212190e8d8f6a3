"""Where the person stood when a take began, as a user says it."""

import math
from collections.abc import Iterator

import numpy as np

from omomo_core.errors import InputError
from omomo_core.geometry.surface import sample_surface
from omomo_core.geometry.transforms import apply
from omomo_core.motion import HumanMotion, ObjectMotion
from omomo_core.stage import Configuration

FARTHEST = 3.0
"""Metres from the object: who is farther away takes seconds to come."""
NEAREST = 0.05
"""Metres on the floor from what is lower than HEAD: nobody stands in it."""
HEAD = 1.2
ASTRAY = 0.5
"""Metres from the place beyond which a person is not where they stood."""


def check_stood(
    place: tuple[float, float], motion: ObjectMotion, configuration: Configuration
) -> None:
    """Check that somebody can have stood there.

    Args:
        place: on the floor of the result's world, metres.
        motion: the object's.
        configuration: of the model that is to use it.

    Raises:
        InputError: "stood-unused", "stood-invalid", "stood-far" or "stood-inside".
    """
    if configuration == "paper":
        raise _wrong("unused", "The published model finds its own place for the person.", "--stood")
    x, y = place
    where = f"--stood {x:g},{y:g}"
    if not (math.isfinite(x) and math.isfinite(y)):
        raise _wrong("invalid", "The place where the person stood is no number.", where)
    points = apply(motion.T_world_object[:1], sample_surface(motion.mesh).points)[0]
    off = np.linalg.norm(points[:, :2] - place, axis=1)
    if off.min() > FARTHEST:
        raise _wrong("far", f"This is {off.min():.1f} m from the object as the take begins.", where)
    if off[points[:, 2] < HEAD].min(initial=np.inf) < NEAREST:
        raise _wrong("inside", "The object is there as the take begins.", where)


def stood_note(place: tuple[float, float] | None, human: HumanMotion) -> Iterator[str]:
    """What to know where somebody does not begin where they were said to."""
    off = 0.0 if place is None else float(np.linalg.norm(human.root[0, :2] - place))
    if off > ASTRAY:
        yield (
            f"The person begins {off:.1f} m from where --stood says: from there they would not have "
            "been at the object in time."
        )


def _wrong(code: str, what: str, where: str) -> InputError:
    fix = "Give x,y in metres on the floor of the result's world, at most 3 m from the object."
    return InputError(
        f"stood-{code}", what, where=where, fix="Leave it out." if code == "unused" else fix
    )
