"""Features of pictures, pairs to compare, and COLMAP's options."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64

from ingest.calibration.board.board_place import Reference
from ingest.calibration.scan_landmarks import match, unit
from ingest.colmap import pycolmap
from ingest.scan.cameras.pose_agreement import AS_LOGGED
from ingest.scan.scan_types import Frame, Progress
from omomo_core.errors import InputError

THREADS = 2
"""More gain little: reading pictures and the disk hold them up."""


def quiet() -> None:
    """Let COLMAP log nothing but errors; its defaults come back with each process."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    pycolmap.logging.stderrthreshold = pycolmap.logging.Level.ERROR.value
    pycolmap.logging.logtostderr = False
    pycolmap.logging.alsologtostderr = False


MOST, DRAFT_MOST = 4096, 1500
"""Features of a picture; the doubled picture that COLMAP begins with finds more, not better ones."""
_LARGE = 1200
"""Pixels of the longer side from which a draft leaves out the finest scale: it looks at half the size."""
FEWEST = 60
"""Features that a picture has at least, on average, where anything is to be seen."""
_PICTURES_AT_ONCE = 8
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
        for start in range(0, len(wanted), _PICTURES_AT_ONCE):
            batch = wanted[start : start + _PICTURES_AT_ONCE]
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


_NEIGHBOURS = 12
"""Pictures that each one is matched with, at least."""
_FORWARD = 0.7
"""Metres that a turn of one radian counts as."""
_TURNED = np.cos(np.radians(75.0))
"""Pictures that look more differently show different things."""
_STRONGEST, _ALIKE = 500, 6
"""Features of a picture that are compared to see whether two show the same, and how many must."""
_IN_A_ROW = 4
"""Pictures before and after each in time that are matched anyway."""
_PAIRS_AT_ONCE = 60

Pair = tuple[int, int]


def by_place(T_world_camera: Float64[np.ndarray, "pictures 4 4"]) -> list[Pair]:
    """The pictures whose cameras are nearest to each one, looking the same way."""
    ahead = T_world_camera[:, :3, 2]
    where = np.concatenate([T_world_camera[:, :3, 3], _FORWARD * ahead], axis=1)
    apart = np.linalg.norm(where[:, None] - where, axis=-1)
    apart[ahead @ ahead.T < _TURNED] = np.inf
    np.fill_diagonal(apart, np.inf)
    nearest = np.argsort(apart, axis=1)[:, :_NEIGHBOURS]
    pairs = {
        (min(a, b), max(a, b))
        for a, row in enumerate(nearest.tolist())
        for b in row
        if np.isfinite(apart[a, b])
    }
    return sorted(pairs)


def by_look(database: Path, numbers: Sequence[int], progress: Progress) -> list[Pair]:
    """Pictures of which some of the strongest features look alike, and those next to each other."""
    with pycolmap.Database.open(database) as opened:
        features = [_strongest(opened, number) for number in numbers]
    count = len(features)
    pairs = {(a, b) for a in range(count) for b in range(a + 1, min(a + 1 + _IN_A_ROW, count))}
    for a in range(count):
        for b in range(a + 1, count):
            if len(match(features[a], features[b])[0]) >= _ALIKE:
                pairs.add((a, b))
        progress("compare", (a + 1) / count)
    return sorted(pairs)


def _strongest(opened: pycolmap.Database, number: int) -> Float32[np.ndarray, "features 128"]:
    """Descriptors of the largest features: they are seen from near and far."""
    keypoints = opened.read_keypoints(number)
    descriptors = unit(opened.read_descriptors(number).data)
    if keypoints.shape[1] >= 6:  # x, y and the affine shape
        size = np.abs(keypoints[:, 2] * keypoints[:, 5] - keypoints[:, 3] * keypoints[:, 4])
    else:
        size = keypoints[:, 2]
    return descriptors[np.argsort(-size)[:_STRONGEST]]


