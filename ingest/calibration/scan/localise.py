"""localise: where the object is to the camera of one picture, by the landmarks that it shows."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, UInt8

from ingest.calibration.scan.features import find_features, match
from ingest.calibration.scan.landmarks import Landmarks
from ingest.calibration.scan.resection import resect
from ingest.formats.axes import T_OPENCV_ARKIT_CAMERA
from omomo_core.errors import InputError

MIN_INLIERS = 25
_MIN_SPREAD = 0.02
"""Part of the picture that the inliers' hull covers at least."""


@dataclass(frozen=True)
class PhonePicture:
    """A picture that the clamped phone took."""

    name: str
    """For people: its time, or its file."""
    picture: UInt8[np.ndarray, "height width"]
    """Grey, landscape as the sensor is."""
    intrinsics: Float64[np.ndarray, "4"]
    """fx, fy, cx, cy in pixels of this picture (pixel centres at whole numbers)."""


@dataclass(frozen=True)
class Localised:
    """Where the object is to the phone, as one view has it."""

    T_phone_object: Float64[np.ndarray, "4 4"]
    covariance: Float64[np.ndarray, "6 6"]
    """Of `ingest.uncertainty`; the scale of the model apart."""
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
