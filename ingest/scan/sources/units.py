"""In which unit a mesh is, guessed from its size where its file does not say."""

import numpy as np
from jaxtyping import Float64

from ingest.mesh import MAX_EXTENT, MIN_EXTENT
from ingest.report.check import Check
from ingest.scan.choices import Unit
from omomo_core.errors import InputError

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
NAMES: dict[Unit, str] = {
    "m": "metres", "cm": "centimetres", "mm": "millimetres", "in": "inches", "ft": "feet"
}  # fmt: skip
_PLAUSIBLE = (0.1, 2.5)
"""Metres of the largest side of what people carry, drag or sweep with."""
_USUAL = 0.8
"""Metres; of two plausible units, that which makes the largest side more like this is taken."""


def guess_unit(extents: Float64[np.ndarray, "3"], where: str) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of a mesh that states none, and what to tell about it.

    Args:
        extents: sides of its bounding box in its own unit.
        where: its file, for messages.

    Raises:
        InputError: "mesh-units" when no unit makes it a thing that a person moves.
    """
    largest = float(extents.max())
    if MIN_EXTENT <= largest <= MAX_EXTENT:
        return 1.0, ()
    sides = " x ".join(f"{side:.4g}" for side in extents)
    likely: list[Unit] = [
        unit
        for unit in ("cm", "mm", "in")
        if _PLAUSIBLE[0] <= largest * METRES[unit] <= _PLAUSIBLE[1]
    ]
    likely.sort(key=lambda unit: abs(np.log(largest * METRES[unit] / _USUAL)))
    if not likely:
        raise InputError(
            "mesh-units",
            f"The mesh measures {sides}; in no unit is that a thing that a person moves.",
            where=where,
            fix="Say its unit (--units), or the true height of the object (--height).",
        )
    best, others = likely[0], likely[1:]
    told = "; ".join(f"in {NAMES[u]} it would be {largest * METRES[u]:.2f} m" for u in others)
    message = (
        f"The mesh measures {sides} and does not say in what; taken for {NAMES[best]}, so that its "
        f"largest side is {largest * METRES[best]:.2f} m"
    )
    message += f" ({told})." if told else "."
    fix = "Measure the object; if that is wrong, say its unit (--units) or its height (--height)."
    return METRES[best], (Check("units", "warn", message, None, fix),)
