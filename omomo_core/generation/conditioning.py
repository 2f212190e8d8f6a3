"""What is known of the person before sampling: contacts, place, first pose."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.contact.decode import HandChoice
from omomo_core.contact.segment import ContactSpan
from omomo_core.generation.generation_config import PREFIX
from omomo_core.generation.generation_options import FeaturePrefix, Prefix, SolvedPrefix
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.person import Retargeting
from omomo_core.generation.selection.person_constraint import PersonConstraint, SideWord
from omomo_core.generation.selection.plausibility import has_front
from omomo_core.generation.selection.selection_config import PERSON_CONSTRAINT
from omomo_core.generation.selection.start_constraint import (
    StartConstraint,
    StartPose,
    StartPosition,
)
from omomo_core.geometry.rotations import rotmat_to_6d
from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HandMotion
from omomo_core.stages import body_capture as body_stage


@dataclass(frozen=True)
class Pose:
    """Pose of a person in one frame, on the bones of the body that is asked for."""

    root: Float[np.ndarray, "3"]
    """Pelvis joint, world, metres."""
    rotations: Float[np.ndarray, "22 3 3"]
    """Global R_world_joint."""


@dataclass(frozen=True)
class PlaceInTime:
    """Place of a person on the floor of the world in one frame."""

    place: Float[np.ndarray, "2"]
    """Metres."""
    frame: int
    """Counted from the beginning of the take."""


@dataclass(frozen=True)
class Conditioning:
    """What is given to the generator instead of being sampled."""

    hands: HandMotion | None = None
    """Palms of every frame and which of them touch: stage 1 is left out."""
    start_pose: Pose | None = None
    """The pose of the first frame."""
    start_position: Float[np.ndarray, "2"] | None = None
    """Place where the person stands at first, about, on the floor of the world, metres."""
    end_position: Float[np.ndarray, "2"] | None = None
    """Place where the person stands in the last frame, about, on the floor of the world, metres."""
    side: SideWord | PlaceInTime | None = None
    """Side of the object on which the person is while they hold it: seen along the way that it goes, or a
    place on that side of it. It is heeded in the first chunk of a take, which those after it follow."""
    held_with: HandChoice | None = None
    """Which hands hold it; None leaves that to the networks."""
    contacts: Sequence[ContactSpan] | None = None
    """When each hand holds the object and where, in every sample."""

    @property
    def only_start_position(self) -> bool:
        """Whether the start position is all that is known of where the person is."""
        return self.start_position is not None and self.side is None and self.end_position is None


UNCONDITIONED = Conditioning()


def start_constraint(
    conditioning: Conditioning, prefix: Prefix | None, clip: ObjectClip
) -> StartConstraint | None:
    """Return the constraint on the palms of a take's first frame, if there is one.

    Args:
        conditioning: what is given.
        prefix: the first frame of a start pose, if one is given.
        clip: the object.
    """

    def stands(world: Float[np.ndarray, "2"]) -> Float[Tensor, "2"]:
        return torch.from_numpy(world * clip.scale - clip.trained.centre[0, :2]).float()

    if conditioning.start_pose is not None and prefix is not None and prefix.hands is not None:
        return StartPose(prefix.hands.values[0, 0], stands(conditioning.start_pose.root[:2]))
    if conditioning.start_position is None:
        return None
    return StartPosition(stands(conditioning.start_position))


def person_constraint(
    conditioning: Conditioning, clip: ObjectClip, *, last: bool
) -> PersonConstraint:
    """Return what is known of the person who holds the object, besides the start.

    Args:
        conditioning: what is given.
        clip: the object.
        last: the take ends with the clip.
    """
    end = conditioning.end_position
    return PersonConstraint(
        *_side_in(clip, conditioning.side),
        conditioning.held_with,
        None
        if end is None or not last
        else torch.from_numpy(end * clip.scale - clip.trained.centre[-1, :2]).float(),
    )


def _side_in(
    clip: ObjectClip, side: SideWord | PlaceInTime | None
) -> tuple[SideWord | Float[np.ndarray, "2"] | None, int]:
    """Return a side as a `PersonConstraint` of the take's first clip has it, and its frame.

    None where the clip does not show which side that is.
    """
    if isinstance(side, str):
        return (side if has_front(clip.take.velocity) else None), 0
    if side is None or side.frame >= clip.take.frames:
        return None, 0
    way = side.place - clip.take.centre[side.frame, :2]
    return (way if np.linalg.norm(way) > PERSON_CONSTRAINT.nearest_side else None), side.frame


def prefix_from_pose(
    pose: Pose, clip: ObjectClip, retargeting: Retargeting, samples: int
) -> tuple[Prefix, SolvedPrefix]:
    """Return the prefixes of one frame that a start pose makes, for each sample."""
    root, R = torch.from_numpy(pose.root).float(), torch.from_numpy(pose.rotations).float()
    palms = forward_kinematics(retargeting.body, root, R)[22:].double().numpy()

    def each(x: Tensor) -> Tensor:
        return x.expand(samples, 1, *x.shape)

    touching = clip.take.surface.tree.query(
        to_local(clip.take.motion.T_world_object[:1], palms[None])[0]
    )[0] < PREFIX.start_pose_touch  # fmt: skip
    relative = clip.above_soles(palms) * clip.scale - clip.trained.centre[0]
    hands = np.concatenate([relative.ravel(), np.where(touching, 1.0, -1.0)])
    # Whether the feet are planted is left to the network.
    vectors = 3 * body_stage.LAYOUT.vectors
    prefix = Prefix(
        hands=FeaturePrefix.all(each(torch.from_numpy(hands).float())),
        body=FeaturePrefix(
            each(_pose_features(root, R, retargeting)),
            torch.arange(body_stage.LAYOUT.channels) < vectors,
            PREFIX.start_pose_fade,
        ),
        palms=np.tile(palms, (samples, 1, 1, 1)),
        segments=[],
    )
    return prefix, SolvedPrefix(each(root), each(R), np.zeros((samples, 1, 2), bool))


def _pose_features(
    root: Float[Tensor, "3"], R: Float[Tensor, "22 3 3"], retargeting: Retargeting
) -> Float[Tensor, " channels"]:
    """Return stage 2's features of a pose, with the root in the networks' world."""
    moved, turned = retargeting.to_trained(root, R)
    joints = forward_kinematics(retargeting.trained, moved, turned)
    vectors = torch.cat([moved[None], joints[1:] - moved, rotmat_to_6d(turned).flatten(0, 1)])
    return torch.cat([vectors.flatten(), torch.zeros(body_stage.LAYOUT.scalars)])
