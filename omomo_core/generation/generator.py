"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body_stage import capture as body_stage
from omomo_core.capture import BASIS_POINTS, shape_code
from omomo_core.generation.overlap import sample_take
from omomo_core.generation.paper import generate_as_published
from omomo_core.generation.result import (
    Generation,
    GenerationOptions,
    Progress,
    Stages,
    notes_of,
)
from omomo_core.generation.scores import must_be_held, score
from omomo_core.generation.solve import solve_body
from omomo_core.generation.take import Take, object_windows, prepare, window_frames
from omomo_core.geometry.rotations import rotmat_from_6d
from omomo_core.hand_stage import capture as hand_stage
from omomo_core.hand_stage.contact_rule import constrain
from omomo_core.hand_stage.segments import hold
from omomo_core.motion import HandMotion, HumanMotion, ObjectMotion
from omomo_core.stage import Stage


def generate(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress,
) -> Generation:
    """Generate the people who could have moved the object.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: told what is being done.

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    scale = stages.height / body.height
    take, trained = prepare(motion), prepare(_scaled(motion, scale))
    generator = torch.Generator().manual_seed(options.seed)
    moving = must_be_held(take)
    predicted = _sample_hands(trained, stages.hands, options, generator, progress)
    hands = [_apply_contact(_resized(h, 1 / scale), take, moving, options) for h in predicted]
    people = _sample_body(trained, hands, scale, body, stages.body, options, generator, progress)
    scores = tuple(score(human, take, miss, moving) for human, miss in people)
    chosen = int(np.argmin([s["total"] for s in scores]))
    return Generation(tuple(h for h, _ in people), chosen, scores, notes_of(scores[chosen]))


def _sample_hands(
    take: Take,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
) -> list[HandMotion]:
    index = window_frames(take.frames)
    windows = object_windows(take, index, options.samples, BASIS_POINTS)
    yaw = hand_stage.canonical_yaw(windows)
    x = sample_take(
        stage,
        hand_stage.condition(windows, yaw),
        shape_code(windows, yaw),
        windows.valid,
        yaw,
        hand_stage.LAYOUT,
        index,
        generator,
        frames=take.frames,
        sampler=options.sampler,
        steps=options.steps,
        on_step=lambda done: progress("hands", done),
    )
    centre = torch.from_numpy(take.centre).float().expand(len(x), -1, 3)
    palms, contact = hand_stage.unpack(x, centre)
    return [
        HandMotion(palms=p.double().numpy(), contact=c.double().numpy())
        for p, c in zip(palms, contact, strict=True)
    ]


def _apply_contact(
    predicted: HandMotion,
    take: Take,
    moving: Bool[np.ndarray, " frames"],
    options: GenerationOptions,
) -> HandMotion:
    T = take.motion.T_world_object
    if options.contact == "paper":
        return constrain(predicted.palms, take.motion.mesh.vertices, T)
    held, _ = hold(predicted, take.surface, T, moving)
    return held


def _sample_body(
    take: Take,
    hands: list[HandMotion],
    scale: float,
    body: BodyModel,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
) -> list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]]:
    index = window_frames(take.frames)
    windows = object_windows(take, index, options.samples, BASIS_POINTS)
    palms = torch.from_numpy(np.stack([h.palms for h in hands])).float() * scale
    contact = torch.from_numpy(np.stack([h.contact for h in hands])).float()
    reference = body_stage.reference_path(palms)
    cut_palms = palms[:, index].flatten(0, 1)
    yaw = body_stage.canonical_yaw(cut_palms, windows)
    x = sample_take(
        stage,
        body_stage.condition(
            cut_palms,
            (contact[:, index].flatten(0, 1) > 0.5).float(),
            reference[:, index].flatten(0, 1),
            windows,
            yaw,
        ),
        shape_code(windows, yaw),
        windows.valid,
        yaw,
        body_stage.LAYOUT,
        index,
        generator,
        frames=take.frames,
        sampler=options.sampler,
        steps=options.steps,
        on_step=lambda done: progress("body", done),
    )
    people: list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]] = []
    for k in range(options.samples):
        people.append(_finish(x[k], reference[k], palms[k], contact[k], scale, body))
        progress("solve", (k + 1) / options.samples)
    return people


def _finish(
    x: Float[Tensor, "frames channels"],
    reference: Float[Tensor, "frames 2"],
    palms: Float[Tensor, "frames 2 3"],
    contact: Float[Tensor, "frames 2"],
    scale: float,
    body: BodyModel,
) -> tuple[HumanMotion, Float[np.ndarray, "frames 2"]]:
    # Patches of frames are decoded together; a light filter takes out what jumps between them.
    x = torch.from_numpy(gaussian_filter1d(x.numpy(), 1.0, axis=0, mode="nearest"))
    root, _, six, foot_contact = body_stage.unpack(x, reference)
    root, R, miss = solve_body(
        body, root / scale, rotmat_from_6d(six), foot_contact, palms / scale, contact
    )
    human = HumanMotion(
        root=root.double().numpy(),
        rotations=R.double().numpy(),
        fingers=body.relaxed_fingers.expand(len(root), 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, R).double().numpy(),
        hand_contact=contact.double().numpy(),
        foot_contact=foot_contact.double().numpy(),
    )
    return human, miss.double().numpy()


def _scaled(motion: ObjectMotion, scale: float) -> ObjectMotion:
    """The same scene for a person of another height: every length times `scale`."""
    T = motion.T_world_object.copy()
    T[:, :3, 3] *= scale
    mesh = replace(motion.mesh, vertices=motion.mesh.vertices * scale)
    return replace(motion, mesh=mesh, T_world_object=T)


def _resized(hands: HandMotion, scale: float) -> HandMotion:
    return replace(hands, palms=hands.palms * scale)
