"""A recorded person, and every figure of a generated one beside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float

from omomo_core.body.kinematics import forward_kinematics, full_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import skin
from omomo_core.contact.support import must_be_held
from omomo_core.generation.selection.speed_limits import speed_excess
from omomo_core.geometry.object_features import object_features
from omomo_core.learning.evaluation.average import Row, mean_of
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.metrics import (
    contact_scores,
    foot_measures,
    joint_errors,
    onset_errors,
    root_orientation_errors,
    swing_measures,
    vertex_error,
)
from omomo_core.learning.evaluation.touch import Touching
from omomo_core.motion import HumanMotion


@dataclass(frozen=True)
class MeasuredSamples:
    """K people for one clip, measured."""

    one: Row
    """The sample that would be shown."""
    best: Row
    """The sample with the least MPJPE, every figure of it; and the best HandJPE of any sample."""
    mean: Row
    """What one sample without a choice is expected to give."""


@dataclass(frozen=True)
class Truth:
    """A recorded clip or window; what all comparisons with it need is measured once."""

    clip: RealClip

    @cached_property
    def touching(self) -> Touching:
        """The object."""
        return Touching(self.clip.motion)

    @cached_property
    def held(self) -> tuple[Bool[np.ndarray, "frames 2"], Bool[np.ndarray, "frames 2"]]:
        """Which recorded palms touch the surface, and which a vertex."""
        return self._held(self.clip.joints)

    @cached_property
    def must_hold(self) -> Bool[np.ndarray, " frames"]:
        """Frames in which somebody must hold the object, by its motion alone."""
        return must_be_held(object_features(self.clip.motion))

    @cached_property
    def vertices(self) -> Float[np.ndarray, "frames verts 3"]:
        """The recorded person's skin, world, metres."""
        return skin_of(recorded_person(self.clip, self.clip.body), self.clip.body)

    def answer(self, people: Sequence[HumanMotion], shown: int, body: BodyModel) -> MeasuredSamples:
        """Measure K people.

        Args:
            people: the samples, as long as the clip.
            shown: index of the sample that would be shown.
            body: their bones.
        """
        rows = [self.of_joints(human) for human in people]
        best = int(np.argmin([row["mpjpe_cm"] for row in rows]))
        mean = mean_of(rows)
        for k in {shown, best}:
            rows[k] |= self.of_skin(people[k], body)
        hand = min(row["hand_jpe_cm"] for row in rows)
        return MeasuredSamples(rows[shown], {**rows[best], "hand_jpe_best_cm": hand}, mean)

    def of_joints(self, human: HumanMotion) -> Row:
        """Every figure of one person that needs no surface of theirs.

        ``published_contact_...`` measure from palms to the object's vertices, as published.
        """
        found, true = self._held(human.joints), self.held
        published = contact_scores(found[1], true[1])
        return {
            **joint_errors(human.joints, self.clip.joints),
            **root_orientation_errors(human.rotations[:, 0], self.clip.rotations[:, 0]),
            **contact_scores(found[0], true[0]),
            **{f"published_{k}": v for k, v in published.items() if k.startswith("contact_")},
            **onset_errors(found[0], true[0]),
            **foot_measures(human.joints),
            **swing_measures(human.joints),
            "leaping_share": float(speed_excess(human) > 0),
        }

    def of_skin(self, human: HumanMotion, body: BodyModel) -> Row:
        """MPVPE and collisions. Fingers are as at rest: the recorded person's are not known."""
        vertices = skin_of(human, body)
        error = vertex_error(vertices, human.joints, self.vertices, self.clip.joints)
        return {
            "mpvpe_cm": error,
            **self.touching.collisions(vertices),
            **self.touching.penetration(human, body),
        }

    def _held(
        self, joints: Float[np.ndarray, "frames 24 3"]
    ) -> tuple[Bool[np.ndarray, "frames 2"], Bool[np.ndarray, "frames 2"]]:
        return self.touching.palms(joints[:, 22:]), self.touching.at_vertices(joints[:, 22:])


def skin_of(human: HumanMotion, body: BodyModel) -> Float[np.ndarray, "frames verts 3"]:
    """Every vertex of a person whose fingers are at rest, world, metres."""
    root, R = torch.from_numpy(human.root).float(), torch.from_numpy(human.rotations).float()
    fingers = body.relaxed_fingers.expand(len(root), 30, 3, 3)
    return skin(body, *full_kinematics(body, root, R, fingers)).numpy()


def recorded_person(clip: RealClip, body: BodyModel) -> HumanMotion:
    """The truth on a body, in the type that the generator returns."""
    root, R = torch.from_numpy(clip.root), torch.from_numpy(clip.rotations)
    frames = len(root)
    return HumanMotion(
        root=clip.root,
        rotations=clip.rotations,
        fingers=body.relaxed_fingers.expand(frames, 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, R).numpy(),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.zeros((frames, 4)),
    )
