"""Metre and vertical of photos by a printed reference in them."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.board_detect import Detector, Grey, other_families
from ingest.calibration.board.board_place import Reference, TagDetector, Tags
from ingest.calibration.board.board_spec import MIN_CORNERS, Checkerboard
from ingest.colmap import pycolmap
from ingest.formats.still_images import load_millimetres
from ingest.report.take_report import Check
from ingest.scan.cameras.features import CameraOptions
from ingest.scan.cameras.metric_scale import (
    Similarity,
    by_length,
    crossing,
    looked_at,
    to_phone,
    upright,
)
from ingest.scan.cameras.reconstruction import laid, names_of, points_of, poses_of, views_of
from ingest.scan.scan_types import Frame, Progress, Scale, View
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import procrustes

_OTHERS = 3
"""Sightings of a marker of another family that are no accident."""


def not_seen(
    pictures: Iterable[Grey], reference: Reference, counts: Sequence[int], views: int, where: str
) -> InputError:
    """The error that says what the pictures show instead of a board or marker.

    Args:
        pictures: a few of them; each takes a second or so.
        reference: what was looked for.
        counts: how many pictures show some of it, for each marker.
        views: how many pictures there are.
        where: their folder, for the message.
    """
    most = max(counts, default=0)
    if isinstance(reference, Tags) and not most:
        what, fix = _instead(_seen(pictures, reference), reference)
    elif isinstance(reference, Tags):
        what = (
            f"No marker of {reference} is seen from two sides: {most} of {views} pictures show one."
        )
        fix = "Leave it in view for half of the walk, and walk around it; or give a length (‹height›)."
    else:
        what = (
            f"The board {reference} gives no scale: {most} of {views} pictures show some of it, and "
            f"fewer than {MIN_CORNERS} of its {len(reference.corners)} corners are seen from two sides."
        )
        fix = (
            "Lay the printed board flat beside the object, in view for half of the walk; check "
            "that it is this board (‹board›), or give a length instead (‹height›)."
        )
    return InputError("scan-board-missing", what, where=where, fix=fix)


def _seen(pictures: Iterable[Grey], tags: Tags) -> Mapping[str, Mapping[int, int]]:
    """How often each marker of each family is there."""
    families = [tags.dictionary, *other_families(tags.dictionary)]
    finders = {name: TagDetector(Tags(name, tags.side)) for name in families}
    times = {name: defaultdict[int, int](int) for name in families}
    for grey in pictures:
        for name, finder in finders.items():
            for number in finder.find(grey):
                times[name][number] += 1
    return times


def _instead(times: Mapping[str, Mapping[int, int]], tags: Tags) -> tuple[str, str]:
    """What is there in the place of a marker, and what to do."""
    own = [str(number) for number in sorted(times[tags.dictionary])]
    if own:
        return (
            f"No picture shows marker {tags.number} of {tags.dictionary}, but there {_are(own)}.",
            "Give the number of the marker whose side was measured, or none if all are as large "
            f"(‹board› {tags.dictionary}:{1e3 * tags.side:g}mm:{own[0]}).",
        )
    name, others = max(times.items(), key=lambda one: max(one[1].values(), default=0))
    if max(others.values(), default=0) >= _OTHERS:
        return (
            f"No picture shows a marker of {tags.dictionary}, but there {_are(sorted(others))} of {name}.",
            f"Name that family: ‹board› {name}:{1e3 * tags.side:g}mm.",
        )
    return (
        f"No picture shows a marker of {tags}.",
        "Lay it flat beside the object with white paper around it, in view for half of the walk, so "
        "large that each of its cells measures three pixels or more; or give a length (‹height›).",
    )


def _are(numbers: Sequence[object]) -> str:
    listed = ", ".join(str(number) for number in numbers)
    return f"is marker {listed}" if len(numbers) == 1 else f"are markers {listed}"


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
"""Sightings by the number of the marker; 0 for a board."""


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
            "with a ruler (‹board›).",
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
    """Return the sightings of the reference in the pictures."""
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


Up = Literal["arkit", "board", "floor", "cameras", "given"]
_LEVEL = np.cos(np.radians(15.0))
"""Between a board's normal and up, where it lies on the floor."""
_USUAL = 1.5
"""Metres from which people film; for a scan whose size is told at its end."""
_DIFFERENT = 0.02
"""Part by which two scales differ that do not agree."""
_WRONG = 1.25
"""Factor between two scales of which one must be a mistake."""
_FEWEST = 100
"""Points with a depth."""
_APART = 0.015
"""Part by which a phone's depth and poses differ about the metre when one of them is wrong."""
_DEPTH_SIGMA = 0.01
"""Standard deviation of the length of LiDAR's metre, as a part."""


