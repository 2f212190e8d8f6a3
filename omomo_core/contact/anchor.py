"""Anchors: the place on the object where a hand stays while it holds."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from omomo_core.contact.config import ANCHOR
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.geometry.surface import Surface
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion


def anchor_spans(
    spans: Iterable[ContactSpan],
    predicted: HandMotion,
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
) -> tuple[ContactSegment, ...]:
    """Return each span as a segment whose anchor is the surface point nearest to the predicted palm.

    Args:
        spans: those that are segments already keep their anchors; the others overlap the frames.
        predicted: palms, world, metres.
        surface: the object's surface in its own frame.
        T_world_object: the object's pose per frame.
    """
    palms = to_local(T_world_object, predicted.palms)

    def fix(span: ContactSpan) -> ContactSegment:
        if isinstance(span, ContactSegment):
            return span
        median = np.median(palms[max(span.start, 0) : span.stop, span.hand], axis=0)
        return ContactSegment(
            span.hand, span.start, span.stop, _project_to_surface(median, surface)
        )

    return tuple(fix(span) for span in spans)


def _project_to_surface(palm: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """Return the palm joint at its thickness above the nearest point of the surface, object frame, metres."""
    _, nearest = surface.tree.query(palm)
    point, normal = surface.points[nearest], surface.normals[nearest]
    # Scans wind some faces the wrong way round. A palm with nothing of the object beyond it is
    # outside, whatever the normal says; amid the object's parts the normal is all there is.
    above = (surface.points - palm) @ -normal
    if (point - palm) @ normal > 0 and above.max() < 0:
        normal = -normal
    return point + ANCHOR.palm_thickness * normal
