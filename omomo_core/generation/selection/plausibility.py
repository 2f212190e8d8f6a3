"""Which sides of an object people may hold from, and samples that cover them.

A hypothesis given half a turn about the vertical through the object's centre keeps the left hand left and
the right hand right, and is as good wherever the object has a surface there too. Where the object stands
on an edge, its weight tells the side. Elsewhere the object's motion does not always tell it, and the network
is more certain than it is right.

Hypotheses of the palms are cheap and bodies are not, so more of them are sampled than bodies are made. A
single sample is the medoid of all hypotheses.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from torch import Tensor

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.selection_config import (
    COVERAGE,
    OPPOSITE_SIDE,
    PERSON_CONSTRAINT,
    PLAUSIBILITY,
    SLIDING,
    START,
)
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import FPS
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.hands_capture import LAYOUT

Samples = Float[Tensor, "samples frames 8"]
"""Features of stage 1: left and right palm from the object's centre, contacts of both from -1 to 1."""
Hypotheses = Float[Tensor, "hypotheses frames 8"]
"""The same features of all hypotheses from which samples are selected."""


@dataclass(frozen=True)
class PalmHolds:
    """Places and times at which the palms of samples hold the object."""

    palms: Float[np.ndarray, "samples frames 2 3"]
    """In the object's frame, trained size."""
    held: Bool[np.ndarray, "samples frames 2"]
    clip: ObjectClip

    @staticmethod
    def of(features: Samples, clip: ObjectClip) -> "PalmHolds":
        """Return the holds of samples, given the features of stage 1 in world axes."""
        centre = torch.from_numpy(clip.trained.centre).float().expand(len(features), -1, 3)
        palms, contact = hand_stage.unpack(features, centre)
        T = clip.trained.motion.T_world_object
        local = np.stack([to_local(T, p) for p in palms.double().numpy()])
        return PalmHolds(local, (contact > 0.5).numpy(), clip)

    def as_good_as(self, other: "PalmHolds") -> Bool[np.ndarray, " samples"]:
        """Whether each sample's palms are about as near to the surface as those of `other`."""
        return self.from_surface - other.from_surface < PLAUSIBILITY.grasp_distance

    @property
    def from_surface(self) -> Float[np.ndarray, " samples"]:
        """Mean distance of holding palms from the object's surface, metres; 0 where none holds."""
        far = np.asarray(self.clip.trained.surface.tree.query(self.palms)[0]) / self.clip.scale
        count = np.maximum(self.held.sum(axis=(1, 2)), 1)
        return np.where(self.held, far, 0).sum(axis=(1, 2)) / count

    @property
    def plausible(self) -> Bool[np.ndarray, " samples"]:
        """Whether holding palms are at the surface, and stay on their sides of the object while both hold."""
        return (self.from_surface < PLAUSIBILITY.grasp_distance) & (
            self._turn < PLAUSIBILITY.largest_turn
        )

    @property
    def _turn(self) -> Float[np.ndarray, " samples"]:
        """Largest lasting angle between the line from palm to palm and its mean in the object, degrees."""
        line = self.palms[:, :, 1] - self.palms[:, :, 0]
        line /= np.linalg.norm(line, axis=-1, keepdims=True).clip(1e-6)
        both: Bool[np.ndarray, "samples frames"] = np.asarray(self.held.all(axis=-1))
        mean = np.where(both[..., None], line, 0).sum(axis=1)
        mean /= np.linalg.norm(mean, axis=-1, keepdims=True).clip(1e-6)
        along = np.where(both, np.einsum("sfx,sx->sf", line, mean), 1.0)
        off = np.degrees(np.arccos(np.clip(along, -1, 1)))
        return np.asarray(uniform_filter1d(off, PLAUSIBILITY.lasting, axis=1)).max(axis=1)

    @property
    def effort(self) -> Float[np.ndarray, " samples"]:
        """Force that holds up a tipped object, as a share of its weight (`TippingLever.effort`)."""
        lever = self.clip.lever
        assert lever is not None
        return lever.effort(self.palms[:, lever.frames], self.held[:, lever.frames])


def standing_position(features: Float[Tensor, "*b 8"]) -> Float[Tensor, "*b 2"]:
    """Return where a person with these palms stands on the floor, from the object's centre, metres."""
    left, right = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3))[..., :2].unbind(dim=-2)
    across_body = left - right
    ahead = torch.stack([across_body[..., 1], -across_body[..., 0]], dim=-1)
    ahead = ahead / ahead.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    holds = (features[..., 3 * LAYOUT.vectors :] > 0).any(dim=-1, keepdim=True)
    reach = torch.where(holds, START.holding_reach, START.idle_reach)
    return (left + right) / 2 - reach * ahead


