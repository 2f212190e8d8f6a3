"""Assign to each contact with the floor the side on which the object stands, given a rough mount."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from ingest.calibration.floor.contacts import Contact
from ingest.calibration.floor.sides import Side
from ingest.mount import Mount
from omomo_core.errors import InputError

_TILT = np.radians(8.0)
"""Lean from the nearest side of a thing that stands on it, under a mount that is about right."""
_MOST_TILT = np.radians(20.0)
"""However unsure the mount is: the next side is not much farther."""
_TIGHT = float(np.sqrt(chi2.ppf(0.999, 3)))
_ALIKE = np.radians(3.7)
"""Gravity in the phone's axes when the object stands on one side again, turned round: ARKit keeps it
to a degree, floors are as uneven."""
_SAME_LEVEL = 0.03
"""Metres; one side's contacts within this of its lowest are on one floor, others on a table."""


class StandingContact(NamedTuple):
    """A contact with the floor, and the side on which the object stands in it."""

    contact: Contact
    side: Side
    on_floor: bool
    """False when it is higher than another one of the same side: its tilt counts, its height not."""


def standings(
    contacts: Sequence[Contact], sides: Sequence[Side], mount: Mount, where: str
) -> list[StandingContact]:
    """Give each contact the side that its tilt under the mount is nearest to.

    Args:
        contacts: of one take, in order.
        sides: of the object.
        mount: with a covariance: the surer it is of its tilt, the less a side may differ.
        where: the session, for errors.

    Raises:
        InputError: "floor-no-contact", "floor-no-side", "floor-rests-disagree".
    """
    if not contacts:
        raise _nothing(where)
    if not sides:
        raise InputError(
            "floor-no-side",
            "The object has no flat side or feet to stand on, so the floor tells nothing of its "
            "tilt.",
            where=where,
            fix="Refine the mount in another way.",
        )
    R_object_phone = mount.T_phone_object[:3, :3].T
    downs = np.stack([side.down for side in sides])
    cosines = np.stack([downs @ R_object_phone @ contact.down for contact in contacts])
    nearest, lean = cosines.argmax(axis=1), np.arccos(cosines.max(axis=1).clip(-1, 1))
    limit = _limit(mount)
    if lean.min() > limit:
        raise _leaning(contacts[int(lean.argmin())], float(lean.min()), limit, where)
    found: list[StandingContact] = []
    for k, side in enumerate(sides):
        own = [
            c for c, n, off in zip(contacts, nearest, lean, strict=True) if n == k and off < limit
        ]
        found += _levelled(_alike(own, where), side)
    if not found:
        raise _nothing(where)
    return sorted(found, key=lambda standing: standing.contact.start)


def _levelled(contacts: list[Contact], side: Side) -> list[StandingContact]:
    """Rests, and pushes at the level of the lowest of them: what is level elsewhere may be carried."""
    rests = [contact.height for contact in contacts if contact.kind == "rest"]
    if not rests:
        return []
    found = [StandingContact(c, side, abs(c.height - min(rests)) < _SAME_LEVEL) for c in contacts]
    return [standing for standing in found if standing.on_floor or standing.contact.kind == "rest"]


def _nothing(where: str) -> InputError:
    return InputError(
        "floor-no-contact",
        "The object never stands still on the floor for half a second with nobody touching it.",
        where=where,
        fix="Record two seconds with the object at rest on the floor, before and after you move it.",
    )


def _limit(mount: Mount) -> float:
    """The lean that a wrong mount may give a thing that stands."""
    assert mount.covariance is not None
    unsure = float(np.sqrt(np.linalg.eigvalsh(mount.covariance[:3, :3])[-1]))
    return min(max(_TILT, _TIGHT * unsure), _MOST_TILT)


def _leaning(contact: Contact, lean: float, limit: float, where: str) -> InputError:
    return InputError(
        "floor-no-side",
        f"No side of the object is under it where it stands: it leans by {np.degrees(lean):.0f} deg "
        f"from the nearest one at {contact.when}, and the mount allows {np.degrees(limit):.0f}.",
        where=where,
        fix="Rest the object upright on its own feet. If it did, the mount is wrong, or the mesh has "
        "no such side (castors, a curved base): then the floor cannot refine it.",
    )


def _alike(contacts: list[Contact], where: str) -> list[Contact]:
    """The contacts of one side without the few in which gravity is another than in most.

    The mount has no part in this: a phone that is clamped to a thing that stands on one side feels
    the same gravity each time.
    """
    if not contacts:
        return []
    downs = np.stack([contact.down for contact in contacts])
    alike = np.arccos((downs @ downs.T).clip(-1, 1)) < _ALIKE
    kept = alike[int(alike.sum(axis=1).argmax())]
    if 3 * kept.sum() >= 2 * len(kept):
        return [contact for contact, keep in zip(contacts, kept, strict=True) if keep]
    most = float(np.degrees(np.arccos((downs @ downs.T).clip(-1, 1).min())))
    raise InputError(
        "floor-rests-disagree",
        f"The object stands {most:.1f} deg differently from one time to the next "
        f"({', '.join(contact.when for contact in contacts[:4])}): the mount slipped, or the object "
        "leaned against something.",
        where=where,
        fix="Look at the clamp, and record rests on a level floor with nothing near the object.",
    )