@dataclass(frozen=True)
class ModelPlacement:
    """What gave a reconstruction its scale and its upright."""

    scale: Scale
    up: Up
    notes: tuple[Check, ...] = ()


def place(
    model: pycolmap.Reconstruction,
    frames: Mapping[str, Frame],
    options: CameraOptions,
    *,
    logged: bool,
    gravity: bool,
    straightened: Path,
    progress: Progress,
) -> ModelPlacement:
    """Lay a reconstruction into the world, in place.

    A board goes before a picked length, that before the phone's poses, and those before a height,
    which is only applied once the object has been cut out.

    Args:
        model: the reconstruction, of any size.
        frames: the pictures by their name.
        options: what somebody says.
        logged: whether the frames have poses that are to be used.
        gravity: whether z is up in them.
        straightened: folder for pictures whose lens is undone, to look for a board.
        progress: called with the stage "board".

    Raises:
        InputError: of `by_reference` and `by_length`; "scan-board-size" when a board contradicts the
            phone's poses by far.
    """
    if options.metric:
        return ModelPlacement(Scale(0.005, "given", "the model's own, as somebody says"), "given")
    names = names_of(model)
    placed = _by_phone(model, names, frames) if logged else None
    up: Up = "arkit"
    if placed is None or not gravity:
        turned = upright(poses_of(model, names), points_of(model))
        laid(model, turned.similarity)
        up = turned.by
    if options.board is not None or options.length is not None:
        return _measured(model, names, frames, options, placed, up, straightened, progress)
    if placed is not None:
        return _in_metres_of_depth(model, frames, placed, up)
    T = poses_of(model, names)
    distance = np.median(np.linalg.norm(T[:, :3, 3] - looked_at(T), axis=1))
    # Depth maps join in what follows only if the metre is theirs meanwhile.
    metres = _depth_scale(model, frames) or _USUAL / float(distance)
    laid(model, Similarity(metres, np.eye(3), np.zeros(3)))
    return ModelPlacement(Scale(0.5, "height", f"the object's height of {options.height} m"), up)


def _by_phone(
    model: pycolmap.Reconstruction, names: list[str], frames: Mapping[str, Frame]
) -> Scale:
    known = [n for n in names if frames[n].T_world_camera is not None]
    T = np.array([frames[n].T_world_camera for n in known])
    similarity = to_phone(T, poses_of(model, known))
    laid(model, similarity)
    return Scale(similarity.sigma, "arkit", f"the phone's poses ({len(known)} pictures)")


def _in_metres_of_depth(
    model: pycolmap.Reconstruction, frames: Mapping[str, Frame], by_poses: Scale, up: Up
) -> ModelPlacement:
    """The phone's metre; that of its depth where its poses clearly differ, as a short film's may.

    LiDAR measures each length by itself; the metre of poses is integrated from accelerations.
    """
    factor = _depth_scale(model, frames)
    if factor is None or abs(factor - 1) < _APART:
        return ModelPlacement(by_poses, up)
    laid(model, Similarity(factor, np.eye(3), np.zeros(3)))
    message = (
        f"The metre of the phone's depth is {factor:.3f} times as long as that of its poses; the "
        "first is taken, as the app does for its own mesh."
    )
    fix = "Measure the object's height, and give it or lay a board beside it if it matters."
    note = Check("metre", "warn", message, None, fix)
    return ModelPlacement(Scale(_DEPTH_SIGMA, "depth", "the phone's depth"), up, (note,))


