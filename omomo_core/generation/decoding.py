"""From stage 2's features to people: on the bones asked for, holding what they hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.grasp import grasp
from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import Scanned
from omomo_core.body.trajectory_optimization.penetration import depth_inside
from omomo_core.contact.segment import Segment
from omomo_core.generation.object_clip import Scene, Thing
from omomo_core.generation.pelvis_tilt import tilted
from omomo_core.generation.person import Person
from omomo_core.generation.prefix import Decided
from omomo_core.generation.retargeting import Fit
from omomo_core.generation.sampling.despiking import calmed
from omomo_core.generation.solving.bodies import Solved, solve_bodies
from omomo_core.generation.solving.wrists import facing
from omomo_core.generation.wish import Wish
from omomo_core.geometry.rotations import rotmat_from_6d, rotmat_to_6d
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.stages.body import capture as body_stage

ROOT_AND_JOINTS = 24
"""Vectors that stage 2's features begin with."""
ON_FLOOR = 0.05
"""Metres: an object that is no higher may be leant on."""


@dataclass(frozen=True)
class Sampled:
    """Stage 2's people, before they keep any promise."""

    root: Float[Tensor, "samples frames 3"]
    """Pelvis joint of the body asked for, world, metres."""
    rotations: Float[Tensor, "samples frames 22 3 3"]
    """Global R_world_joint."""
    foot_contact: Float[Tensor, "samples frames 4"]

    @staticmethod
    def of(features: Float[Tensor, "samples frames channels"], fit: Fit) -> "Sampled":
        """People of the features that `sample_body` gives, on the bones asked for."""
        # Patches of frames are decoded together; a light filter takes out what jumps between them.
        smooth = np.asarray(gaussian_filter1d(features.numpy(), 1.0, axis=1, mode="nearest"))
        calm = [calmed(smooth[k], ROOT_AND_JOINTS) for k in range(len(smooth))]
        x = torch.from_numpy(np.stack(calm))
        root, _, six, foot_contact = body_stage.unpack(x, torch.zeros(*x.shape[:2], 2))
        people = tilted(fit.trained, root, rotmat_from_6d(six))
        return Sampled(*fit.to_body(*people), foot_contact)


@torch.inference_mode()
def embody(
    sampled: Sampled,
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[Segment, ...]],
    scene: Scene,
    thing: Thing,
    body: BodyModel,
    decided: Decided | None,
    *,
    certain: bool,
    told: Callable[[float], None] = lambda done: None,
) -> tuple[list[Person], Solved]:
    """The sampled people, with their palms where `hands` says.

    Args:
        sampled: of stage 2.
        hands: palms and contact weights of each sample.
        segments: what they hold.
        scene: where the object is.
        thing: the object.
        body: whose bones.
        decided: the first frames, which stay as they are.
        certain: the palms are known: arms follow them in every frame, not only where they hold.
        told: how far this is.
    """
    R = sampled.rotations
    wish = wish_of(R, hands, segments, scene, thing, certain=certain)
    solved = solve_bodies(body, sampled.root, R, sampled.foot_contact, wish, decided, told=told)
    T, planted = scene.take.motion.T_world_object, sampled.foot_contact.double().numpy()
    people = exact_people(body, solved, planted, hands, segments, T, thing.barrier)
    return people, solved


def wish_of(
    R: Float[Tensor, "samples frames 22 3 3"],
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[Segment, ...]],
    scene: Scene,
    thing: Thing,
    *,
    certain: bool = False,
) -> Wish:
    """What sampled people are solved for.

    Args:
        R: sampled global rotations.
        hands: palms and contact weights of each sample.
        segments: what they hold.
        scene: where the object is.
        thing: the object.
        certain: arms follow the palms in every frame, not only where they hold.
    """
    T = scene.take.motion.T_world_object
    contact = torch.from_numpy(np.stack([h.contact for h in hands])).float()
    wrists = [facing(R[k][:, WRISTS], held, thing.surface, T) for k, held in enumerate(segments)]
    return Wish(
        palms=torch.from_numpy(np.stack([h.palms for h in hands])).float(),
        hold=torch.ones_like(contact) if certain else contact,
        R_world_wrist=torch.stack(wrists),
        T_world_object=T,
        barrier=thing.barrier,
        balance=balance(scene),
    )


def exact_people(
    body: BodyModel,
    solved: Solved,
    foot_contact: Float[np.ndarray, "samples frames 4"],
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[Segment, ...]],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    barrier: Scanned,
) -> list[Person]:
    """The samples that were solved, with fingers that close and what is wrong with them."""
    # Solving in single precision leaves rotations a little off; what goes out is exact.
    root = solved.root.double()
    R = rotmat_from_6d(rotmat_to_6d(solved.rotations.double()))
    contact = np.stack([h.contact for h in hands])
    T, weight = torch.from_numpy(T_world_object), torch.from_numpy(contact)
    joints = forward_kinematics(body, root, R)
    closed = grasp(body, R[..., WRISTS, :, :], joints[..., WRISTS, :], T, barrier.field, weight)
    depth = depth_inside(body, root, R, T, barrier).double().numpy()
    fingers, standing = closed.fingers.double(), np.tile(solved.standing, 2)
    return [
        Person(
            HumanMotion(
                root=root[k].numpy(),
                rotations=R[k].numpy(),
                fingers=fingers[k].numpy(),
                joints=joints[k].numpy(),
                hand_contact=hands[k].contact,
                foot_contact=foot_contact[k] * standing[k],
            ),
            segments[k],
            solved.miss[k].double().numpy(),
            depth[k],
        )
        for k in range(len(hands))
    ]


def balance(scene: Scene) -> Float[np.ndarray, " frames"]:
    """1 where the weight must be over the feet, 0 where the object may be leant on."""
    leaning = (scene.take.lowest < ON_FLOOR) & scene.must_hold
    return 1.0 - gaussian_filter1d(leaning.astype(float), 5.0, mode="nearest")
