"""Checks by the pictures: what the camera sees agrees with the poses that the phone logged.

Gravity alone cannot tell a mirrored world or a wrong scale; angular velocity and acceleration can.
On a real log the correlations are 0.98 and more, the scale 0.92 (both are smoothed).
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64, UInt8
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation, Slerp

from ingest.distributions import chi2_quantile
from ingest.report.checked_session import CheckedSession
from ingest.report.take_report import Check, grade, graded
from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog
from ingest.session_images import image_times, pictures
from ingest.smoothing import cross_correlation, derivative_weights, smooth_derivative
from omomo_core.geometry.transforms import inverse

_PAIRS = 8
_STARTS = 64
"""Images that a partner is looked for."""
_WITHIN = 5.0
"""Seconds; the poses drift over longer."""
_AT_ONCE = 0.02
"""Seconds between an image and the pose that it is taken to have: half a period at 30 Hz."""
_BASELINE = 0.05, 0.8
"""Metres; less says nothing about positions, more shows other things."""
_SHIFT = np.radians([4.0, 25.0])
"""Rough shift of the picture."""
_BEST_SHIFT = np.radians(12.0)
_DEPTH = 2.0
"""Metres to what is filmed, as far as that matters for the shift."""


@dataclass(frozen=True)
class ImagePair:
    """Two images and their poses."""

    images: tuple[int, int]
    """Places in `image_times`."""
    poses: tuple[int, int]


def pick_pairs(look: CheckedSession) -> list[ImagePair]:
    """Up to eight pairs, spread over the clean stretches; none if the phone hardly moved."""
    images, poses = _posed(look)
    starts = np.unique(np.linspace(0, len(images) - 1, _STARTS).astype(int)) if len(images) else []
    stretch = _stretch(look)
    found: list[ImagePair] = []
    for start in starts:
        partner = _partner(look, poses, stretch, int(start))
        if partner is not None:
            chosen = [int(start), partner]
            found.append(ImagePair(_two(images[chosen]), _two(poses[chosen])))
    chosen = np.unique(np.linspace(0, len(found) - 1, _PAIRS).astype(int)) if found else []
    return [found[k] for k in chosen]


def _posed(look: CheckedSession) -> tuple[Int64[np.ndarray, " posed"], Int64[np.ndarray, " posed"]]:
    """The images taken at a pose, and that pose of each."""
    times, taken = look.session.times, image_times(look.session)
    after = np.searchsorted(times, taken).clip(1, len(times) - 1)
    nearest = after - (taken - times[after - 1] < times[after] - taken)
    at_once = np.flatnonzero(np.abs(times[nearest] - taken) <= _AT_ONCE)
    return at_once, nearest[at_once]


def _stretch(look: CheckedSession) -> Int64[np.ndarray, " frames"]:
    """A number for each pose, the same where nothing came between two of them."""
    # Gaps are no fault here: some apps log a picture a second.
    faults = look.breaks.jumps | look.breaks.frozen | look.breaks.untracked
    return np.concatenate([[0], np.cumsum(faults)])


def _partner(
    look: CheckedSession,
    poses: Int64[np.ndarray, " posed"],
    stretch: Int64[np.ndarray, " frames"],
    start: int,
) -> int | None:
    """The later image that shows the same things best shifted, None without one."""
    times, first = look.session.times, poses[start]
    stop = int(np.searchsorted(times[poses], times[first] + _WITHIN, "right"))
    later = poses[start:stop]
    baseline, shift = _moved(look.session.T_world_phone[first], look.session.T_world_phone[later])
    fits = (
        (baseline > _BASELINE[0]) & (baseline < _BASELINE[1]) & (stretch[later] == stretch[first])
    )
    fits &= (shift > _SHIFT[0]) & (shift < _SHIFT[1])
    if not fits.any():
        return None
    return start + int(np.argmin(np.where(fits, np.abs(shift - _BEST_SHIFT), np.inf)))


def _moved(
    first: Float64[np.ndarray, "4 4"], later: Float64[np.ndarray, "later 4 4"]
) -> tuple[Float64[np.ndarray, " later"], Float64[np.ndarray, " later"]]:
    """Metres between poses, and roughly by what angle the picture shifted (rad)."""
    relative = inverse(first) @ later
    cosine = (np.trace(relative[:, :3, :3], axis1=1, axis2=2) - 1) / 2
    baseline = np.linalg.norm(relative[:, :3, 3], axis=1)
    return baseline, np.arccos(cosine.clip(-1, 1)) + baseline / _DEPTH


def _two(values: Int64[np.ndarray, "2"]) -> tuple[int, int]:
    return int(values[0]), int(values[1])


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


def sight(look: CheckedSession) -> Check:
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
    look: CheckedSession, intrinsics: Float64[np.ndarray, "frames 4"], image_size: tuple[int, int]
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


def _share(look: CheckedSession, matches: list[_Shared], read: Callable[[Poses], Poses]) -> float:
    """Part of all matches that the poses explain when read so."""
    good = total = 0
    for pair in matches:
        first, second = read(look.session.T_world_phone[list(pair.poses)])
        good += int(explained(pair.ours, pair.theirs, inverse(first) @ second).sum())
        total += len(pair.ours)
    return good / total


_RATE = 100.0
_SMOOTH = 41
"""Samples of the cubic that is fitted for derivatives: 0.4 s."""
_MAX_LAG = 2.0
"""Seconds by which two clocks are looked for apart."""
_MIN_SECONDS = 2.0
_MIN_TURNING, _MIN_MOVING = 0.05, 0.22
"""rad/s and m/s^2 (standard deviation) of an axis that says something."""
_CLEARER = 2.5
"""Times by which an acceleration is greater than the noise of the poses' to be compared."""
_SURE = 0.7
"""Correlation that makes a lag or a scale believable."""
_FIX = (
    "Give the log and the IMU of one take, in the app's own axes and units; nothing mirrored, "
    "reordered or rescaled."
)


