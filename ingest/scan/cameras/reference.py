"""by_reference: how long a metre is in a model, by a printed board or markers that its pictures show."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.detect import Detector, Grey
from ingest.calibration.board.reference import Reference, Tags
from ingest.calibration.board.spec import MIN_CORNERS, Checkerboard
from ingest.calibration.board.tags import TagDetector
from ingest.scan.cameras.measured import crossing
from ingest.scan.cameras.metric import Similarity
from ingest.scan.cameras.reference_missing import not_seen
from ingest.scan.types import Scale, View
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import procrustes

_OFF = 0.01
"""Part of its diagonal that the corners of a board or a marker may be off (root mean square)."""
_PRINTED = 0.001
"""Standard deviation of a print's size, as a part."""
_BLOOM = 0.2
"""Pixels (standard deviation) by which a black square looks smaller or larger than it is: light spreads."""
_LOOKED_AT = 8
"""Pictures that are searched for other markers where the right ones are not seen."""


@dataclass(frozen=True)
class _Sighting:
    """A board or a marker in one picture."""

    view: View
    pixels: Float64[np.ndarray, "corners 2"]
    """NaN for those that are not seen."""


_Sightings = Mapping[int, Sequence[_Sighting]]
"""By the number of the marker; 0 for a board."""


@dataclass(frozen=True)
class _Fit:
    """A board or a marker laid on its corners in the model."""

    number: int
    similarity: Similarity
    """From the model to metres in its frame, turned z up; sigma is that of its own scale."""
    rms: float
    """Metres."""
    span: float
    """Its diagonal, metres."""
    corners: int


def by_reference(
    views: Sequence[View], reference: Reference, on_progress: Callable[[float], None]
) -> tuple[Similarity, Scale]:
    """The similarity that takes the model to metres in the frame of a board or a marker, turned z up.

    Of several markers each tells the size, and the one that lies flattest in the model tells the frame.

    Raises:
        InputError: "scan-board-missing" when it is not seen well enough, "scan-board-moved" when it
            does not keep its shape.
    """
    seen = _sightings(views, reference, on_progress)
    where = str(views[0].file.parent)
    found = [_fitted(reference, number, sightings) for number, sightings in seen.items()]
    fits = [fit for fit in found if fit is not None]
    if not fits:
        counts = [len(sightings) for sightings in seen.values()]
        raise not_seen(_some_greys(views), reference, counts, len(views), where)
    good = [fit for fit in fits if fit.rms <= _OFF * fit.span]
    if not good:
        best = min(fits, key=lambda fit: fit.rms / fit.span)
        raise InputError(
            "scan-board-moved",
            f"The corners of {_name(reference, best.number)} are {1e3 * best.rms:.1f} mm off their "
            "places on it.",
            where=where,
            fix="It must lie still and flat while you film, and be there only once; check its sides "
            "with a ruler (--board).",
        )
    return _joined(reference, good, seen)


def _joined(
    reference: Reference, fits: Sequence[_Fit], seen: _Sightings
) -> tuple[Similarity, Scale]:
    """One similarity of several markers, or that of the board."""
    weights = np.array([fit.similarity.sigma**-2 for fit in fits])
    scales = np.array([fit.similarity.scale for fit in fits])
    scale = float(np.exp(weights @ np.log(scales) / weights.sum()))
    shared = _PRINTED
    if isinstance(reference, Tags):
        sides = [_side(sighting) for fit in fits for sighting in seen[fit.number]]
        shared = float(np.hypot(_PRINTED, _BLOOM / np.median(sides)))
    sigma = float(np.sqrt(1 / weights.sum() + shared**2))
    frame = max((fit.similarity for fit in fits), key=lambda one: one.R[2, 2])
    rms = 1e3 * float(np.sqrt(np.mean([fit.rms**2 for fit in fits])))
    if isinstance(reference, Tags):
        listed = ", ".join(str(fit.number) for fit in fits)
        what = f"the marker{'s' * (len(fits) > 1)} {listed} of {reference} ({rms:.1f} mm off)"
    else:
        what = f"the board {reference} ({fits[0].corners} corners, {rms:.1f} mm off)"
    found = replace(frame, scale=scale, t=frame.t * scale / frame.scale, sigma=sigma)
    return found, Scale(sigma, "board", what)


def _side(sighting: _Sighting) -> float:
    """Mean side of a marker, pixels."""
    sides = np.linalg.norm(sighting.pixels - np.roll(sighting.pixels, 1, axis=0), axis=1)
    return float(sides.mean())


