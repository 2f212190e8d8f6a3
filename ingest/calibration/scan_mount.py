"""Method scan: the clamped phone's pictures, found again in the object's scan."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt8

from ingest.calibration.posterior import average
from ingest.calibration.scan_landmarks import Landmarks, find_features, match
from ingest.calibration.still import Still, disagreeing
from ingest.colmap import pycolmap
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.session_images import image_times, pictures
from ingest.uncertainty import between, skew
from omomo_core.errors import InputError

_MAX_ERROR = 4.0
"""Pixels of a picture 640 wide."""
_NEAREST = 0.1
"""Metres; what is nearer is not in focus, and a mistake if it is found."""
_MAX_LEVERAGE = 1.0
"""How many of the pose's six numbers may hang on one point."""
_ROUNDS = 10
_FEWEST = 6
_INDEPENDENT = 50
"""Points that err by themselves: their neighbours share the errors of the model's pictures."""


@dataclass(frozen=True)
class Resection:
    """A camera's pose and what it rests on."""

    T_camera_object: Float64[np.ndarray, "4 4"]
    """OpenCV's camera axes."""
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`."""
    inlier: Bool[np.ndarray, " points"]
    rms: float
    """Pixels between the inliers and where the pose puts them."""


def resect(
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
    size: tuple[int, int],
) -> Resection | None:
    """The pose that most of the points agree on; None when fewer than six do.

    Args:
        pixels: counted as COLMAP does, half a pixel more than OpenCV.
        points: the same in the object's frame, metres.
        intrinsics: fx, fy, cx, cy as OpenCV counts.
        size: width and height of the picture.
    """
    fx, fy, cx, cy = intrinsics
    camera = pycolmap.Camera(
        model="PINHOLE", width=size[0], height=size[1], params=[fx, fy, cx + 0.5, cy + 0.5]
    )
    limit = _MAX_ERROR * size[0] / 640
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = limit
    options.ransac.random_seed = 0
    found = pycolmap.estimate_and_refine_absolute_pose(pixels, points, camera, options)
    kept = np.zeros(len(points), bool)
    for _ in range(_ROUNDS):
        if found is None:
            return None
        before, kept = kept, _kept(_matrix(found), pixels, points, intrinsics, limit)
        if kept.sum() < _FEWEST:
            return None
        if (kept == before).all():
            break
        pose = found["cam_from_world"]
        found = pycolmap.refine_absolute_pose(pose, pixels, points, kept, camera)
    if found is None:
        return None
    T = _matrix(found)
    off, J, _ = _linear(T, pixels[kept], points[kept], intrinsics)
    variance = float((off**2).sum() / (2 * len(off) - 6))
    shared = max(1.0, len(off) / _INDEPENDENT)
    covariance = np.linalg.inv(np.einsum("nki,nkj->ij", J, J)) * variance * shared
    return Resection(T, covariance, kept, float(np.sqrt((off**2).sum(axis=1).mean())))


def _matrix(found: dict[str, pycolmap.Rigid3d]) -> Float64[np.ndarray, "4 4"]:
    return np.concatenate([found["cam_from_world"].matrix(), [[0.0, 0.0, 0.0, 1.0]]])


def _kept(
    T: Float64[np.ndarray, "4 4"],
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
    limit: float,
) -> Bool[np.ndarray, " points"]:
    """The points that agree with a pose, without those that it hangs on by themselves."""
    off, J, depth = _linear(T, pixels, points, intrinsics)
    kept = (np.linalg.norm(off, axis=1) < limit) & (depth > _NEAREST)
    if kept.sum() < _FEWEST:
        return kept
    covariance = np.linalg.pinv(np.einsum("nki,nkj->ij", J[kept], J[kept]))
    return kept & (np.einsum("nki,ij,nkj->n", J, covariance, J) < _MAX_LEVERAGE)


def _linear(
    T: Float64[np.ndarray, "4 4"],
    pixels: Float64[np.ndarray, "points 2"],
    points: Float64[np.ndarray, "points 3"],
    intrinsics: Float64[np.ndarray, "4"],
) -> tuple[
    Float64[np.ndarray, "points 2"],
    Float64[np.ndarray, "points 2 6"],
    Float64[np.ndarray, " points"],
]:
    """How far the points are off in the picture, how a step of the pose moves them, their depths."""
    turned = points @ T[:3, :3].T
    x, y, depth = (turned + T[:3, 3]).T
    z = np.where(np.abs(depth) < 1e-6, 1e-6, depth)
    fx, fy, cx, cy = intrinsics
    off = np.stack([fx * x / z + cx + 0.5, fy * y / z + cy + 0.5], axis=1) - pixels
    zero = np.zeros_like(x)
    rows = [[fx / z, zero, -fx * x / z**2], [zero, fy / z, -fy * y / z**2]]
    by_place = np.stack([np.stack(row, axis=-1) for row in rows], axis=1)
    return off, np.concatenate([-by_place @ skew(turned), by_place], axis=-1), depth


MIN_INLIERS = 25
_MIN_SPREAD = 0.02
"""Part of the picture that the inliers' hull covers at least."""


@dataclass(frozen=True)
class PhonePicture:
    """A picture that the clamped phone took."""

    name: str
    """Name for people: its time, or its file."""
    picture: UInt8[np.ndarray, "height width"]
    """Grey, landscape as the sensor is."""
    intrinsics: Float64[np.ndarray, "4"]
    """fx, fy, cx, cy in pixels of this picture (pixel centres at whole numbers)."""


@dataclass(frozen=True)
class Localised:
    """The object's pose in the phone's frame, by one view."""

    T_phone_object: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Covariance as in `ingest.uncertainty`; the scale of the model apart."""
    inliers: int
    rms: float
    """Pixels between the inliers and where the pose puts them."""


def localise(view: PhonePicture, landmarks: Landmarks) -> Localised:
    """Find the landmarks in a view, and the pose that explains them.

    Raises:
        InputError: "scan-no-match" when nothing of the model is in the view, "scan-few" when too
            little is, "scan-one-sided" when it is all in one small place.
    """
    pixels, points = _matches(view, landmarks)
    if len(pixels) < MIN_INLIERS:
        raise _no_match(view, len(pixels))
    height, width = view.picture.shape
    found = resect(pixels, points, view.intrinsics, (width, height))
    if found is None:
        raise _no_match(view, 0)
    _check(view, pixels, found.inlier)
    turned = np.kron(np.eye(2), T_OPENCV_ARKIT_CAMERA[:3, :3])
    return Localised(
        T_OPENCV_ARKIT_CAMERA @ found.T_camera_object,
        turned @ found.covariance @ turned.T,
        int(found.inlier.sum()),
        found.rms,
    )


def _matches(
    view: PhonePicture, landmarks: Landmarks
) -> tuple[Float64[np.ndarray, "matches 2"], Float64[np.ndarray, "matches 3"]]:
    """Pixels in the view (as COLMAP counts them), and the landmarks that they look like most."""
    ours = find_features(view.picture)
    nearest = np.full(len(ours.pixels), np.inf)
    point = np.full(len(ours.pixels), -1)
    for sighting in landmarks.sightings:
        mine, theirs, angle = match(ours.descriptors, sighting.descriptors)
        better = angle < nearest[mine]
        nearest[mine[better]] = angle[better]
        point[mine[better]] = sighting.points[theirs[better]]
    order = np.argsort(nearest)
    order = order[point[order] >= 0]
    # Of several features taken for one landmark, the one that looks like it most.
    _, first = np.unique(point[order], return_index=True)
    kept = order[first]
    return ours.pixels[kept], landmarks.points[point[kept]]


def _check(
    view: PhonePicture,
    pixels: Float64[np.ndarray, "matches 2"],
    inlier: Bool[np.ndarray, " matches"],
) -> None:
    count = int(inlier.sum())
    if count < MIN_INLIERS and count < len(inlier) / 10:
        raise _no_match(view, count)
    if count < MIN_INLIERS:
        raise InputError(
            "scan-few",
            f"Only {count} points of the scan are found again in what the phone sees; "
            f"{MIN_INLIERS} are needed.",
            where=view.name,
            fix="Scan the surroundings that the clamped phone looks at too, in the same light; put "
            "things with detail (posters, boxes) into its view, then scan and clamp again.",
        )
    hull = cv2.contourArea(cv2.convexHull(pixels[inlier].astype(np.float32)))
    covered = hull / view.picture.size
    if covered < _MIN_SPREAD:
        raise InputError(
            "scan-one-sided",
            f"All {count} points of the scan that the phone sees lie in {covered:.1%} of its "
            "picture; the pose hangs on them.",
            where=view.name,
            fix="Scan more of what the clamped phone looks at, so that it knows things all over its "
            "picture.",
        )


def _no_match(view: PhonePicture, count: int) -> InputError:
    return InputError(
        "scan-no-match",
        f"What the phone sees is not in the scan: {count} points agree on a place.",
        where=view.name,
        fix="Give the scan of this object in this room, filmed with its surroundings; the object "
        "must not be moved between scan and clamping.",
    )


_PER_STILL = 3
_PHOTOS = (".jpg", ".jpeg", ".png")


@dataclass(frozen=True)
class Views:
    """Pictures taken from one place."""

    name: str
    views: tuple[PhonePicture, ...]


def views_of(session: CaptureSession, still: Still) -> Views:
    """Up to three of the pictures that the phone took while it stood still.

    Raises:
        InputError: "scan-no-pictures" or "scan-no-camera".
    """
    if session.intrinsics is None or session.image_size is None:
        raise InputError(
            "scan-no-camera",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner or 3D Scanner App.",
        )
    taken = image_times(session) - session.times[0]
    inside = np.flatnonzero((taken >= still.start) & (taken <= still.stop))
    spread = np.linspace(0, len(inside) - 1, _PER_STILL + 2)[1:-1].round().astype(int)
    wanted = np.unique(inside[spread]).tolist() if len(inside) else []
    found = pictures(session, wanted)
    if not found:
        raise InputError(
            "scan-no-pictures",
            f"There is no picture of what the phone saw while it stood still ({still}).",
            where=str(session.source),
            fix="Record with an app that films while it logs; or take photos with the clamped "
            "phone and give their folder.",
        )
    views: list[PhonePicture] = []
    for index, picture in found.items():
        pose = int(np.abs(session.times - session.times[0] - taken[index]).argmin())
        K = _scaled(session.intrinsics[pose], picture.shape[1] / session.image_size[0])
        views.append(PhonePicture(f"{session.source}, {taken[index]:.2f} s", picture, K))
    return Views(str(still), tuple(views))


def views_in(folder: Path, intrinsics: Float64[np.ndarray, "4"]) -> Views:
    """The photos in a folder, all taken by the clamped phone.

    Args:
        folder: of JPEG or PNG files in landscape, as the sensor is.
        intrinsics: fx, fy, cx, cy in pixels of the photos.

    Raises:
        InputError: "photos-missing" or "photos-upright".
    """
    views: list[PhonePicture] = []
    files = sorted(folder.glob("*")) if folder.is_dir() else []
    for file in (file for file in files if file.suffix.lower() in _PHOTOS):
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            continue
        if grey.shape[0] > grey.shape[1]:
            raise InputError(
                "photos-upright",
                "The photo is upright; which way the camera was turned cannot be told.",
                where=str(file),
                fix="Give the photos in landscape with the phone's bottom on the right, as the "
                "camera stores them, with the intrinsics of that.",
            )
        views.append(PhonePicture(str(file), np.asarray(grey, np.uint8), intrinsics))
    if not views:
        raise InputError(
            "photos-missing",
            "There is no photo in the folder.",
            where=str(folder),
            fix=f"Give a folder with {', '.join(_PHOTOS)} files.",
        )
    return Views(str(folder), tuple(views))


def _scaled(intrinsics: Float64[np.ndarray, "4"], factor: float) -> Float64[np.ndarray, "4"]:
    """Intrinsics of a picture that is smaller by a factor; pixel centres are at whole numbers."""
    fx, fy, cx, cy = intrinsics
    centre = (np.array([cx, cy]) + 0.5) * factor - 0.5
    return np.array([fx * factor, fy * factor, *centre])


SCALE_SD = 0.005
"""Standard deviation of a model's scale, as a part of it."""
_MODEL = np.diag([np.radians(0.03) ** 2] * 3 + [0.001**2] * 3)
"""Covariance (rad, m) of what a model is off by as a whole where the phone looks: all views share it."""


def scan_mount(
    landmarks: Landmarks,
    places: Sequence[Views],
    *,
    scale_sd: float = SCALE_SD,
    progress: Callable[[str, float], None] = lambda name, done: None,
) -> Mount:
    """Return the mount by what the clamped phone sees of the object's scan.

    Views of one place that cannot be localised are left out, if there are others.

    Args:
        landmarks: the scan, in the object's frame.
        places: pictures of the clamped phone, the object always where it was scanned.
        scale_sd: standard deviation of the scan's scale, as a part of it.
        progress: called with how many views are done.

    Raises:
        InputError: those of `localise` when no view of a place is localised; "scan-slipped" when
            two places disagree about where the phone is on the object.
    """
    found: list[Localised] = []
    count = sum(len(place.views) for place in places)
    means: list[Localised] = []
    for place in places:
        here, problem = list[Localised](), None
        for view in place.views:
            try:
                here.append(localise(view, landmarks))
            except InputError as error:
                problem = problem or error
            progress("localise", (len(found) + len(here)) / count)
        if not here and problem is not None:
            raise problem
        found += here
        means.append(_mean(here))
    _check_agreement(places, means)
    mean = _mean(means)
    t = mean.T_phone_object[:3, 3]
    covariance = mean.covariance + _MODEL
    covariance[3:, 3:] += scale_sd**2 * np.outer(t, t)
    steps = between(mean.T_phone_object[None], np.array([x.T_phone_object for x in found]))
    missed = count - len(found)
    return Mount(
        mean.T_phone_object,
        "scan",
        covariance=covariance,
        residuals={
            "reprojection_px": mean.rms,
            "views_mm": 1e3 * float(np.sqrt((steps[:, 3:] ** 2).sum(axis=1).mean())),
            "views_deg": float(np.degrees(np.sqrt((steps[:, :3] ** 2).sum(axis=1).mean()))),
            "inliers": float(mean.inliers),
        },
        note=f"{missed} of {count} pictures could not be localised." if missed else "",
    )


def _mean(found: Sequence[Localised]) -> Localised:
    """Mean of several mounts; its covariance is that of one, because they share the errors of the scan."""
    T = np.array([one.T_phone_object for one in found])
    covariances = np.array([one.covariance for one in found])
    together = average(T, covariances)
    return Localised(
        together.T,
        together.covariance * int(together.kept.sum()),
        round(float(np.mean([one.inliers for one in found]))),
        float(np.mean([one.rms for one in found])),
    )


def _check_agreement(places: Sequence[Views], means: Sequence[Localised]) -> None:
    T = np.array([mean.T_phone_object for mean in means])
    pair = disagreeing(T, np.array([mean.covariance for mean in means]))
    if pair is None:
        return
    step = between(T[pair[0]], T[pair[1]])
    raise InputError(
        "scan-slipped",
        f"Between {places[pair[0]].name} and {places[pair[1]].name} the object moved by "
        f"{1e3 * np.linalg.norm(step[3:]):.0f} mm and {np.degrees(np.linalg.norm(step[:3])):.1f} "
        "deg in the phone's frame: the phone slipped on it, or it was not where it was scanned.",
        where=f"{places[pair[0]].views[0].name}; {places[pair[1]].views[0].name}",
        fix="Tighten the clamp and record again; or, if the object was only put down elsewhere, name "
        "the seconds in which it stood where it was scanned (‹stills›).",
    )
