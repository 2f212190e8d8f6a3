"""Pictures for a scan: sharp ones of a film, spread over the way of the camera, and stills."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int64
from PIL import Image, UnidentifiedImageError
from scipy.ndimage import median_filter

from ingest.formats.still_images import save_millimetres
from ingest.report.take_report import Check
from ingest.scan.scan_choices import PICTURES
from ingest.scan.scan_types import (
    Colours,
    Frame,
    Frames,
    Grey,
    Pictures,
    Progress,
    ScanSource,
    no_progress,
)
from ingest.scan.scan_work import StageCache, key_of, state_of
from ingest.session_images import is_whole, left_out, picture_size
from omomo_core.errors import InputError

WIDTH = 640
"""Pixels of the longer side at which pictures are judged."""
_NEIGHBOURS = 15
"""Pictures among which one is sharp or not."""
_BLURRED = 0.45
"""Part of its neighbours' usual sharpness below which a picture is blurred."""
_SOFT = 0.62
"""`blur` above which a picture is not sharp by any measure."""
_FAINT = 0.1
"""Part of the edges across one direction that there are along the other, at least, to judge it by."""
_FLOW = 160
"""Pixels of the longer side at which motion is measured."""


@dataclass(frozen=True)
class PictureMeasures:
    """Sharpness and content of the candidate pictures, from reduced copies."""

    candidates: tuple[int, ...]
    """Places of the pictures that could be decoded."""
    sharpness: Float64[np.ndarray, " candidates"]
    """Variance of the Laplacian, as a part of what is usual for their neighbours."""
    blur: Float64[np.ndarray, " candidates"]
    """0 is sharp, 1 is nothing but blur, whatever the neighbours are."""
    path: Float64[np.ndarray, " candidates"]
    """How far the picture has moved since the first one, in sizes of it."""

    @property
    def blurred(self) -> Bool[np.ndarray, " candidates"]:
        """Whether a picture is too blurred to be used."""
        return (self.sharpness < _BLURRED) | (self.blur > _SOFT)


def measure_pictures(
    pictures: Pictures, candidates: Sequence[int], on_progress: Callable[[float], None]
) -> PictureMeasures:
    """Sharpness, blur and motion of the candidates, each seen once at a reduced size.

    Args:
        pictures: where they are.
        candidates: places in it, rising.
        on_progress: how much is done, 0 to 1.
    """
    seen, laplacian, blurs, moves = list[int](), list[float](), list[float](), list[float]()
    before: Grey | None = None
    for index, grey in pictures.greys(candidates, WIDTH):
        seen.append(index)
        calm = np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.8), np.uint8)
        laplacian.append(float(cv2.Laplacian(calm, cv2.CV_32F).var()))
        blurs.append(blur(calm))
        size = round(grey.shape[1] * _FLOW / WIDTH), round(grey.shape[0] * _FLOW / WIDTH)
        small = np.asarray(cv2.resize(calm, size, interpolation=cv2.INTER_AREA), np.uint8)
        moves.append(0.0 if before is None else _motion(before, small))
        before = small
        on_progress(len(seen) / len(candidates))
    sharp = np.array(laplacian)
    usual = median_filter(sharp, min(_NEIGHBOURS, max(1, len(sharp)))) if len(sharp) else sharp
    return PictureMeasures(
        tuple(seen), sharp / np.maximum(usual, 1e-9), np.array(blurs), np.cumsum(moves)
    )


def blur(grey: Grey) -> float:
    """How little a picture loses when it is blurred more, 0 to 1 (Crete et al. 2007)."""
    picture = grey.astype(np.float32)
    found: list[tuple[float, float]] = []
    for axis, size in ((0, (1, 9)), (1, (9, 1))):
        edges = np.abs(np.diff(picture, axis=axis))
        smoothed = np.abs(np.diff(cv2.blur(picture, size), axis=axis))
        found.append((float(edges.sum()), float(np.maximum(edges - smoothed, 0).sum())))
    # A direction in which there is next to nothing to blur tells nothing.
    least = max(1e-9, _FAINT * max(edges for edges, _ in found))
    return max((1 - lost / edges for edges, lost in found if edges >= least), default=1.0)