def _sightings(
    views: Sequence[View], reference: Reference, on_progress: Callable[[float], None]
) -> _Sightings:
    """Where the pictures show the reference."""
    find = _finder(reference)
    seen = defaultdict[int, list[_Sighting]](list)
    for k, view in enumerate(views):
        grey = _grey(view)
        if grey is not None:
            for number, pixels in find(grey).items():
                seen[number].append(_Sighting(view, pixels))
        on_progress((k + 1) / len(views))
    if isinstance(reference, Checkerboard) and reference.turns > 1:
        return {number: _alike(sightings, reference) for number, sightings in seen.items()}
    return seen


def _grey(view: View) -> Grey | None:
    grey = cv2.imread(str(view.file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    return None if grey is None else np.asarray(grey, np.uint8)


def _some_greys(views: Sequence[View]) -> Iterator[Grey]:
    """A few of the pictures, one after the other."""
    for k in np.unique(np.linspace(0, len(views) - 1, _LOOKED_AT).astype(int)):
        if (grey := _grey(views[k])) is not None:
            yield grey


def _finder(reference: Reference) -> Callable[[Grey], Mapping[int, np.ndarray]]:
    """Finds the corners in one picture, by the number of the marker."""
    if isinstance(reference, Tags):
        return TagDetector(reference).find
    detector = Detector(reference)

    def find(grey: Grey) -> dict[int, np.ndarray]:
        found = detector.find(grey)
        pixels = np.full((len(reference.corners), 2), np.nan)
        pixels[found.numbers] = found.pixels
        return {0: pixels} if len(found.numbers) else {}

    return find


def _alike(sightings: Sequence[_Sighting], board: Checkerboard) -> list[_Sighting]:
    """The sightings of a board that looks the same when it is turned, all turned as the first one.

    The rotation of each in the model is known but for that turn, whatever the model's size is.
    """
    out: list[_Sighting] = []
    first: np.ndarray | None = None
    for sighting in sightings:
        x, y = _axes(sighting, board)
        first = x if first is None else first
        around = [x, y, -x, -y]
        steps = range(0, 4, 4 // board.turns)
        turn = max(steps, key=lambda k: float(around[k] @ first))
        grid = sighting.pixels.reshape(board.rows - 1, board.columns - 1, 2)
        out.append(replace(sighting, pixels=np.rot90(grid, turn).reshape(-1, 2)))
    return out


def _axes(
    sighting: _Sighting, board: Checkerboard
) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
    """The board's x and y in the model's world."""
    fx, fy, cx, cy = sighting.view.intrinsics
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    _, turn, _ = cv2.solvePnP(
        board.corners, sighting.pixels, K, np.zeros(5), flags=cv2.SOLVEPNP_IPPE
    )
    R = sighting.view.T_world_camera[:3, :3] @ np.asarray(cv2.Rodrigues(turn)[0], float)
    return R[:, 0], R[:, 1]


def _fitted(reference: Reference, number: int, sightings: Sequence[_Sighting]) -> _Fit | None:
    """The reference laid on its corners where their rays meet; None when too few are known."""
    places: dict[int, np.ndarray] = {}
    for corner in range(len(reference.corners)):
        rays = [(s.view, s.pixels[corner]) for s in sightings if np.isfinite(s.pixels[corner, 0])]
        if (place := crossing(rays)) is not None:
            places[corner] = place
    if len(places) < (4 if isinstance(reference, Tags) else MIN_CORNERS):
        return None
    corners, points = reference.corners[list(places)], np.array(list(places.values()))
    fit = procrustes(corners, points, np.ones(len(points)), scaled=True)
    squares = float((fit.residuals**2).sum())
    error = np.sqrt(squares / (3 * len(points) - 7))
    spread = np.sqrt(((corners - corners.mean(axis=0)) ** 2).sum())
    # z goes into the paper: half a turn about x makes it come out.
    out = np.diag([1.0, -1.0, -1.0])
    # The rays of a noiseless corner would make it surer than anything is.
    sigma = max(float(error / spread), 1e-6)
    return _Fit(
        number,
        Similarity(fit.scale, out @ fit.R, out @ fit.t, sigma),
        float(np.sqrt(squares / len(points))),
        float(np.linalg.norm(np.ptp(corners, axis=0))),
        len(points),
    )


def _name(reference: Reference, number: int) -> str:
    if isinstance(reference, Tags):
        return f"marker {number} of {reference.dictionary}"
    return f"the board {reference}"
