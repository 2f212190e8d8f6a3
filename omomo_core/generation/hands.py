"""Sampling stage 1: K guesses of where the palms are, put on the object where they touch it."""

import torch

from omomo_core.capture import BASIS_POINTS
from omomo_core.generation.known import Pin
from omomo_core.generation.overlap import sample_take
from omomo_core.generation.result import GenerationOptions, Progress
from omomo_core.generation.scene import Scene
from omomo_core.generation.take import object_windows, window_frames
from omomo_core.hand_stage import capture as hand_stage
from omomo_core.hand_stage.contact_rule import constrain
from omomo_core.hand_stage.segments import hold
from omomo_core.motion import HandMotion
from omomo_core.stage import Stage


def sample_hands(
    scene: Scene,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    pin: Pin | None = None,
) -> list[HandMotion]:
    """Palms (world, metres) and contact weights of each sample, contacts applied."""
    index = window_frames(scene.trained.frames)
    windows = object_windows(scene.trained, index, options.samples, BASIS_POINTS)
    yaw = hand_stage.canonical_yaw(windows)
    axes = hand_stage.object_axes(windows, yaw)
    x = sample_take(
        stage,
        windows,
        hand_stage.condition(windows, yaw, axes),
        hand_stage.shape_code(windows, axes),
        axes,
        hand_stage.LAYOUT,
        options,
        generator,
        frames=scene.trained.frames,
        pin=pin,
        on_step=lambda done: progress("hands", done),
    )
    centre = torch.from_numpy(scene.trained.centre).float().expand(len(x), -1, 3)
    palms, contact = hand_stage.unpack(x, centre)
    predicted = [
        HandMotion(palms=p.double().numpy() / scene.scale, contact=c.double().numpy())
        for p, c in zip(palms, contact, strict=True)
    ]
    return [_in_contact(hands, scene, options) for hands in predicted]


def _in_contact(predicted: HandMotion, scene: Scene, options: GenerationOptions) -> HandMotion:
    motion = scene.take.motion
    if options.contact == "paper":
        return constrain(predicted.palms, motion.mesh.vertices, motion.T_world_object)
    return hold(predicted, scene.take.surface, motion.T_world_object, scene.moving)[0]
