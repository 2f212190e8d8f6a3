"""The paper's pipeline: both published networks, sampled and constrained as published.

Its networks see the object in the frame of the person in the first frame, which no phone knows. So each
sample stands at another place around the object, and the ranking chooses.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import penetration_depth
from omomo_core.contact.decode import decode
from omomo_core.contact.segment import follow_anchors
from omomo_core.diffusion.samplers import cosine_schedule, sample
from omomo_core.errors import InputError
from omomo_core.generation.conditioning import Pose
from omomo_core.generation.generation_config import PUBLISHED
from omomo_core.generation.generation_options import Generation, GenerationOptions, Progress
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.selection.ranking import rank
from omomo_core.generation.solving.solving_config import BODY_SOLVING
from omomo_core.geometry.object_features import PAPER_POINTS, ObjectFeatures
from omomo_core.geometry.rotations import human_frame
from omomo_core.motion import HandMotion, HumanMotion, ObjectMotion
from omomo_core.stages import body_paper as body_stage
from omomo_core.stages import hands_paper as hand_stage
from omomo_core.stages.hands_paper import constrain
from omomo_core.stages.stage import (
    WINDOW,
    ObjectWindows,
    Stage,
    Stages,
    object_windows,
    window_frames,
)

OnProgress = Callable[[float], None]
"""Progress callback: fraction done."""


@dataclass(frozen=True)
class PersonView:
    """One window of the object for each sample, each in a person's frame of its own (`human_frame`)."""

    take: ObjectFeatures
    object: ObjectWindows
    origin: Float[Tensor, "b 3"]
    yaw: Float[Tensor, " b"]


def views_around(take: ObjectFeatures, count: int) -> PersonView:
    """Return views of people who stand around the object in its first frame and face it (their -y)."""
    yaw = torch.arange(count) * (2 * math.pi / count)
    reach = float(np.linalg.norm(take.surface.points - take.surface.centre, axis=1).max())
    back = torch.stack([-yaw.sin(), yaw.cos(), torch.zeros(count)], dim=-1)
    centre = torch.from_numpy(take.centre[0] * [1, 1, 0]).float()
    return _person_view(take, centre + (reach + PUBLISHED.standing_distance) * back, yaw)


def views_from_pose(take: ObjectFeatures, pose: Pose, count: int) -> PersonView:
    """Return views of people who all stand where the pose of the first frame does."""
    root, R = torch.from_numpy(pose.root)[None], torch.from_numpy(pose.rotations)[None, 0]
    origin, yaw = human_frame(root.float(), R.float())
    return _person_view(take, origin.expand(count, 3), yaw.expand(count))


def sample_palms(
    view: PersonView,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    on_step: OnProgress,
) -> Float[np.ndarray, "samples frames 2 3"]:
    """Return the palms that the first network samples, without a contact rule; world, metres."""
    x = _sample(stage, *_object_inputs(view, stage), view.object.valid, options, generator, on_step)
    palms = hand_stage.unpack(x, view.origin, view.yaw)
    return palms[:, : view.take.frames].double().numpy()


def bodies_from_palms(
    view: PersonView,
    hands: Sequence[HandMotion],
    body: BodyModel,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    on_step: OnProgress,
) -> list[HumanMotion]:
    """Return the people that the second network samples, one for the hands of each view."""
    held = torch.from_numpy(np.stack([h.palms for h in hands])).float()
    held = held[:, torch.arange(WINDOW).clamp(max=view.take.frames - 1)]
    wanted = torch.zeros(len(hands), WINDOW, body_stage.CHANNELS)
    wanted[..., body_stage.PALMS] = hand_stage.pack(held, view.origin, view.yaw)
    condition = body_stage.condition(stage.normalise(wanted)[..., body_stage.PALMS], generator)
    x = _sample(stage, condition, None, view.object.valid, options, generator, on_step)
    return _people(view, x, body, [h.contact for h in hands])


def bodies_from_object(
    view: PersonView,
    body: BodyModel,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    on_step: OnProgress,
) -> list[HumanMotion]:
    """Return the people of the network that is conditioned on no palms (`single_stage_config`)."""
    x = _sample(stage, *_object_inputs(view, stage), view.object.valid, options, generator, on_step)
    return _people(view, x, body, [np.zeros((view.take.frames, 2))] * len(x))


def _person_view(
    take: ObjectFeatures, origin: Float[Tensor, "b 3"], yaw: Float[Tensor, " b"]
) -> PersonView:
    windows = object_windows(take, window_frames(take.frames), len(yaw), PAPER_POINTS)
    return PersonView(take, windows, origin, yaw)