def stands_in_front(features: Samples, clip: ObjectClip) -> Bool[np.ndarray, " samples"]:
    """Return which samples have the person in the way of an object that slides flat over the floor.

    People push such an object from behind; of 18 recorded people who move a box so, nobody walks backwards
    before it. Of what is carried or tilted this does not hold, nor of what goes to and fro, and no sample is
    named.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        clip: the object.
    """
    way = sliding_velocity(clip.trained)
    moving = np.linalg.norm(way, axis=1) > SLIDING.slowest
    if not moving.any():
        return np.zeros(len(features), bool)
    place = standing_position(features).double().numpy()[:, moving]
    way = way[moving] / np.linalg.norm(way[moving], axis=1, keepdims=True)
    place /= np.linalg.norm(place, axis=-1, keepdims=True).clip(1e-6)
    ahead: Float[np.ndarray, "samples frames"] = np.einsum("sfx,fx->sf", place, way)
    return (ahead > SLIDING.ahead).mean(axis=1) > SLIDING.share


def sliding_velocity(take: ObjectFeatures) -> Float[np.ndarray, "frames 2"]:
    """Return the horizontal velocity (m/s) of an object that slides flat over the floor; else zeros.

    An object slides flat where it stays on the floor, and as upright as in the first frame, all the time, and
    does not go to and fro.
    """
    up = take.motion.T_world_object[:, 2, :3]
    tilt = np.degrees(np.arccos(np.clip(up @ up[0], -1, 1)))
    flat = bool(tilt.max() < SLIDING.tilt and take.lowest.max() < SLIDING.lift)
    return take.velocity[:, :2] * (
        flat and straightness(take.velocity) > PERSON_CONSTRAINT.least_straight
    )


def straightness(velocity: Float[np.ndarray, "frames 3"]) -> float:
    """Return how straight an object goes over the floor: 1 for a line, 0 for to and fro, or if it stays."""
    speed = np.linalg.norm(velocity[:, :2], axis=1).sum()
    return float(np.linalg.norm(velocity[:, :2].sum(axis=0)) / max(speed, 1e-9))


def has_front(velocity: Float[np.ndarray, "frames 3"]) -> bool:
    """Return whether an object goes somewhere over the floor, so that its way has a front and a back."""
    way = float(np.linalg.norm(velocity[:, :2].sum(axis=0))) / FPS
    return (
        way > PERSON_CONSTRAINT.least_way
        and straightness(velocity) > PERSON_CONSTRAINT.least_straight
    )


_HALF_TURN = torch.tensor([-1.0, -1.0, 1.0]).repeat(2)


def move_to_lighter_side(features: Samples, clip: ObjectClip) -> Samples:
    """Return the samples; one that tips the object from its heavy side is moved to the opposite side.

    Args:
        features: palms from the object's centre in axes whose third is up, contacts.
        clip: the object.
    """
    if clip.lever is None:
        return features
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    heavy = there.effort < OPPOSITE_SIDE.lighter * here.effort
    change = heavy & there.as_good_as(here) if heavy.any() else heavy
    return torch.where(torch.from_numpy(change)[:, None, None], away, features)


def add_opposite_side(features: Samples, clip: ObjectClip) -> Samples:
    """Return the samples with the last of them replaced by the first, seen from the opposite side.

    Args:
        features: as above, the most central first.
        clip: the object.
    """
    away = half_turn(features)
    here, there = PalmHolds.of(features, clip), PalmHolds.of(away, clip)
    possible = there.as_good_as(here)
    if clip.lever is not None:
        possible &= ~(here.effort < OPPOSITE_SIDE.lighter * there.effort)
    possible &= ~stands_in_front(away, clip)
    changed = np.flatnonzero(possible)[: len(features) // OPPOSITE_SIDE.one_in]
    return torch.cat([features[: len(features) - len(changed)], away[changed]])


def half_turn(features: Samples) -> Samples:
    """Return the samples half a turn about the vertical through the object's centre."""
    away = features.clone()
    away[..., : len(_HALF_TURN)] *= _HALF_TURN
    return away


def turned(features: Samples, degrees: Float[np.ndarray, " samples"]) -> Samples:
    """Return each sample turned about the vertical through the object's centre."""
    angle = torch.from_numpy(np.radians(degrees)).to(features)[:, None, None]
    palms = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (LAYOUT.vectors, 3))
    x, y, z = palms.unbind(dim=-1)
    across, along = torch.cos(angle), torch.sin(angle)
    moved = torch.stack([across * x - along * y, along * x + across * y, z], dim=-1)
    return torch.cat([moved.flatten(-2), features[..., 3 * LAYOUT.vectors :]], dim=-1)


