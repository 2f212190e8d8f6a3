"""find_features: SIFT features of the picked pictures, in COLMAP's database, some at a time."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ingest.colmap import pycolmap
from ingest.scan.cameras.quiet import THREADS, quiet
from ingest.scan.types import Frame, Progress
from omomo_core.errors import InputError

MOST, DRAFT_MOST = 4096, 1500
"""Features of a picture; the doubled picture that COLMAP begins with finds more, not better ones."""
_LARGE = 1200
"""Pixels of the longer side from which a draft leaves out the finest scale: it looks at half the size."""
FEWEST = 60
"""Features that a picture has at least, on average, where anything is to be seen."""
_BATCH = 8
_FOCAL = 0.8
"""Lengths of the longer side: the main camera of most phones, where nothing says."""


def find_features(
    database: Path,
    images: Path,
    frames: Sequence[Frame],
    progress: Progress,
    *,
    draft: bool = False,
) -> dict[str, int]:
    """Find the features of each picture; those that the database has already are not found again.

    Pictures whose intrinsics are known get a pinhole each; others share one camera with a simple
    lens for each size and focal length stated.

    Args:
        database: COLMAP's.
        images: folder of the pictures.
        frames: the pictures.
        progress: called with the stage "features".
        draft: find fewer, and in large pictures none of the finest.

    Returns:
        COLMAP's number of each picture by its name.

    Raises:
        InputError: "scan-textureless" when there is next to nothing to be found.
    """
    quiet()
    groups = defaultdict[tuple[object, ...], list[Frame]](list)
    for frame in frames:
        known = frame.intrinsics is not None
        groups[("own",) if known else (frame.size, frame.focal_guess)].append(frame)
    there = _present(database)
    done = len(there)
    for group in groups.values():
        wanted = [frame for frame in group if frame.name not in there]
        for start in range(0, len(wanted), _BATCH):
            batch = wanted[start : start + _BATCH]
            _extract(database, images, group, batch, draft)
            done += len(batch)
            progress("features", min(done / len(frames), 1.0))
    with pycolmap.Database.open(database) as opened:
        found = {image.name: image for image in opened.read_all_images()}
        for frame in frames:
            if frame.intrinsics is not None and frame.name in found:
                opened.update_camera(_pinhole(frame, found[frame.name].camera_id))
        counts = [opened.num_keypoints_for_image(image.image_id) for image in found.values()]
    if not counts or np.median(counts) < FEWEST:
        raise InputError(
            "scan-textureless",
            f"The pictures show next to nothing that can be found again: {np.median(counts or [0]):.0f} "
            "features each.",
            where=str(images),
            fix="Film with more light, and put things with detail (newspapers, a patterned blanket) "
            "under and around the object.",
        )
    return {name: image.image_id for name, image in found.items()}


def _present(database: Path) -> set[str]:
    """The pictures whose features are known."""
    if not database.is_file():
        return set()
    with pycolmap.Database.open(database) as opened:
        images = opened.read_all_images()
        return {image.name for image in images if opened.exists_descriptors(image.image_id)}


def _extract(
    database: Path, images: Path, group: Sequence[Frame], batch: Sequence[Frame], draft: bool
) -> None:
    """Features of a batch of the pictures of one camera, or of one camera each."""
    options = pycolmap.FeatureExtractionOptions()
    options.num_threads = THREADS
    options.sift.max_num_features = DRAFT_MOST if draft else MOST
    options.sift.first_octave = int(draft and max(group[0].size) >= _LARGE)
    reader = pycolmap.ImageReaderOptions()
    mode = pycolmap.CameraMode.PER_IMAGE
    first = group[0]
    if first.intrinsics is not None:
        reader.camera_model = "PINHOLE"
        reader.camera_params = _pinhole(first, 1).params_to_string()
    else:
        mode = pycolmap.CameraMode.SINGLE
        reader.camera_model = "SIMPLE_RADIAL"
        reader.default_focal_length_factor = _FOCAL
        if first.focal_guess is not None:
            width, height = first.size
            focal = first.focal_guess * max(first.size)
            reader.camera_params = f"{focal},{width / 2},{height / 2},0"
        if (shared := _camera_of(database, group)) is not None:
            reader.existing_camera_id = shared
    pycolmap.extract_features(
        database,
        images,
        image_names=[frame.name for frame in batch],
        camera_mode=mode,
        reader_options=reader,
        extraction_options=options,
        device=pycolmap.Device.cpu,
    )


def _camera_of(database: Path, group: Sequence[Frame]) -> int | None:
    """The camera of those pictures of a group that are in the database."""
    if not database.is_file():
        return None
    names = {frame.name for frame in group}
    with pycolmap.Database.open(database) as opened:
        cameras = [i.camera_id for i in opened.read_all_images() if i.name in names]
    return cameras[0] if cameras else None


def _pinhole(frame: Frame, number: int) -> pycolmap.Camera:
    assert frame.intrinsics is not None
    fx, fy, cx, cy = frame.intrinsics.tolist()
    width, height = frame.size
    # COLMAP counts pixels from the corner of the first one.
    camera = pycolmap.Camera(
        model="PINHOLE",
        width=width,
        height=height,
        params=[fx, fy, cx + 0.5, cy + 0.5],
        camera_id=number,
    )
    camera.has_prior_focal_length = True
    return camera
