"""Whether an object stands by itself: what supports it, and which lever tips it.

A hand keeps an object that stands on one edge from falling by lifting it beyond that edge, the farther the
lighter, or, where it is tall, by pushing its top across; the floor's friction bounds that push.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_closing, binary_opening, uniform_filter1d

from omomo_core.contact.contact_config import STABILITY, SUPPORT
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import frame_noise
from omomo_core.motion import FPS


@dataclass(frozen=True)
class Overhang:
    """The direction in which an object would fall, in its own frame, by which side of it is down."""

    metres: Float[np.ndarray, " frames"]
    """Distance of the centre of mass outside the support; negative where it is above the support."""
    direction: Float[np.ndarray, "frames 3"]
    """Horizontal unit vectors from the edge it stands on to its centre of mass."""
    edge: Float[np.ndarray, " frames"]
    """How far that edge lies along `direction`, metres."""
    up: Float[np.ndarray, "frames 3"]
    """The world's up."""
    floor: Float[np.ndarray, " frames"]
    """How far its lowest point lies along `up`, metres."""

    def at(self, frames: Bool[np.ndarray, " frames"]) -> "Overhang":
        """Return the overhang of some of the frames."""
        kept = (self.metres, self.direction, self.edge, self.up, self.floor)
        return Overhang(*(x[frames] for x in kept))


def overhang(take: ObjectFeatures, frames: Int[np.ndarray, " some"]) -> Overhang:
    """Return the overhang of an object in some frames, as if its lowest point were on the floor."""
    tilts, which = np.unique(
        np.round(take.motion.T_world_object[frames, 2, :3] / STABILITY.tilt_step),
        axis=0,
        return_inverse=True,
    )
    corners = take.surface.outline
    directions = np.random.default_rng(0).normal(size=(STABILITY.outline_directions, 3))
    outline = corners[np.unique((corners @ directions.T).argmax(axis=0))]
    found = [_overhang_row(outline, take.surface.centre, t / np.linalg.norm(t)) for t in tilts]
    rows = np.array(found).reshape(-1, 9)[which.reshape(-1)]
    return Overhang(rows[:, 0], rows[:, 1:4], rows[:, 4], rows[:, 5:8], rows[:, 8])


def _overhang_row(
    outline: Float[np.ndarray, "points 3"],
    centre: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "9"]:
    """Return one row of an `Overhang`: metres, direction, edge, up, floor.

    Args:
        outline: corners of the object's convex hull, its frame, metres.
        centre: its centre of mass.
        up: the world's up in its frame.
    """
    height = outline @ up
    floor = height.min()
    height = height - floor
    low, high = height <= STABILITY.sole, height > STABILITY.sole
    # Points where the hull's sides leave the sole: without them support would depend on the tessellation.
    share = (STABILITY.sole - height[low])[:, None] / (height[high] - height[low][:, None])
    rim = outline[low][:, None] + share[..., None] * (outline[high] - outline[low][:, None])
    touching = np.concatenate([outline[low], rim.reshape(-1, 3)])
    angle = np.arange(STABILITY.support_directions) * (2 * np.pi / STABILITY.support_directions)
    across = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    across /= np.linalg.norm(across)
    around = np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(up, across))
    edges = (around @ touching.T).max(axis=1)
    beside = around @ centre - edges
    k = beside.argmax()
    return np.array([beside[k], *around[k], edges[k], *up, floor])


@dataclass(frozen=True)
class TippingLever:
    """The frames in which somebody holds up an object that stands on an edge."""

    frames: Int[np.ndarray, " tipped"]
    overhang: Overhang
    """The overhang in those frames."""

    def effort(
        self,
        palms: Float[np.ndarray, "samples tipped 2 3"],
        held: Bool[np.ndarray, "samples tipped 2"],
    ) -> Float[np.ndarray, " samples"]:
        """Return the mean force that holds it up, as a share of its weight; NaN with too few held frames.

        Args:
            palms: left and right, in the object's frame, metres.
            held: which of them hold it.
        """
        out = (
            np.einsum("kthi,ti->kth", palms, self.overhang.direction) - self.overhang.edge[:, None]
        )
        high = np.einsum("kthi,ti->kth", palms, self.overhang.up) - self.overhang.floor[:, None]
        arm = np.where(held, np.maximum(out, STABILITY.friction * high), -np.inf).max(axis=2)
        force = self.overhang.metres / arm.clip(STABILITY.shortest_lever)
        by_hand = held.any(axis=2)
        count = by_hand.sum(axis=1)
        total = np.where(by_hand, force, 0).sum(axis=1)
        return np.where(count < STABILITY.shortest_tipping, np.nan, total / count.clip(1))