@dataclass(frozen=True)
class Agreement:
    """What the poses and the IMU have in common; None where too little moved to tell."""

    covered: float
    """Part of the take during which the IMU ran."""
    lag: float | None = None
    """Seconds by which the IMU's stamps are late."""
    turning: float | None = None
    """Correlation of the angular velocities, on the axis where it is worst."""
    moving: float | None = None
    """The same for the accelerations."""
    scale: float | None = None
    """Acceleration of the poses in units of the accelerometer's."""


def agreement_checks(look: CheckedSession) -> list[Check]:
    """A check each of the clocks, the rotation, the translation and the scale."""
    session = look.session
    if session.imu is None:
        return []
    found = measure_agreement(session, session.imu, look.used)
    return [_clocks(found), _correlation("turning", found.turning, "gyroscope"),
            _correlation("moving", found.moving, "accelerometer"), _scale(found.scale)]  # fmt: skip


def _clocks(found: Agreement) -> Check:
    message = f"the IMU ran during {found.covered:.0%} of the take"
    late = abs(found.lag or 0.0)
    if found.lag is not None:
        message += f"; its clock is {1000 * found.lag:+.0f} ms off"
    fix = "Give the IMU's log of this very take, on the clock of the poses."
    severity = "warn" if found.covered < 0.8 or late > 0.05 else "ok"
    return graded("clocks", severity, message, fix)


def _correlation(name: str, value: float | None, sensor: str) -> Check:
    if value is None:
        return Check(name, "ok", f"too little of it to compare with the {sensor}")
    severity = grade(1 - value, 1 - _SURE, 0.6)
    return graded(name, severity, f"correlation {value:.2f} with the {sensor}", _FIX)


def _scale(scale: float | None) -> Check:
    if scale is None:
        return Check("scale", "ok", "too little acceleration to compare")
    severity = grade(abs(float(np.log(scale))), np.log(1.35), np.log(2.0))
    message = f"a metre of the poses is {scale:.2f} m of the accelerometer"
    return graded("scale", severity, message, "Give the positions in metres as the app wrote them.")


def measure_agreement(
    session: CaptureSession, imu: ImuLog, used: Bool[np.ndarray, " steps"]
) -> Agreement:
    """Compare the poses' derivatives with the IMU, at 100 Hz, over the steps that are used."""
    start, stop = max(session.times[0], imu.times[0]), min(session.times[-1], imu.times[-1])
    covered = max(0.0, (stop - start) / np.ptp(session.times))
    if stop - start < _MIN_SECONDS or len(imu.times) < 3:
        return Agreement(covered)
    clock = np.arange(start, stop, 1 / _RATE)
    use = _usable(session, used, clock)
    if use.sum() < _MIN_SECONDS * _RATE:
        return Agreement(covered)
    R, turning, moving = _derivatives(session, clock)
    lag = _lag(turning, _imu_at(imu.times, imu.gyro, clock), use)
    at = clock + (lag or 0.0)
    gyro, accel = (_imu_at(imu.times, values, at) for values in (imu.gyro, imu.accel))
    felt = np.array([0.0, -GRAVITY, 0.0]) - R.apply(accel)
    agreed = _worst_axis(
        moving, felt, use, max(_MIN_MOVING, _CLEARER * _acceleration_noise(session))
    )
    return Agreement(
        covered,
        lag,
        _worst_axis(turning, gyro, use, _MIN_TURNING),
        agreed,
        _gain(moving, felt, use) if agreed is not None and agreed > _SURE else None,
    )


