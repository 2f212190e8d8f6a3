"""A generated person, and the scene scaled to another stature."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.generation.generation_config import RETARGETING
from omomo_core.long_arrays import GrowingArray
from omomo_core.motion import HumanMotion
from omomo_core.skeleton import joint


@dataclass(frozen=True)
class FingerFit:
    """How the fingers of both hands (left, right) lie on the object."""

    depth: Float[np.ndarray, "frames 2"]
    """Depth of the deepest finger or palm in the object, metres."""
    pad_distance: Float[np.ndarray, "frames 2"]
    """Distance from the surface to the third nearest fingertip of a hand that holds, metres; else 0."""
    grip: Int[np.ndarray, "frames 2"]
    """Number of each hand's grip in `GRIPS`; 0 where it is free."""


@dataclass(frozen=True)
class Person:
    """A sample, or a stretch of frames of one."""

    human: HumanMotion
    segments: tuple[ContactSegment, ...]
    """What each hand holds and when; empty where palms are given or follow the published rule."""
    miss: Float[np.ndarray, "frames 2"]
    """Distance of each palm from its target where it should hold, metres; 0 elsewhere."""
    depth: Float[np.ndarray, " frames"]
    """Penetration depth of trunk, arms and legs, metres."""
    finger_fit: FingerFit | None = None
    """None where it was not measured."""


def stretch(person: Person, start: int, stop: int) -> Person:
    """Return frames `start` .. `stop` of a person; segments are cut to them."""
    human = HumanMotion(
        **{f.name: getattr(person.human, f.name)[start:stop] for f in fields(HumanMotion)}
    )
    return Person(
        human,
        shift_spans(person.segments, start, stop),
        person.miss[start:stop],
        person.depth[start:stop],
        None
        if person.finger_fit is None
        else FingerFit(
            **{f.name: getattr(person.finger_fit, f.name)[start:stop] for f in fields(FingerFit)}
        ),
    )


_S = TypeVar("_S", bound=ContactSpan)


def shift_spans(segments: Sequence[_S], start: int, stop: int) -> tuple[_S, ...]:
    """Return spans counted from frame `start` and cut to `start` .. `stop`."""
    cut = [
        replace(s, start=max(s.start, start) - start, stop=min(s.stop, stop) - start)
        for s in segments
    ]
    return tuple(s for s in cut if s.start < s.stop)


class GrowingPerson:
    """A person whose stretches are added in the order of time."""

    def __init__(self, folder: Path | None = None) -> None:
        """Begin without frames.

        Args:
            folder: where the arrays grow in files; None for memory.
        """
        self._arrays: defaultdict[str, GrowingArray] = defaultdict(lambda: GrowingArray(folder))
        self._segments: list[ContactSegment] = []
        self._frames = 0
        self._fitted = True

    def add(self, part: Person) -> None:
        """Add a stretch; a segment that was cut between it and the one before is one again."""
        human, fit = part.human, part.finger_fit
        arrays = {f.name: getattr(human, f.name) for f in fields(HumanMotion)}
        arrays |= {"miss": part.miss, "depth": part.depth}
        if fit is not None:
            arrays |= {
                "finger_depth": fit.depth,
                "pad_distance": fit.pad_distance,
                "grip": fit.grip,
            }
        for name, rows in arrays.items():
            self._arrays[name].add(rows)
        for s in part.segments:
            moved = replace(s, start=s.start + self._frames, stop=s.stop + self._frames)
            _append(self._segments, moved)
        self._frames += len(part.miss)
        self._fitted &= part.finger_fit is not None

    def whole(self) -> Person:
        """Return the person with all frames; nothing is added afterwards."""
        arrays = {name: array.whole() for name, array in self._arrays.items()}
        human = HumanMotion(**{f.name: arrays[f.name] for f in fields(HumanMotion)})
        fit = None
        if self._fitted:
            fit = FingerFit(arrays["finger_depth"], arrays["pad_distance"], arrays["grip"])
        segments = tuple(sorted(self._segments, key=lambda s: (s.start, s.hand)))
        return Person(human, segments, arrays["miss"], arrays["depth"], fit)


def join(parts: Iterable[Person], folder: Path | None = None) -> Person:
    """Return consecutive stretches as one person, whose arrays are in files of a folder if one is given."""
    person = GrowingPerson(folder)
    for part in parts:
        person.add(part)
    return person.whole()


def _append(segments: list[ContactSegment], new: ContactSegment) -> None:
    for k, old in enumerate(segments):
        same = old.hand == new.hand and old.stop == new.start
        if same and np.array_equal(old.anchor, new.anchor):
            segments[k] = replace(old, stop=new.stop)
            return
    segments.append(new)


_LEGS: dict[LimbName, tuple[int, int]] = {
    "left_leg": (joint("left_knee"), joint("left_ankle")),
    "right_leg": (joint("right_knee"), joint("right_ankle")),
}
_LEG_JOINTS = [joint(f"{s}_{part}") for s in ("left", "right") for part in ("hip", "knee", "ankle")]


@dataclass(frozen=True)
class Retargeting:
    """Maps poses between two bodies: hips and feet keep their places, and knees point to where they were.

    Horizontal distances scale with the stature, heights with the height of the hips. So a body that differs
    in stature only moves as the same scene scaled; one whose pelvis joint lies elsewhere above its hips, or
    whose legs are long for its stature, still stands on the floor; and one whose hip joints lie closer
    together stands as wide. A body in shoes is higher by their soles.
    """

    trained: BodyModel
    body: BodyModel

    @property
    def scale(self) -> float:
        """Stature of the trained body over that of the other."""
        return self.trained.height / self.body.height

    def to_body(
        self, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        """Return the body's pelvis joint (world, metres) and global rotations from the trained body's."""
        return self._carried(self.trained, self.body, root, rotations, 1 / self._size().to(root))

    def to_trained(
        self, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        """Inverse of `to_body`."""
        return self._carried(self.body, self.trained, root, rotations, self._size().to(root))

    def _carried(
        self,
        old: BodyModel,
        new: BodyModel,
        root: Float[Tensor, "*b 3"],
        rotations: Float[Tensor, "*b 22 3 3"],
        size: Float[Tensor, "3"],
    ) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
        pelvis = rotations[..., 0, :, :]
        lowered, raised = (torch.tensor([0.0, 0.0, b.shoe_sole]).to(root) for b in (old, new))
        hips = (root + pelvis @ old.hips.to(root) - lowered) * size + raised
        moved = hips - pelvis @ new.hips.to(root)
        if self._legs_alike:
            return moved, rotations
        places = (forward_kinematics(old, root, rotations) - lowered) * size + raised
        for leg, (knee, ankle) in _LEGS.items():
            pole = places[..., knee, :] - places[..., ankle, :]
            rotations, _ = reach(new, moved, rotations, leg, places[..., ankle, :], pole)
        return moved, rotations

    @cached_property
    def _legs_alike(self) -> bool:
        apart = (self.body.rest_joints * self.scale - self.trained.rest_joints)[_LEG_JOINTS]
        return bool((apart - apart[0]).abs().max() < RETARGETING.equal_legs)

    def _size(self) -> Float[Tensor, "3"]:
        heights = [
            float(b.rest_joints[[1, 2], 1].mean()) - b.shoe_sole for b in (self.trained, self.body)
        ]
        return torch.tensor([self.scale, self.scale, heights[0] / heights[1]])
