"""Sampling stage 2: a whole body for each guess of the palms, solved to hold what they hold."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body_stage import capture as body_stage
from omomo_core.capture import BASIS_POINTS, shape_code
from omomo_core.generation.fit import Fit
from omomo_core.generation.known import Pose, body_pin, fade
from omomo_core.generation.overlap import sample_take
from omomo_core.generation.result import GenerationOptions, Progress
from omomo_core.generation.scene import Scene
from omomo_core.generation.solve import solve_body
from omomo_core.generation.take import object_windows, window_frames
from omomo_core.geometry.rotations import rotmat_from_6d, rotmat_to_6d, yaw_matrix
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stage import Stage


def sample_body(
    scene: Scene,
    hands: Sequence[HandMotion],
    fit: Fit,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    *,
    start: Pose | None = None,
    certain: bool = False,
) -> list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]]:
    """People whose palms are where `hands` says, one for each.

    Args:
        scene: the object.
        hands: palms and contact of each sample.
        fit: whose body, and that of the network.
        stage: the network.
        options: sampler and its steps.
        generator: source of randomness.
        progress: told how far it is.
        start: pose of the first frame, if known.
        certain: the palms are known: arms follow them in every frame, not only where they hold.

    Returns:
        Each person, and how far their palms miss where they should hold, metres.
    """
    contact = torch.from_numpy(np.stack([h.contact for h in hands])).float()
    x, reference = _sampled(scene, hands, contact, fit, stage, options, generator, progress, start)
    hold = torch.ones_like(contact) if certain else contact
    people: list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]] = []
    for k in range(len(hands)):
        hand = HandMotion(palms=hands[k].palms, contact=hold[k].double().numpy())
        human, miss = _finish(x[k], reference[k], hand, fit, start)
        people.append((replace(human, hand_contact=hands[k].contact), miss))
        progress("solve", (k + 1) / len(hands))
    return people


def _sampled(
    scene: Scene,
    hands: Sequence[HandMotion],
    contact: Float[Tensor, "samples frames 2"],
    fit: Fit,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    start: Pose | None,
) -> tuple[Float[Tensor, "samples frames channels"], Float[Tensor, "samples frames 2"]]:
    """What the network says of each person, and the path from which it says it."""
    index = window_frames(scene.trained.frames)
    windows = object_windows(scene.trained, index, len(hands), BASIS_POINTS)
    palms = torch.from_numpy(np.stack([h.palms for h in hands])).float() * scene.scale
    reference = body_stage.reference_path(palms)
    cut_palms = palms[:, index].flatten(0, 1)
    yaw = body_stage.canonical_yaw(cut_palms, windows)
    known = body_stage.condition(
        cut_palms,
        (contact[:, index].flatten(0, 1) > 0.5).float(),
        reference[:, index].flatten(0, 1),
        windows,
        yaw,
    )
    x = sample_take(
        stage,
        windows,
        known,
        shape_code(windows, yaw),
        yaw_matrix(yaw)[:, None],
        body_stage.LAYOUT,
        options,
        generator,
        frames=scene.trained.frames,
        pin=None if start is None else body_pin(start, reference[0, 0], fit),
        on_step=lambda done: progress("body", done),
    )
    return x, reference


def _finish(
    x: Float[Tensor, "frames channels"],
    reference: Float[Tensor, "frames 2"],
    hands: HandMotion,
    fit: Fit,
    start: Pose | None,
) -> tuple[HumanMotion, Float[np.ndarray, "frames 2"]]:
    # Patches of frames are decoded together; a light filter takes out what jumps between them.
    x = torch.from_numpy(gaussian_filter1d(x.numpy(), 1.0, axis=0, mode="nearest"))
    sampled, _, six, foot_contact = body_stage.unpack(x, reference)
    turned = rotmat_from_6d(six)
    palms, hold = (torch.from_numpy(a).float() for a in (hands.palms, hands.contact))
    placed = fit.to_body(sampled, turned[:, 0])
    solved = solve_body(fit.body, placed, turned, foot_contact, palms, hold)
    # Solving in single precision leaves rotations a little off; what goes out is exact.
    root, R = _begin_with(
        start, solved.root.double(), rotmat_from_6d(rotmat_to_6d(solved.rotations.double()))
    )
    human = HumanMotion(
        root=root.numpy(),
        rotations=R.numpy(),
        fingers=fit.body.relaxed_fingers.expand(len(root), 30, 3, 3).double().numpy(),
        joints=forward_kinematics(fit.body, root, R).numpy(),
        hand_contact=hands.contact,
        foot_contact=(foot_contact.double().numpy() * np.tile(solved.standing, 2)),
    )
    return human, solved.miss.double().numpy()


def _begin_with(
    start: Pose | None, root: Float[Tensor, "frames 3"], R: Float[Tensor, "frames 22 3 3"]
) -> tuple[Float[Tensor, "frames 3"], Float[Tensor, "frames 22 3 3"]]:
    """The first frame as given, if it is; what filter and solver changed in it fades out after it."""
    if start is None:
        return root, R
    weight = fade(len(root)).double()[:, None]
    step = roma.rotmat_to_rotvec(R[0].mT @ torch.from_numpy(start.rotations))
    turned = R @ roma.rotvec_to_rotmat(weight[..., None] * step)
    return root + weight * (torch.from_numpy(start.root) - root[0]), turned
