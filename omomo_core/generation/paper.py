"""The published generator: one window of four seconds, no release, nothing solved afterwards.

Its networks see the object from where the person stands and faces in the first frame, which no phone
knows: each sample tries another place around the object, and the ranking picks.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.polish.depth import depth_inside
from omomo_core.body_stage import paper as body_stage
from omomo_core.contact.decode import decode
from omomo_core.contact.segment import follow
from omomo_core.diffusion.samplers import sample
from omomo_core.diffusion.schedule import cosine_schedule
from omomo_core.errors import InputError
from omomo_core.generation.person import Person
from omomo_core.generation.ranking import ranked
from omomo_core.generation.result import Generation, GenerationOptions, Progress, Stages
from omomo_core.generation.scene import Scene, Thing
from omomo_core.generation.take import object_windows, window_frames
from omomo_core.geometry.bps import PAPER_POINTS
from omomo_core.hand_stage import paper as hand_stage
from omomo_core.hand_stage.contact_rule import constrain
from omomo_core.motion import HandMotion, HumanMotion, ObjectMotion
from omomo_core.stage import Stage
from omomo_core.windows import WINDOW, ObjectWindows

STANDING_OFF = 0.35
"""Metres between the object's side and the person assumed to stand before it."""


def generate_as_published(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress,
) -> Generation:
    """OMOMO sections 3.3 and 3.4 on one window.

    Raises:
        InputError: the motion is longer than the model's window.
    """
    if len(motion.T_world_object) > WINDOW:
        raise InputError(
            "paper-too-long",
            f"The paper's model makes {WINDOW / 30:.0f} s of motion; "
            f"this one lasts {len(motion.T_world_object) / 30:.1f} s.",
            fix="Use the default configuration (--config capture), which has no limit.",
        )
    thing = Thing(motion.mesh, 1.0)
    scene = thing.scene(motion.T_world_object)
    window = _window(scene, options)
    generator = torch.Generator().manual_seed(options.seed)
    hands = _hands(window, stages.hands, options, generator, progress)
    humans = _people(window, hands, body, stages.body, options, generator, progress)
    people = tuple(
        _judged(human, hand, body, scene, thing) for human, hand in zip(humans, hands, strict=True)
    )
    return ranked(people, scene.must_hold)


def _judged(
    human: HumanMotion, hands: HandMotion, body: BodyModel, scene: Scene, thing: Thing
) -> Person:
    """Nothing is solved afterwards, but what is wrong is told all the same."""
    root, R, T = (
        torch.from_numpy(a) for a in (human.root, human.rotations, scene.take.motion.T_world_object)
    )
    miss = np.linalg.norm(human.joints[:, 22:] - hands.palms, axis=-1) * (hands.contact > 0.99)
    depth = depth_inside(body, root, R, T, thing.barrier)
    return Person(human, (), miss, depth.double().numpy())


@dataclass(frozen=True)
class _Window:
    """One window, once per sample, each seen from another place around the object."""

    scene: Scene
    object: ObjectWindows
    origin: Float[Tensor, "b 3"]
    yaw: Float[Tensor, " b"]


def _window(scene: Scene, options: GenerationOptions) -> _Window:
    """People stand around the object in its first frame and face it (-y in their own frame)."""
    take, count = scene.take, options.samples
    yaw = torch.arange(count) * (2 * math.pi / count)
    reach = float(np.linalg.norm(take.surface.points - take.surface.centre, axis=1).max())
    back = torch.stack([-yaw.sin(), yaw.cos(), torch.zeros(count)], dim=-1)
    centre = torch.from_numpy(take.centre[0] * [1, 1, 0]).float()
    windows = object_windows(take, window_frames(take.frames), count, PAPER_POINTS)
    return _Window(scene, windows, centre + (reach + STANDING_OFF) * back, yaw)


def _hands(
    window: _Window,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
) -> list[HandMotion]:
    """Stage 1 and the contact constraint."""
    x = _draw(
        stage,
        hand_stage.condition(window.object, window.origin, window.yaw),
        hand_stage.shape_code(window.object, window.yaw),
        window.object.valid,
        options,
        generator,
        lambda done: progress("hands", done),
    )
    palms = hand_stage.unpack(x, window.origin, window.yaw)[:, : window.scene.take.frames]
    return [_contact(p, window.scene, options) for p in palms.double().numpy()]


def _people(
    window: _Window,
    hands: list[HandMotion],
    body: BodyModel,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
) -> list[HumanMotion]:
    """Stage 2, from the constrained palms."""
    frames = window.scene.take.frames
    held = torch.from_numpy(np.stack([h.palms for h in hands])).float()
    held = held[:, torch.arange(WINDOW).clamp(max=frames - 1)]
    slots = slice(body_stage.POSITIONS - 6, body_stage.POSITIONS)
    wanted = torch.zeros(len(hands), WINDOW, body_stage.CHANNELS)
    wanted[..., slots] = hand_stage.pack(held, window.origin, window.yaw)
    x = _draw(
        stage,
        body_stage.condition(stage.normalise(wanted)[..., slots], generator),
        None,
        window.object.valid,
        options,
        generator,
        lambda done: progress("body", done),
    )
    joints, rotations = body_stage.unpack(x, window.origin, window.yaw)
    return [
        _person(joints[k, :frames, 0], rotations[k, :frames], hand, body)
        for k, hand in enumerate(hands)
    ]


def _draw(
    stage: Stage,
    condition: Tensor,
    shape: Tensor | None,
    valid: Bool[Tensor, "b frames"],
    options: GenerationOptions,
    generator: torch.Generator,
    on_step: Callable[[float], None],
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


def _contact(
    palms: Float[np.ndarray, "frames 2 3"], scene: Scene, options: GenerationOptions
) -> HandMotion:
    motion = scene.take.motion
    T = motion.T_world_object
    published = constrain(palms, motion.mesh.vertices, T)
    if options.contact == "paper":
        return published
    # Stage 1 as published has no contact channel: the rule's labels become the segments.
    labels = HandMotion(palms=palms, contact=published.contact)
    return follow(decode(labels, scene.take.surface, T, scene.must_hold), labels, T)


def _person(
    root: Float[Tensor, "frames 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    hands: HandMotion,
    body: BodyModel,
) -> HumanMotion:
    frames = len(root)
    return HumanMotion(
        root=root.double().numpy(),
        rotations=rotations.double().numpy(),
        fingers=body.relaxed_fingers.expand(frames, 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, rotations).double().numpy(),
        hand_contact=hands.contact,
        foot_contact=np.zeros((frames, 4)),
    )
