"""pick_frames: which pictures the scan is made of: sharp, and from all around."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64, Int64

from ingest.formats.depth_png import save_millimetres
from ingest.formats.pictures import picture_size
from ingest.report.check import Check
from ingest.scan.choices import PICTURES
from ingest.scan.sharpness import Looks, look
from ingest.scan.sources.stills import Stills, narrowed
from ingest.scan.types import Frame, Frames, Progress, ScanSource, no_progress
from ingest.scan.work import StageCache, key_of, state_of
from omomo_core.errors import InputError

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
            are sharp.
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
    looks = look(source.pictures, candidates.tolist(), lambda done: progress("look", done))
    sharp = np.flatnonzero(~looks.blurred)
    if len(sharp) < FEWEST:
        raise _too_blurred(source, len(sharp), len(looks.candidates))
    chosen = sharp[_spread(source, looks, sharp, count)]
    places = np.array(looks.candidates)[np.sort(chosen)]
    frames: list[Frame] = []
    for frame in _written(source, work.folder, places.tolist()):
        frames.append(frame)
        progress("frames", len(frames) / len(places))
    blurred = int(looks.blurred.sum())
    return Frames(tuple(frames), total, blurred, _notes(len(looks.candidates), blurred))


def _too_blurred(source: ScanSource, sharp: int, seen: int) -> InputError:
    return InputError(
        "scan-blurred",
        f"Of {seen} pictures looked at {seen - sharp} are blurred; {sharp} sharp ones are too few.",
        where=str(source.where),
        fix="Film again with more light, moving slowly (a walk around takes 30 seconds), and wipe "
        "the lens.",
    )


def _notes(seen: int, blurred: int) -> tuple[Check, ...]:
    if blurred < 0.3 * seen:
        return ()
    message = f"{blurred} of {seen} pictures are blurred and were left out."
    return (Check("sharpness", "warn", message, None, "Film slower, or with more light."),)


def _spread(
    source: ScanSource, looks: Looks, sharp: Int64[np.ndarray, " sharp"], count: int
) -> Int64[np.ndarray, " picked"]:
    """Places in `sharp` that are far from each other; of near ones the sharper."""
    if len(sharp) <= count:
        return np.arange(len(sharp))
    places = np.array(looks.candidates)[sharp]
    if source.T_world_camera is not None:
        T = source.T_world_camera[places]
        where = np.concatenate([T[:, :3, 3], _FORWARD * T[:, :3, 2]], axis=1)
    else:
        # Time counts too, so that a slow stretch is not left out altogether.
        steady = np.linspace(0.0, 1.0, len(sharp)) * max(float(looks.path[-1]), 1e-6)
        where = np.stack([looks.path[sharp], steady], axis=1)
    return farthest(where, looks.sharpness[sharp].clip(0.2, 1.5), count)


def farthest(
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
