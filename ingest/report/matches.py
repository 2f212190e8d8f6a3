"""What two images have in common, and whether a relative pose explains it."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8

_FEATURES = 2000
_RATIO = 0.75
"""Distance of the best match in units of the second best: what is alike elsewhere is dropped."""
_TOLERANCE = np.radians(0.25)
"""Two pixels of an image 640 wide: errors of ARKit's poses and its rolling shutter are in it."""


@dataclass(frozen=True)
class BearingFeatures:
    """SIFT features of an image, as bearings in the phone's frame."""

    rays: Float64[np.ndarray, "points 3"]
    """Unit vectors in the phone's frame."""
    descriptors: Float32[np.ndarray, "points 128"]


def find_features(
    picture: UInt8[np.ndarray, "height width"],
    intrinsics: Float64[np.ndarray, "4"],
    image_size: tuple[int, int],
) -> BearingFeatures:
    """SIFT features of a grey image.

    Args:
        picture: in the orientation of the intrinsics; may be smaller than `image_size`.
        intrinsics: fx, fy, cx, cy in pixels of an image of `image_size`.
        image_size: width and height.
    """
    keypoints, descriptors = cv2.SIFT.create(_FEATURES).detectAndCompute(picture, None)
    if len(keypoints) == 0:
        return BearingFeatures(np.empty((0, 3)), np.empty((0, 128), np.float32))
    pixels = np.array([keypoint.pt for keypoint in keypoints], np.float64)
    height, width = picture.shape
    # Pixel centres stand at whole numbers, so half a pixel is added before scaling.
    pixels = (pixels + 0.5) * np.array(image_size) / [width, height] - 0.5
    x, y = ((pixels - intrinsics[2:]) / intrinsics[:2]).T
    return BearingFeatures(
        _unit(np.stack([x, -y, -np.ones_like(x)], axis=1)), np.asarray(descriptors)
    )


def match(
    first: BearingFeatures, second: BearingFeatures
) -> tuple[Float64[np.ndarray, "matches 3"], Float64[np.ndarray, "matches 3"]]:
    """Rays of the features found in both images: those in the first, those in the second."""
    found = cv2.BFMatcher(cv2.NORM_L2).knnMatch(first.descriptors, second.descriptors, k=2)
    kept = [
        (pair[0].queryIdx, pair[0].trainIdx)
        for pair in found
        if len(pair) == 2 and pair[0].distance < _RATIO * pair[1].distance
    ]
    ours, theirs = np.array(kept, int).reshape(-1, 2).T
    return first.rays[ours], second.rays[theirs]


def explained(
    ours: Float64[np.ndarray, "matches 3"],
    theirs: Float64[np.ndarray, "matches 3"],
    T_first_second: Float64[np.ndarray, "4 4"],
) -> Bool[np.ndarray, " matches"]:
    """Which matches can be one point in front of both cameras.

    Args:
        ours, theirs: unit rays, each in the frame of its own camera.
        T_first_second: the second camera in the frame of the first; metres do not matter.
    """
    # A camera that did not move at all leaves only its rotation to be tested.
    baseline = T_first_second[:3, 3] / max(float(np.linalg.norm(T_first_second[:3, 3])), 1e-12)
    turned = theirs @ T_first_second[:3, :3].T
    cross_ours, cross_theirs = np.cross(baseline, ours), np.cross(baseline, turned)
    # Sampson's distance from the epipolar plane, of rays instead of pixels.
    size = np.sqrt((cross_ours**2).sum(axis=1) + (cross_theirs**2).sum(axis=1))
    off = np.abs((ours * cross_theirs).sum(axis=1)) / np.maximum(size, 1e-12)
    return (off < _TOLERANCE) & _in_front(ours, turned, baseline)


def _in_front(
    ours: Float64[np.ndarray, "matches 3"],
    turned: Float64[np.ndarray, "matches 3"],
    baseline: Float64[np.ndarray, "3"],
) -> Bool[np.ndarray, " matches"]:
    """Whether two rays come closest in front of both cameras, or run parallel (far away)."""
    cosine = (ours * turned).sum(axis=1)
    along_ours, along_turned = ours @ baseline, turned @ baseline
    # Both depths, times the same positive number.
    near = (along_ours > cosine * along_turned) & (cosine * along_ours > along_turned)
    return near | (cosine > np.cos(_TOLERANCE))


def _unit(vectors: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points 3"]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
