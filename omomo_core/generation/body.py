"""Sampling stage 2: a whole body for each guess of the palms, solved to hold what they hold."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body_stage import capture as body_stage
from omomo_core.capture import BASIS_POINTS
from omomo_core.generation.overlap import sample_take
from omomo_core.generation.result import GenerationOptions, Progress
from omomo_core.generation.scene import Scene
from omomo_core.generation.solve import solve_body
from omomo_core.generation.take import object_windows, window_frames
from omomo_core.geometry.rotations import rotmat_from_6d, rotmat_to_6d
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stage import Stage


def sample_body(
    scene: Scene,
    hands: Sequence[HandMotion],
    body: BodyModel,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
) -> list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]]:
    """People whose palms are where `hands` says, one for each.

    Returns:
        Each person, and how far their palms miss where they should hold, metres.
    """
    index = window_frames(scene.trained.frames)
    windows = object_windows(scene.trained, index, len(hands), BASIS_POINTS)
    palms = torch.from_numpy(np.stack([h.palms for h in hands])).float() * scene.scale
    contact = torch.from_numpy(np.stack([h.contact for h in hands])).float()
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
        yaw,
        body_stage.LAYOUT,
        options,
        generator,
        frames=scene.trained.frames,
        on_step=lambda done: progress("body", done),
    )
    people: list[tuple[HumanMotion, Float[np.ndarray, "frames 2"]]] = []
    for k in range(len(hands)):
        people.append(_finish(x[k], reference[k], palms[k], contact[k], scene.scale, body))
        progress("solve", (k + 1) / len(hands))
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
    solved = solve_body(
        body, root / scale, rotmat_from_6d(six), foot_contact, palms / scale, contact
    )
    # Solving in single precision leaves rotations a little off; what goes out is exact.
    root, R = solved.root.double(), rotmat_from_6d(rotmat_to_6d(solved.rotations.double()))
    human = HumanMotion(
        root=root.numpy(),
        rotations=R.numpy(),
        fingers=body.relaxed_fingers.expand(len(root), 30, 3, 3).double().numpy(),
        joints=forward_kinematics(body, root, R).numpy(),
        hand_contact=contact.double().numpy(),
        foot_contact=(foot_contact.double().numpy() * np.tile(solved.standing, 2)),
    )
    return human, solved.miss.double().numpy()
