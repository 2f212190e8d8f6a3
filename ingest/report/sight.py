"""Test of the poses' axes by the epipolar geometry of pairs of images."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.report.check import Check
from ingest.report.look import Look
from ingest.report.matches import BearingFeatures, explained, find_features, match
from ingest.report.pairs import pick_pairs
from ingest.session_images import image_times, pictures
from omomo_core.geometry.transforms import inverse

_MIN_MATCHES = 60
_FITS = 0.25
"""Share of the matches that a right reading explains at least; a wrong one explains 0.1."""
_CLEARLY = 2.0

Poses = Float64[np.ndarray, "poses 4 4"]


def _axes(kind: str, degrees: float) -> Callable[[Poses], Poses]:
    """Turns the camera about one of its axes."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(kind, degrees, degrees=True).as_matrix()
    return lambda poses: poses @ T


def _transposed(poses: Poses) -> Poses:
    other = poses.copy()
    other[:, :3, :3] = poses[:, :3, :3].swapaxes(1, 2)
    return other


_OPENCV = _axes("x", 180.0)
READINGS: dict[str, Callable[[Poses], Poses]] = {
    "with OpenCV axes": _OPENCV,
    "from world to camera": inverse,
    "from world to camera with OpenCV axes": lambda poses: _OPENCV(inverse(poses)),
    "with transposed rotations": _transposed,
    "turned by 90 deg about the viewing axis": _axes("z", 90.0),
    "turned by 180 deg about the viewing axis": _axes("z", 180.0),
    "turned by 270 deg about the viewing axis": _axes("z", 270.0),
}
"""What a log may hold that was read as ARKit's poses: how to read it instead.

Angles are counter-clockwise as one looks at the picture.
"""


@dataclass(frozen=True)
class _Shared:
    """What two images both show: rays in the first, rays in the second."""

    poses: tuple[int, int]
    ours: Float64[np.ndarray, "matches 3"]
    theirs: Float64[np.ndarray, "matches 3"]


def sight(look: Look) -> Check:
    """Whether features of some pairs of images fit the poses as read, or a misreading of them.

    Decodes up to sixteen images: a second or two.
    """
    session = look.session
    if len(image_times(session)) == 0:
        return Check("sight", "ok", "no images")
    K, size = session.intrinsics, session.image_size
    if K is None or size is None or not (K[:, :2] > 0).all():
        return Check("sight", "ok", "the camera is not known: images cannot be compared")
    matches = _matches(look, K, size)
    count = sum(len(pair.ours) for pair in matches)
    if count < _MIN_MATCHES:
        return Check(
            "sight",
            "warn",
            f"{count} matches in {len(matches)} pairs of images: too few to prove the axes",
            fix="Film a lit room with texture, and turn the phone about while it moves.",
        )
    shares = {name: _share(look, matches, read) for name, read in READINGS.items()}
    return _verdict(_share(look, matches, lambda poses: poses), shares, count, len(matches))


def _verdict(own: float, shares: dict[str, float], count: int, pairs: int) -> Check:
    other = max(shares, key=lambda name: shares[name])
    matches_text = f"of {count} matches in {pairs} pairs of images"
    if own >= _FITS and own > _CLEARLY * shares[other]:
        return Check(
            "sight", "ok", f"{own:.0%} {matches_text} fit the poses; misread, {shares[other]:.0%}"
        )
    if shares[other] >= _FITS and shares[other] > _CLEARLY * own:
        message = (
            f"the images fit poses {other} ({shares[other]:.0%} {matches_text}; as read, {own:.0%})"
        )
        fix = "Give the log as the app wrote it, or convert the poses to the axes of its layout."
        return Check("sight", "bad", message, fix=fix)
    message = f"{own:.0%} {matches_text} fit the poses, {shares[other]:.0%} fit poses {other}"
    if max(own, shares[other]) < _FITS:
        fix = "Give the video or images that belong to this log; do not crop or turn them."
    else:
        fix = "Turn the phone about more than one axis while it moves, so that the axes show."
    return Check("sight", "warn", message, fix=fix)


def _matches(
    look: Look, intrinsics: Float64[np.ndarray, "frames 4"], image_size: tuple[int, int]
) -> list[_Shared]:
    """Each pair whose images can be read, and the rays of what both show."""
    pairs = pick_pairs(look)
    pose_of = {i: pose for pair in pairs for i, pose in zip(pair.images, pair.poses, strict=True)}
    features: dict[int, BearingFeatures] = {
        index: find_features(picture, intrinsics[pose_of[index]], image_size)
        for index, picture in pictures(look.session, sorted(pose_of)).items()
    }
    return [
        _Shared(pair.poses, *match(features[pair.images[0]], features[pair.images[1]]))
        for pair in pairs
        if features.keys() >= set(pair.images)
    ]


def _share(look: Look, matches: list[_Shared], read: Callable[[Poses], Poses]) -> float:
    """Part of all matches that the poses explain when read so."""
    good = total = 0
    for pair in matches:
        first, second = read(look.session.T_world_phone[list(pair.poses)])
        good += int(explained(pair.ours, pair.theirs, inverse(first) @ second).sum())
        total += len(pair.ours)
    return good / total