def _object_inputs(view: PersonView, stage: Stage) -> tuple[Tensor, Tensor]:
    """Return the condition and the shape code of the object in each view."""
    code = hand_stage.shape_code(view.object, view.yaw, stage.config.denoiser.patch)
    return hand_stage.condition(view.object, view.origin, view.yaw), code


def _sample(
    stage: Stage,
    condition: Tensor,
    shape: Tensor | None,
    valid: Bool[Tensor, "b frames"],
    options: GenerationOptions,
    generator: torch.Generator,
    on_step: OnProgress,
) -> Float[Tensor, "b frames channels"]:
    noise = torch.randn(len(condition), WINDOW, stage.config.denoiser.channels, generator=generator)

    def predict(x: Tensor, n: int) -> Tensor:
        return stage(x, condition, shape, torch.full((len(x),), n), valid)

    with torch.inference_mode():
        x = sample(
            predict,
            noise,
            cosine_schedule(),
            generator,
            sampler=options.sampler,
            steps=options.steps,
            on_step=on_step,
        )
        return stage.denormalise(x)


def _people(
    view: PersonView,
    x: Float[Tensor, "b window 204"],
    body: BodyModel,
    contact: Sequence[Float[np.ndarray, "frames 2"]],
) -> list[HumanMotion]:
    """Return people by their sampled root and rotations; the other joints follow from them, as published."""
    joints, rotations = body_stage.unpack(x[:, : view.take.frames], view.origin, view.yaw)
    return [
        human_motion(root, R, body, c)
        for root, R, c in zip(joints[:, :, 0], rotations, contact, strict=True)
    ]


def human_motion(
    root: Float[Tensor, "frames 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    body: BodyModel,
    contact: Float[np.ndarray, "frames 2"],
) -> HumanMotion:
    """Return a motion on the bones of a body, with relaxed fingers and no foot contacts."""
    frames = len(root)
    return HumanMotion(
        root=root.double().numpy(),
        rotations=rotations.double().numpy(),
        fingers=body.relaxed_fingers.expand(frames, 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, rotations).double().numpy(),
        hand_contact=contact,
        foot_contact=np.zeros((frames, 4)),
    )


def generate_as_published(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress,
) -> Generation:
    """Return samples of the published model for one window, ranked (OMOMO sections 3.3 and 3.4).

    Raises:
        InputError: the motion is longer than the model's window.
    """
    if len(motion.T_world_object) > WINDOW:
        raise InputError(
            "paper-too-long",
            f"The paper's model makes {WINDOW / 30:.0f} s of motion; "
            f"this one lasts {len(motion.T_world_object) / 30:.1f} s.",
            fix="Use the default configuration (‹configuration› capture), which has no limit.",
        )
    object_model = ObjectModel(motion.mesh, 1.0)
    clip = object_model.clip(motion.T_world_object)
    view = views_around(clip.take, options.samples)
    generator = torch.Generator().manual_seed(options.seed)
    palms = sample_palms(
        view, stages.hands, options, generator, lambda done: progress("hands", done)
    )
    hands = [_contact(p, clip, options) for p in palms]
    humans = bodies_from_palms(
        view, hands, body, stages.body, options, generator, lambda done: progress("body", done)
    )
    people = tuple(
        _judged(human, hand, body, clip, object_model)
        for human, hand in zip(humans, hands, strict=True)
    )
    return rank(people, clip.must_hold)


def _judged(
    human: HumanMotion,
    hands: HandMotion,
    body: BodyModel,
    clip: ObjectClip,
    object_model: ObjectModel,
) -> Person:
    """Return a person with palm misses and penetration depths, although nothing is solved here."""
    root, R, T = (
        torch.from_numpy(a) for a in (human.root, human.rotations, clip.take.motion.T_world_object)
    )
    miss = np.linalg.norm(human.joints[:, 22:] - hands.palms, axis=-1) * (
        hands.contact > BODY_SOLVING.full_hold
    )
    depth = penetration_depth(body, root, R, T, object_model.obstacle)
    return Person(human, (), miss, depth.double().numpy())


def _contact(
    palms: Float[np.ndarray, "frames 2 3"], clip: ObjectClip, options: GenerationOptions
) -> HandMotion:
    motion = clip.take.motion
    T = motion.T_world_object
    published = constrain(palms, motion.mesh.vertices, T)
    if options.contact == "paper":
        return published
    # Stage 1 as published has no contact channel: the rule's labels become the segments.
    labels = HandMotion(palms=palms, contact=published.contact)
    surface = clip.take.surface
    return follow_anchors(decode(labels, surface, T, clip.must_hold), labels, T, surface)