def tipping_lever(
    take: ObjectFeatures, must_hold: Bool[np.ndarray, " frames"]
) -> TippingLever | None:
    """Return the frames in which an object stands on an edge and is held up; None if there are too few.

    Args:
        take: the object and its motion.
        must_hold: frames in which somebody must hold it.
    """
    frames = np.flatnonzero(must_hold & (take.lowest < STABILITY.floor_reach))
    falls = overhang(take, frames)
    kept = falls.metres > STABILITY.stable_overhang
    if kept.sum() < STABILITY.shortest_tipping:
        return None
    return TippingLever(frames[kept], falls.at(kept))


def must_be_held(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which somebody must hold the object.

    It must be held where it moves or turns, where it is off the floor and not still (a still one may stand on
    a table), and where it is on the floor but tipped, so that it would fall.
    """
    speed, spin = (np.linalg.norm(x, axis=1) for x in (take.velocity, take.spin))
    low = take.lowest < STABILITY.floor_reach
    held = (speed > SUPPORT.moving_speed) | (spin > SUPPORT.turning_speed) | (~low & ~_still(take))
    unsure = np.flatnonzero(low & ~held)
    held[unsure] = overhang(take, unsure).metres > STABILITY.stable_overhang
    return _drop_short_runs(held, SUPPORT.shortest_run)


def middle_of_hold(must_hold: Bool[np.ndarray, " frames"]) -> int:
    """Return the frame in the middle of the first time for which somebody must hold the object; 0 for never.

    A short rest does not end that time, and of a long one the first seconds count.
    """
    held = runs(
        binary_closing(np.pad(must_hold, SUPPORT.short_rest), iterations=SUPPORT.short_rest)
    )
    if not held:
        return 0
    start, stop = (frame - SUPPORT.short_rest for frame in held[0])
    return start + min(stop - start, SUPPORT.longest_hold) // 2


def touchable_range(
    take: ObjectFeatures, must_hold: Bool[np.ndarray, " frames"]
) -> tuple[int, int]:
    """Return the first frame, and the one after the last, in which hands may be on the object.

    Args:
        take: the object and its motion.
        must_hold: frames in which somebody must hold it.

    Returns:
        A moment before it is first moved and as long after it was last; (frames, 0) if it never moves.
        What is lifted or tipped must be gripped first; what slides flat moves as soon as it is touched.
    """
    # At the take's ends a frame of noise is no motion that they cut short.
    moving = binary_opening(~_still(take), np.ones(SUPPORT.rest_frames))
    moved = np.flatnonzero(must_hold | moving)
    if not len(moved):
        return take.frames, 0
    rises, frames = (
        (SUPPORT.flat_rise, SUPPORT.lifted_rise),
        (SUPPORT.touching, SUPPORT.gripping),
    )
    rise = max(float(np.ptp(take.centre[:, 2])), float(take.lowest.max()))
    around = round(float(np.interp(rise, rises, frames)))
    return max(int(moved[0]) - around, 0), min(int(moved[-1]) + 1 + around, take.frames)


def _still(take: ObjectFeatures) -> Bool[np.ndarray, " frames"]:
    """Return the frames in which the object may be resting.

    The means of velocities are so wide that the tracker's noise does not reach the speeds they are
    compared with.
    """
    T = take.motion.T_world_object.copy()
    T[:, :3, 3] = take.centre
    noise = frame_noise(T, np.ones(len(T), bool), SUPPORT.quiet_share)
    limits = (SUPPORT.resting_speed, SUPPORT.resting_turning_speed)
    # The mean velocity over a time is the way between its ends.
    widths = [
        SUPPORT.noise_margin * sd * FPS / limit for sd, limit in zip(noise, limits, strict=True)
    ]
    width = round(float(np.clip(max(widths), SUPPORT.smoothing, SUPPORT.widest_smoothing)))
    speed, spin = (
        np.linalg.norm(uniform_filter1d(x, width, axis=0, mode="nearest"), axis=1)
        for x in (take.velocity, take.spin)
    )
    return _drop_short_runs(
        (speed < SUPPORT.resting_speed) & (spin < SUPPORT.resting_turning_speed),
        SUPPORT.rest_frames,
    )


def _drop_short_runs(x: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    """Return only the runs of at least so many frames, or of half as many that the take's ends cut short."""
    cut = shortest // 2
    whole = np.pad(x, shortest, mode="edge")
    whole[: shortest - cut] = whole[len(whole) - shortest + cut :] = False
    return binary_opening(whole, np.ones(min(shortest, len(x) + 2 * cut)))[shortest:-shortest]