def _motion(before: Grey, now: Grey) -> float:
    """Median distance that corners moved, in lengths of the longer side; 1 when none is found."""
    if before.shape != now.shape:
        return 1.0
    corners: Any = cv2.goodFeaturesToTrack(before, 80, 0.01, 4)  # None where there are none
    if corners is None or len(corners) < 8:
        return 1.0
    moved, status, _ = cv2.calcOpticalFlowPyrLK(before, now, corners, np.empty_like(corners))
    found = np.asarray(status).ravel() == 1
    if found.sum() < 8:
        return 1.0
    steps = np.linalg.norm((moved - corners).reshape(-1, 2)[found], axis=1)
    return float(np.median(steps)) / max(now.shape)


MAX_PIXELS = 110_000_000
"""Most pixels of one picture; phones make up to 108 million."""
HEIC = (".heic", ".heif")


@dataclass(frozen=True)
class Stills:
    """Pictures in files."""

    files: tuple[Path, ...]
    names: tuple[str, ...]
    turns: int | None = None
    """Quarter turns counter-clockwise that bring the stored pixels upright; None: as the file says."""

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, Grey]]:
        """Some of them, small; see `Pictures`."""
        for index, picture in self.colours(wanted):
            grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
            yield index, narrowed(grey, width)

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, Colours]]:
        """Some of them as they are; see `Pictures`."""
        for index in wanted:
            file = self.files[index]
            picture = load_picture(file, keep=self.turns is not None)
            if picture is None:
                continue
            if self.turns is None and is_mirrored(file):
                picture = picture[:, ::-1]
            yield index, np.ascontiguousarray(np.rot90(picture, self.turns or 0))


_ORIENTATION, _MIRRORED = 0x0112, (2, 4, 5, 7)
"""Number of the orientation in EXIF 2.3, and its values that show the stored pixels mirrored."""


def is_mirrored(file: Path) -> bool:
    """Whether a photo is to be shown mirrored, as front cameras have it.

    What the camera saw is the other way round, and a mesh of what a mirror shows would be mirrored too.
    """
    try:
        with Image.open(file) as photo:
            return photo.getexif().get(_ORIENTATION) in _MIRRORED
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError):
        return False


def load_picture(file: Path, *, keep: bool) -> Colours | None:
    """The pixels of a file, None where it is damaged or no picture.

    Args:
        file: JPEG, PNG, or HEIC where pillow-heif is installed.
        keep: as the pixels are stored, whatever the file says of its orientation.

    Raises:
        InputError: "picture-heic" or "picture-large".
    """
    if file.suffix.lower() in HEIC:
        return _load_heic(file)
    size = picture_size(file)
    if size is not None and size[0] * size[1] > MAX_PIXELS:
        raise InputError(
            "picture-large",
            f"{file.name} has {size[0]} x {size[1]} pixels.",
            where=str(file),
            fix=f"Make it smaller than {MAX_PIXELS // 10**6} megapixels; 12 are plenty.",
        )
    flags = cv2.IMREAD_COLOR | (cv2.IMREAD_IGNORE_ORIENTATION if keep else 0)
    picture = cv2.imread(str(file), flags)
    if picture is None or not is_whole(file):
        return None
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))


def _load_heic(file: Path) -> Colours | None:
    # Pillow reads HEIC by a plug-in that not everybody may install.
    try:
        from pillow_heif import read_heif  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(
            "picture-heic",
            f"{file.name} is in HEIC, which is not read here.",
            where=str(file),
            fix="Run pip install pillow-heif; or export the photos as JPEG (on the phone: Settings, "
            "Camera, Formats, Most Compatible).",
        ) from None
    try:
        return np.asarray(read_heif(file).to_pillow().convert("RGB"), np.uint8)
    except (ValueError, OSError):
        return None


def narrowed(picture: np.ndarray, width: int) -> np.ndarray:
    """The picture made smaller if its longer side is longer than `width` pixels."""
    height, wide = picture.shape[:2]
    longest = max(height, wide)
    if longest <= width:
        return np.ascontiguousarray(picture)
    size = max(1, round(wide * width / longest)), max(1, round(height * width / longest))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