def _measured(
    model: pycolmap.Reconstruction,
    names: list[str],
    frames: Mapping[str, Frame],
    options: CameraOptions,
    before: Scale | None,
    up: Up,
    straightened: Path,
    progress: Progress,
) -> ModelPlacement:
    """The size by a board or a length; place and up stay where a phone or the floor says them."""
    views = views_of(model, names, frames, straightened)
    if options.board is not None:
        board, scale = by_reference(views, options.board, lambda done: progress("board", done))
        factor = board.scale
        # What lies on the floor says better than a guess where up is.
        if up != "arkit" and board.R[2] @ [0.0, 0.0, 1.0] > _LEVEL:
            laid(model, Similarity(1.0, board.R, board.t / board.scale))
            up = "board"
    else:
        assert options.length is not None
        factor, scale = by_length(views, options.length)
    _check_factor(factor, before, scale)
    laid(model, Similarity(factor, np.eye(3), np.zeros(3)))
    return ModelPlacement(scale, up, _compared(factor, before, scale))


def _check_factor(factor: float, before: Scale | None, scale: Scale) -> None:
    """Refuse a size that differs from that of the phone's poses as a wrong unit or print would.

    Raises:
        InputError: "scan-board-size".
    """
    if before is None or max(factor, 1 / factor) < _WRONG:
        return
    raise InputError(
        "scan-board-size",
        f"By {scale.description} the object would be {factor:.2f} times as large as by "
        f"{before.description}; a phone's poses are never so far off.",
        field="board" if scale.by == "board" else "length",
        fix="Measure once more, of a marker the side of its black square; or leave the phone's poses "
        "out (‹no poses›).",
    )


def _compared(factor: float, before: Scale | None, scale: Scale) -> tuple[Check, ...]:
    if before is None or abs(factor - 1) < _DIFFERENT:
        return ()
    message = (
        f"By {scale.description} the object is {factor:.3f} times as large as by "
        f"{before.description}; the first is taken."
    )
    fix = "Measure the object, and check the board's squares with a ruler."
    return (Check("scale", "warn", message, None, fix),)


def _depth_scale(model: pycolmap.Reconstruction, frames: Mapping[str, Frame]) -> float | None:
    """Metres in one unit of a reconstruction: sparse points against depth maps, median.

    Args:
        model: the reconstruction, of any size.
        frames: its pictures by their name.

    Returns:
        None where too few points have a depth.
    """
    ratios = [
        _ratios(model, image, frames[image.name])
        for image in model.images.values()
        if image.has_pose and image.name in frames
    ]
    found = np.concatenate([np.empty(0), *ratios])
    return float(np.median(found)) if len(found) >= _FEWEST else None


def _ratios(
    model: pycolmap.Reconstruction, image: pycolmap.Image, frame: Frame
) -> Float64[np.ndarray, " points"]:
    seen = [point for point in image.points2D if point.has_point3D()]
    if frame.depth is None or not seen:
        return np.empty(0)
    depth = load_millimetres(frame.depth)
    camera = model.cameras[image.camera_id]
    scale = np.array(depth.shape[::-1]) / [camera.width, camera.height]
    # COLMAP counts pixels from the corner of the first one.
    u, v = (np.array([point.xy for point in seen]) * scale).astype(int).T
    measured = depth[v.clip(0, depth.shape[0] - 1), u.clip(0, depth.shape[1] - 1)]
    T = image.cam_from_world().matrix()
    places = np.array([model.points3D[point.point3D_id].xyz for point in seen])
    z = places @ T[2, :3] + T[2, 3]
    known = (measured > 0) & (z > 0)
    return measured[known] / z[known]