def _acceleration_noise(session: CaptureSession) -> float:
    """Standard deviation that the noise of positions gives to accelerations on each axis, m/s^2."""
    place, rate = session.T_world_phone[:, :3, 3], 1 / np.median(np.diff(session.times))
    left = np.diff(place, n=6, axis=0)
    if len(left) == 0:
        return 0.0
    # The quietest fifth tells: what is left of motion is not noise. 924 is the sum of the squared weights.
    quiet = np.quantile((left**2).sum(axis=1), 0.2) / chi2_quantile(0.2, 3) / 924
    growth = np.linalg.norm(derivative_weights(_SMOOTH, 3, 2)) * _RATE**2
    return float(np.sqrt(quiet * max(1.0, _RATE / rate)) * growth)


def _usable(
    session: CaptureSession,
    used: Bool[np.ndarray, " steps"],
    clock: Float64[np.ndarray, " samples"],
) -> Bool[np.ndarray, " samples"]:
    """Samples whose window of smoothing lies within what is used."""
    step = np.clip(np.searchsorted(session.times, clock, "right") - 1, 0, len(used) - 1)
    # Two samples more than the window: a velocity is made of two.
    good = uniform_filter1d(used[step].astype(float), _SMOOTH + 4) > 1 - 1e-6
    good[: _SMOOTH // 2] = good[-(_SMOOTH // 2) :] = False
    return good


def _derivatives(
    session: CaptureSession, clock: Float64[np.ndarray, " samples"]
) -> tuple[Rotation, Float64[np.ndarray, "samples 3"], Float64[np.ndarray, "samples 3"]]:
    """Rotation, angular velocity (camera axes) and acceleration (world) of the poses."""
    T = session.T_world_phone
    R = Slerp(session.times, Rotation.from_matrix(T[:, :3, :3]))(clock)
    place = np.stack([np.interp(clock, session.times, axis) for axis in T[:, :3, 3].T], axis=1)
    steps = (R[:-1].inv() * R[1:]).as_rotvec() * _RATE
    turning = smooth_derivative(np.concatenate([steps, steps[-1:]]), _SMOOTH, 3)
    return R, turning, smooth_derivative(place, _SMOOTH, 3, 2) * _RATE**2


def _imu_at(
    times: Float64[np.ndarray, " readings"],
    values: Float64[np.ndarray, "readings 3"],
    clock: Float64[np.ndarray, " samples"],
) -> Float64[np.ndarray, "samples 3"]:
    """Readings smoothed as the poses are, in camera axes."""
    values = np.stack([np.interp(clock, times, axis) for axis in values.T], axis=1)
    return smooth_derivative(values, _SMOOTH, 3) @ R_CAMERA_DEVICE.T


def _lag(
    poses: Float64[np.ndarray, "samples 3"],
    gyro: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
) -> float | None:
    """Shift at which the speeds of rotation agree best, whatever the axes; None if nowhere."""
    ours, theirs = np.linalg.norm(poses, axis=1), np.linalg.norm(gyro, axis=1)
    if min(ours[use].std(), theirs[use].std()) < _MIN_TURNING:
        return None
    x, y = np.where(use, ours - ours[use].mean(), 0.0), theirs - theirs.mean()
    power = cross_correlation(y**2, use.astype(float)).clip(1e-12)
    scores = cross_correlation(y, x) / np.sqrt((x @ x) * power)
    shifts = np.arange(1 - len(x), len(x))
    scores[np.abs(shifts) > min(_MAX_LAG * _RATE, len(x) / 3)] = 0.0
    best = int(np.argmax(scores))
    return float(shifts[best] / _RATE) if scores[best] > _SURE else None


def _correlate(x: Float64[np.ndarray, " samples"], y: Float64[np.ndarray, " samples"]) -> float:
    x, y = x - x.mean(), y - y.mean()
    return float(x @ y / max(np.linalg.norm(x) * np.linalg.norm(y), 1e-12))


def _worst_axis(
    ours: Float64[np.ndarray, "samples 3"],
    theirs: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
    least: float,
) -> float | None:
    """Lowest correlation among the axes on which enough happens."""
    if not np.ptp(theirs, axis=0).any():  # the app writes zeros for a sensor that is off
        return None
    busy = [k for k in range(3) if max(ours[use, k].std(), theirs[use, k].std()) > least]
    return min((_correlate(ours[use, k], theirs[use, k]) for k in busy), default=None)


def _gain(
    ours: Float64[np.ndarray, "samples 3"],
    theirs: Float64[np.ndarray, "samples 3"],
    use: Bool[np.ndarray, " samples"],
) -> float:
    x, y = (values[use] - values[use].mean(axis=0) for values in (ours, theirs))
    return float((x**2).sum() / (x * y).sum())