STAGE = "frames"
FEWEST = 12
MAX_SIDE = 1600
"""Pixels of the longer side of what is kept; larger pictures are slower and tell no more."""
_LOOKED = 8
"""Candidates that are looked at for each picture that is picked."""
_FORWARD = 0.7
"""Metres that a turn of one radian counts as in the spread of the poses."""
_QUALITY = 97


def pick_frames(
    source: ScanSource,
    folder: Path,
    *,
    count: int = PICTURES,
    progress: Progress = no_progress,
) -> Frames:
    """Pick pictures and write them, upright, into the work folder as `images` and `depth`.

    With poses they are spread over places and directions, without over time and motion of the
    picture; of neighbours the sharper one is taken. A finished COLMAP model keeps all its pictures
    where they are.

    Args:
        source: what was filmed.
        folder: work folder of the scan.
        count: of pictures to pick.
        progress: called with the stages "look" and "frames".

    Raises:
        InputError: "scan-few" when there are too few pictures, "scan-blurred" when too few of them
            are sharp, "pictures-damaged" when many cannot be read.
    """
    # The same scan may be asked for from another folder later.
    work, given = StageCache(folder.resolve()), source.where.resolve()
    key = key_of(STAGE, str(work.folder), str(given), state_of(given), count, MAX_SIDE)
    if (record := work.record(STAGE, key)) is not None:
        return _restored(record)
    total = len(source.pictures.names)
    if total < FEWEST:
        raise InputError(
            "scan-few",
            f"There are {total} pictures; a scan needs {FEWEST} at the very least, 60 to be good.",
            where=str(source.where),
            fix="Walk around the object twice, once at its height and once from above, and film "
            "all the way.",
        )
    work.begin(STAGE)
    if source.model is not None:
        picked = Frames(tuple(_in_place(source)), total, 0)
    else:
        picked = _picked(source, work, count, progress)
    work.finish(STAGE, key, asdict(picked))
    return picked


def _picked(source: ScanSource, work: StageCache, count: int, progress: Progress) -> Frames:
    total = len(source.pictures.names)
    usable = np.arange(total)
    if source.T_world_camera is not None:
        usable = np.flatnonzero(np.isfinite(source.T_world_camera).all(axis=(1, 2)))
    step = np.linspace(0, len(usable) - 1, min(len(usable), _LOOKED * count))
    candidates = usable[np.unique(step.astype(int))] if len(usable) else usable
    measures = measure_pictures(
        source.pictures, candidates.tolist(), lambda done: progress("look", done)
    )
    damaged = [
        source.pictures.names[k] for k in sorted({*candidates.tolist()} - {*measures.candidates})
    ]
    lacking = left_out(damaged, len(candidates), source.where)
    sharp = np.flatnonzero(~measures.blurred)
    if len(sharp) < FEWEST:
        raise _too_blurred(source, len(sharp), len(measures.candidates))
    chosen = sharp[_spread(source, measures, sharp, count)]
    places = np.array(measures.candidates)[np.sort(chosen)]
    frames: list[Frame] = []
    for frame in _written(source, work.folder, places.tolist()):
        frames.append(frame)
        progress("frames", len(frames) / len(places))
    blurred = int(measures.blurred.sum())
    notes = _notes(len(measures.candidates), blurred, lacking)
    return Frames(tuple(frames), total, blurred, notes)


def _too_blurred(source: ScanSource, sharp: int, seen: int) -> InputError:
    return InputError(
        "scan-blurred",
        f"Of {seen} pictures looked at {seen - sharp} are blurred; {sharp} sharp ones are too few.",
        where=str(source.where),
        fix="Film again with more light, moving slowly (a walk around takes 30 seconds), and wipe "
        "the lens.",
    )


def _notes(seen: int, blurred: int, lacking: str) -> tuple[Check, ...]:
    fix = "Copy the pictures again."
    damaged = (Check("pictures", "warn", lacking, None, fix),) if lacking else ()
    if blurred < 0.3 * seen:
        return damaged
    message = f"{blurred} of {seen} pictures are blurred and were left out."
    fix = "Film slower, or with more light."
    return (*damaged, Check("sharpness", "warn", message, None, fix))


