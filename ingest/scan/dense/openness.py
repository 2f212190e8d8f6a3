"""open_places: which places that no picture shows are air that something hides, and not solid.

Under a seat or behind a back, air is out of sight just as the inside of a box is. From inside a box
every way sideways meets a surface that was seen; from under a seat most ways lead into the open.
"""

from itertools import product

import numpy as np
from jaxtyping import Bool, Float32

_CELL = 0.012
"""Metres, about: sides of the cells that ways are followed through."""
_SIDEWAYS, _ANYWHERE = 0.6, 0.5
"""Parts of the level directions, or of all, whose ways lead into the open."""

Cells = Bool[np.ndarray, "z y x"]


def open_places(unseen: Cells, blocked: Cells, voxel: float) -> Cells:
    """Unseen places from which most ways lead to places that are seen to be empty.

    Args:
        unseen: no picture says what is there.
        blocked: a surface or something solid is there; what is neither is empty.
        voxel: metres between places.
    """
    factor = max(1, round(_CELL / voxel))
    closed = _shrunk(blocked, factor)
    hidden = _shrunk(unseen, factor) & ~closed
    level, every = np.zeros(hidden.shape, np.float32), np.zeros(hidden.shape, np.float32)
    ways = [(z, y, x) for z, y, x in product((-1, 0, 1), repeat=3) if z or y or x]
    flat = [way for way in ways if way[0] == 0]
    for way in ways:
        free = _escapes(hidden, closed, way)
        every += free
        if way in flat:
            level += free
    found = hidden & ((level >= _SIDEWAYS * len(flat)) | (every >= _ANYWHERE * len(ways)))
    return _grown(found, unseen.shape, factor) & unseen


def _escapes(
    hidden: Cells, closed: Cells, way: tuple[int, int, int]
) -> Float32[np.ndarray, "z y x"]:
    """Whether a straight way leads out of what is hidden without meeting what is closed; not downwards
    through the floor."""
    free = np.pad(~hidden & ~closed, 1, constant_values=True)
    free[0] = False  # The floor.
    passable = np.pad(hidden, 1)
    axis = next(k for k in range(3) if way[k])
    order = range(1, free.shape[axis] - 1)
    swept, through = np.moveaxis(free, axis, 0), np.moveaxis(passable, axis, 0)
    others = [way[k] for k in range(3) if k != axis]
    for index in order if way[axis] < 0 else reversed(order):
        ahead = np.roll(swept[index + way[axis]], [-step for step in others], (0, 1))
        swept[index] |= through[index] & ahead
    return free[1:-1, 1:-1, 1:-1].astype(np.float32)


def _shrunk(places: Cells, factor: int) -> Bool[np.ndarray, "cz cy cx"]:
    """Cells of which any place is marked."""
    if factor == 1:
        return places.copy()
    padded = np.pad(places, [(0, -side % factor) for side in places.shape])
    z, y, x = (side // factor for side in padded.shape)
    return np.asarray(padded.reshape(z, factor, y, factor, x, factor).any(axis=(1, 3, 5)))


def _grown(cells: Bool[np.ndarray, "cz cy cx"], shape: tuple[int, ...], factor: int) -> Cells:
    grown = cells
    for axis in range(3):
        grown = np.repeat(grown, factor, axis=axis)
    return grown[: shape[0], : shape[1], : shape[2]]