def select_by_coverage(
    features: Hypotheses, clip: ObjectClip, samples: int, *, placed: bool = False
) -> Samples:
    """Return the samples that cover all hypotheses best (k-medoids), some of them from the opposite side.

    A hypothesis that would lift the heavy side of a tipped object changes sides first. Implausible
    hypotheses are left out, unless too few others are left.

    Args:
        features: of all hypotheses, in axes whose third is up.
        clip: the object.
        samples: how many to keep.
        placed: it is said where the person is, and hypotheses fit that: none changes sides.
    """
    x = features if placed else move_to_lighter_side(features, clip)
    possible = PalmHolds.of(x, clip).plausible
    behind = possible if placed else possible & ~stands_in_front(x, clip)
    for some in (behind, possible):
        if some.sum() >= samples:
            x = x[torch.from_numpy(some)]
            break
    kept = torch.from_numpy(k_medoids(_palms(x), samples))
    selected = kernel_mean(x)[kept]
    return selected if placed else add_opposite_side(selected, clip)


def kernel_mean(features: Samples) -> Samples:
    """Return the kernel mean at each hypothesis, frame by frame: the average of those near it.

    A hypothesis errs in what all of its kind agree on and in what nobody can tell; their mean hardly errs
    in the latter. The width of the kernel follows the distance to the nearest hypotheses in each frame.
    """
    palms, holds = _palms(features), (features[..., 3 * LAYOUT.vectors :] > 0).double().numpy()
    x: list[Tensor] = []
    for one, held in zip(palms, holds, strict=True):
        apart = np.linalg.norm(palms - one, axis=-1).mean(axis=-1)
        apart += COVERAGE.contact_distance * np.abs(holds - held).sum(axis=-1)
        apart = np.asarray(
            gaussian_filter1d(apart, COVERAGE.kernel_smoothing, axis=-1, mode="nearest")
        )
        width = np.sort(apart, axis=0)[: min(COVERAGE.neighbours, len(apart))][-1].clip(
            1e-6, COVERAGE.kernel_width
        )
        weight = np.exp(-((apart / width) ** 2))
        weight = torch.from_numpy(weight / weight.sum(axis=0)).to(features)
        x.append((weight[..., None] * features).sum(dim=0))
    return torch.stack(x)


def order_by_side(features: Samples) -> Samples:
    """Return the samples in the order of the side from which they hold the object: neighbours are alike."""
    held = (features[..., 3 * LAYOUT.vectors :] > 0).any(dim=-1, keepdim=True)
    middle = features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).mean(dim=-2)
    side = (middle * held).sum(dim=-2)
    return features[torch.atan2(side[:, 1], side[:, 0]).argsort(stable=True)]


def hypothesis_count(samples: int, *, placed: bool = False) -> int:
    """Return how many hypotheses to sample where so many samples are kept.

    Args:
        samples: how many.
        placed: only hypotheses are kept that fit what is said of the person's place.
    """
    many = COVERAGE.most_hypotheses if placed else COVERAGE.hypotheses_per_sample * samples
    return max(samples, min(many, COVERAGE.most_hypotheses))


def k_medoids(
    palms: Float[np.ndarray, "hypotheses frames 2 3"], samples: int
) -> Int[np.ndarray, " samples"]:
    """Return the indices of the hypotheses to keep, the most central first (greedy k-medoids).

    Each one lowers most the sum, over all hypotheses, of the mean distance between the palms of a
    hypothesis and those of the nearest that is kept.

    Args:
        palms: metres, in any axes that all hypotheses share.
        samples: how many to keep.
    """
    apart = _pairwise_distance(palms)
    kept: list[int] = []
    nearest = np.full(len(palms), np.inf)
    for _ in range(samples):
        left = np.minimum(nearest, apart).sum(axis=1)
        left[kept] = np.inf
        kept.append(int(left.argmin()))
        nearest = np.minimum(nearest, apart[kept[-1]])
    return np.array(kept)


def _pairwise_distance(
    palms: Float[np.ndarray, "hypotheses frames 2 3"],
) -> Float[np.ndarray, "hypotheses hypotheses"]:
    """Return the mean distance between the palms of any two hypotheses, metres."""
    seen = palms[:, :: COVERAGE.stride]
    return np.stack([np.linalg.norm(seen - one, axis=-1).mean(axis=(1, 2)) for one in seen])


def _palms(features: Samples) -> Float[np.ndarray, "samples frames 2 3"]:
    return features[..., : 3 * LAYOUT.vectors].unflatten(-1, (2, 3)).double().numpy()