def _spread(
    source: ScanSource, measures: PictureMeasures, sharp: Int64[np.ndarray, " sharp"], count: int
) -> Int64[np.ndarray, " picked"]:
    """Places in `sharp` that are far from each other; of near ones the sharper."""
    if len(sharp) <= count:
        return np.arange(len(sharp))
    places = np.array(measures.candidates)[sharp]
    if source.T_world_camera is not None:
        T = source.T_world_camera[places]
        where = np.concatenate([T[:, :3, 3], _FORWARD * T[:, :3, 2]], axis=1)
    else:
        # Time counts too, so that a slow stretch is not left out altogether.
        steady = np.linspace(0.0, 1.0, len(sharp)) * max(float(measures.path[-1]), 1e-6)
        where = np.stack([measures.path[sharp], steady], axis=1)
    return farthest_points(where, measures.sharpness[sharp].clip(0.2, 1.5), count)


def farthest_points(
    where: Float64[np.ndarray, "points axes"], worth: Float64[np.ndarray, " points"], count: int
) -> Int64[np.ndarray, " picked"]:
    """Points picked one by one, each far from those before; a worth of 2 counts for twice as far."""
    picked = [int(worth.argmax())]
    gap = np.linalg.norm(where - where[picked[0]], axis=1)
    while len(picked) < min(count, len(where)):
        picked.append(int((gap * worth).argmax()))
        gap = np.minimum(gap, np.linalg.norm(where - where[picked[-1]], axis=1))
    return np.array(picked)


def _written(source: ScanSource, folder: Path, places: list[int]) -> Iterator[Frame]:
    images, maps = folder / "images", folder / "depth"
    for made in (images, maps):
        made.mkdir(parents=True, exist_ok=True)
        for old in made.iterdir():
            old.unlink()
    for place, picture in source.pictures.colours(places):
        small = narrowed(picture, MAX_SIDE)
        name = f"{place:05d}.jpg"
        bgr = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
        cv2.imwrite(str(images / name), bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        depth = None if source.depth is None else source.depth(place)
        file = None if depth is None else maps / f"{place:05d}.png"
        if depth is not None and file is not None:
            save_millimetres(depth, file)
        size = small.shape[1], small.shape[0]
        T = None if source.T_world_camera is None else source.T_world_camera[place]
        K = _intrinsics(source, place, size)
        guess = np.nan if source.focal_guess is None else source.focal_guess[place]
        stated = float(guess) if np.isfinite(guess) else None
        yield Frame(name, images / name, size, K, T, file, stated)


def _intrinsics(
    source: ScanSource, place: int, size: tuple[int, int]
) -> Float64[np.ndarray, "4"] | None:
    if source.intrinsics is None or source.image_size is None:
        return None
    fx, fy, cx, cy = source.intrinsics[place]
    scale = np.array(size) / source.image_size
    # Pixel centres stand at whole numbers, so half a pixel is added before scaling.
    centre = (np.array([cx, cy]) + 0.5) * scale - 0.5
    return np.array([fx * scale[0], fy * scale[1], *centre])


def _in_place(source: ScanSource) -> Iterator[Frame]:
    """The pictures of a finished model, as they are."""
    stills = source.pictures
    assert isinstance(stills, Stills)
    for name, file in zip(stills.names, stills.files, strict=True):
        if (size := picture_size(file)) is not None:
            yield Frame(name, file, size)


def _restored(record: dict[str, Any]) -> Frames:
    """The frames that `asdict` and JSON have taken apart."""

    def array(value: Any) -> Any:
        return None if value is None else np.array(value, np.float64)

    def path(value: Any) -> Path | None:
        return None if value is None else Path(value)

    frames = tuple(
        Frame(
            name=row["name"],
            file=Path(row["file"]),
            size=(row["size"][0], row["size"][1]),
            intrinsics=array(row["intrinsics"]),
            T_world_camera=array(row["T_world_camera"]),
            depth=path(row["depth"]),
            focal_guess=row["focal_guess"],
        )
        for row in record["frames"]
    )
    notes = tuple(Check(**note) for note in record["notes"])
    return Frames(frames, record["seen"], record["blurred"], notes)
