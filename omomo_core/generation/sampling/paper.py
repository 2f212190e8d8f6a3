"""Sampling of the paper's networks: one window of four seconds, in the frame of the person."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.diffusion.samplers import sample
from omomo_core.diffusion.schedule import cosine_schedule
from omomo_core.generation.conditioning import Pose
from omomo_core.generation.config import PUBLISHED
from omomo_core.generation.result import GenerationOptions
from omomo_core.geometry.bps import PAPER_POINTS
from omomo_core.geometry.human_frame import human_frame
from omomo_core.geometry.object_features import ObjectFeatures
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stages.body import paper as body_stage
from omomo_core.stages.hands import paper as hand_stage
from omomo_core.stages.stage import Stage
from omomo_core.stages.windows import WINDOW, ObjectWindows, object_windows, window_frames

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
