"""How a phone's pictures and its LiDAR err: grain, shake, exposure; noise, mixed edges, confidence."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from capture_app.simulator.simulated_phone import PhoneNoise
from ingest.formats.scan_capture import SIZE as LIDAR_SIZE

_FARTHEST = 5.0
"""Metres that a phone's LiDAR reaches."""


@dataclass(frozen=True)
class FilmErrors:
    """Sizes of the errors of a phone that is carried around a thing."""

    grain: float = 2.5
    """Standard deviation of each channel of a pixel, grey levels."""
    shake: float = 0.8
    """Pixels that a picture is smeared over, on average, in pictures 960 wide."""
    jolts: float = 0.08
    """Share of pictures that are smeared over twenty times as much."""
    exposure: float = 0.04
    """Standard deviation of the brightness of a picture, as a part."""
    vignette: float = 0.15
    """How much darker the corners are."""
    poses: PhoneNoise = field(
        default_factory=lambda: PhoneNoise(jitter_m=0.002, jitter_deg=0.15, drift=0.0015)
    )
    depth: float = 0.004
    """Standard deviation of a depth at one metre, metres; half of it shared by what is near."""


PERFECT = FilmErrors(0.0, 0.0, 0.0, 0.0, 0.0, PhoneNoise(0.0, 0.0, 0.0), 0.0)


def photographed(
    picture: UInt8[np.ndarray, "h w 3"], errors: FilmErrors, rng: np.random.Generator
) -> UInt8[np.ndarray, "h w 3"]:
    """A drawn picture as a phone takes it while it is carried."""
    height, width = picture.shape[:2]
    smear = errors.shake * width / 960 * rng.exponential()
    if rng.random() < errors.jolts:
        smear = 20 * errors.shake * width / 960 * rng.uniform(0.7, 1.3)
    seen = _smeared(picture.astype(np.float32), smear, rng.uniform(0, np.pi))
    x, y = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    light = (1 + errors.exposure * rng.normal()) * (1 - errors.vignette * (x**2 + y**2) / 2)
    seen = seen * light[..., None].astype(np.float32)
    seen += errors.grain * rng.standard_normal(seen.shape, np.float32)
    return np.clip(seen, 0, 255).astype(np.uint8)


def _smeared(
    picture: Float32[np.ndarray, "h w 3"], length: float, angle: float
) -> Float32[np.ndarray, "h w 3"]:
    """Blurred along a line as long as `length` pixels."""
    steps = int(np.ceil(length)) | 1
    if steps < 3:
        return picture
    kernel = np.zeros((steps, steps), np.float32)
    for part in np.linspace(-0.5, 0.5, 4 * steps):
        step = part * length * np.array([np.cos(angle), np.sin(angle)])
        x, y = np.rint(step + steps // 2).astype(int)
        kernel[y, x] += 1
    return np.asarray(cv2.filter2D(picture, -1, kernel / kernel.sum()), np.float32)


def lidar(
    depth: Float32[np.ndarray, "h w"], errors: FilmErrors, rng: np.random.Generator
) -> tuple[Float32[np.ndarray, "192 256"], UInt8[np.ndarray, "192 256"]]:
    """What ARKit makes of a drawn depth: metres, and its confidence 0 to 2.

    At edges near and far are mixed, and the confidence is low.
    """
    far = np.where(depth > 0, depth, 10.0)
    mixed = cv2.resize(far, LIDAR_SIZE, interpolation=cv2.INTER_AREA)
    nearest = -cv2.dilate(-mixed, np.ones((3, 3), np.uint8))
    step = (cv2.dilate(mixed, np.ones((3, 3), np.uint8)) - nearest) / mixed
    confidence = np.where(step > 0.1, 0, np.where(step > 0.05, 1, 2)).astype(np.uint8)
    height, width = mixed.shape
    slow = rng.standard_normal((height // 16, width // 16), np.float32)
    shared = cv2.resize(slow, LIDAR_SIZE, interpolation=cv2.INTER_CUBIC)
    white = rng.standard_normal(mixed.shape, np.float32)
    size = errors.depth * np.maximum(mixed, 0.5)
    measured = mixed + size * np.float32(np.sqrt(0.5)) * (shared + white)
    out = mixed > _FARTHEST
    confidence[out] = 0
    return np.where(out, 0, measured).astype(np.float32), confidence