def match_pairs(
    database: Path, frames: Sequence[Frame], pairs: Sequence[Pair], progress: Progress
) -> None:
    """Match and verify pairs of pictures; those that the database has are not matched again."""
    quiet()
    matching = pycolmap.FeatureMatchingOptions()
    matching.num_threads = THREADS
    pairing = pycolmap.ImportedPairingOptions()
    listed = database.with_suffix(".pairs.txt")
    pairing.match_list_path = str(listed)
    left = _unmatched(database, frames, pairs)
    try:
        for start in range(0, len(left), _PAIRS_AT_ONCE):
            batch = left[start : start + _PAIRS_AT_ONCE]
            lines = (f"{frames[a].name} {frames[b].name}" for a, b in batch)
            listed.write_text("\n".join(lines) + "\n", encoding="utf-8")
            pycolmap.match_image_pairs(
                database,
                matching_options=matching,
                pairing_options=pairing,
                device=pycolmap.Device.cpu,
            )
            progress("match", (start + len(batch)) / len(left))
    finally:
        listed.unlink(missing_ok=True)


def _unmatched(database: Path, frames: Sequence[Frame], pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs that the database does not know yet."""
    with pycolmap.Database.open(database) as opened:
        number = {image.name: image.image_id for image in opened.read_all_images()}
        numbers = [number[frame.name] for frame in frames]
        return [
            (a, b) for a, b in pairs if not opened.exists_two_view_geometry(numbers[a], numbers[b])
        ]


@dataclass(frozen=True)
class Sight:
    """A point that somebody has picked in a picture."""

    picture: str
    """Name of the picture, with or without its ending."""
    x: float
    y: float
    """Pixels of the picture as it was picked; (0, 0) is the centre of the first."""


@dataclass(frozen=True)
class Length:
    """The distance of two points, each picked in two pictures or more."""

    metres: float
    a: tuple[Sight, ...]
    b: tuple[Sight, ...]


@dataclass(frozen=True)
class CameraOptions:
    """How to find the cameras, and what gives the scale."""

    poses: bool = True
    """Use the poses that the phone logged."""
    axes: str = AS_LOGGED
    """How they are to be read, see `ingest.scan.cameras.pose_agreement.readings`."""
    board: Reference | None = None
    """A board or markers beside the object; they go before all other scales."""
    length: Length | None = None
    height: float | None = None
    """Height of the object, metres."""
    metric: bool = False
    """A COLMAP model that is in metres already, and z up."""
    draft: bool = False
    """Find fewer features. It has no effect without logged poses, which then come from the features alone."""


def check_scale(options: CameraOptions, logged: bool, where: str) -> None:
    """Refuse a scan whose scale nothing would tell, before the long work begins.

    Args:
        options: what somebody says.
        logged: whether there are poses that a phone has logged.
        where: the source, for messages.

    Raises:
        InputError: "scan-scale" or "scan-length".
    """
    for metres in (options.height, options.length and options.length.metres):
        if metres is not None and not 0.01 <= metres <= 10:
            raise InputError(
                "scan-length",
                f"{metres:g} m cannot be right for a length on an object.",
                where=where,
                fix="Give it in metres, e.g. 0.84.",
            )
    scale_sources = (options.board, options.length, options.height)
    if logged or options.metric or any(one is not None for one in scale_sources):
        return
    raise InputError(
        "scan-scale",
        "Nothing says how large the object is: pictures alone do not.",
        where=where,
        fix="Give the object's height in metres (‹height› 0.84), or lay a printed board or marker "
        "beside it and film again (‹board› A4), or film with an app that logs ARKit's poses.",
    )


def picked_length(text: str | None) -> Length | None:
    """The length of "0.84:00012,310,420;00031,205,411:00012,330,80;00031,214,66".

    Metres, then two points, each as the pixels where two pictures or more show it.

    Raises:
        InputError: "scan-length".
    """
    if text is None:
        return None
    try:
        metres, a, b = text.split(":")
        return Length(float(metres), _point(a), _point(b))
    except ValueError:
        raise InputError(
            "scan-length",
            f"{text!r} is no length between two points.",
            field="length",
            fix="Write metres, then two points as picture,x,y in two pictures or more, such as "
            "0.84:00012,310,420;00031,205,411:00012,330,80;00031,214,66. The pictures are in the "
            "folder images beside the mesh.",
        ) from None


def _point(text: str) -> tuple[Sight, ...]:
    sights: list[Sight] = []
    for sight in text.split(";"):
        picture, x, y = sight.strip().rsplit(",", 2)
        sights.append(Sight(picture.strip(), float(x), float(y)))
    return tuple(sights)
