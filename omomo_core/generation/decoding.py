"""From sampled features to palms, contacts and wrists without spikes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.grasp import close_fingers
from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets, penetration_depth
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.avoidance import ELBOWS
from omomo_core.generation.generation_config import BODY_DECODING, DESPIKING
from omomo_core.generation.generation_options import SolvedPrefix, fade, free_after
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import FingerFit, Person, Retargeting
from omomo_core.generation.solving.bodies import SolvedBodies, solve_bodies
from omomo_core.generation.solving.free_hands import lead_hands_out
from omomo_core.generation.solving.palm_plan import (
    ARMS,
    find_holds,
    raise_palms,
    share_twist,
    turn_palms,
)
from omomo_core.generation.solving.solving_config import BODY_SOLVING, WRIST
from omomo_core.generation.solving.steady_limbs import steady_limbs
from omomo_core.geometry.rotations import rotmat_from_6d, rotmat_to_6d
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.geometry.surface import Surface
from omomo_core.motion import HandMotion, HumanMotion
from omomo_core.skeleton import PALM_JOINTS, joint
from omomo_core.stages import body_capture as body_stage


def despike(
    x: Float[np.ndarray, "frames channels"], points: int
) -> Float[np.ndarray, "frames channels"]:
    """Return the features smoothed over time around frames in which a point moves too fast.

    Args:
        x: any features that may be averaged over time.
        points: how many 3-vectors at the beginning of a row are positions, metres, whose speed counts.
    """
    for _ in range(DESPIKING.rounds):
        way = np.diff(x[:, : 3 * points], axis=0, append=x[-1:, : 3 * points])
        quick = (
            np.linalg.norm(way.reshape(len(x), points, 3), axis=-1).max(axis=1) > DESPIKING.fastest
        )
        if not quick.any():
            break
        near = maximum_filter1d(quick.astype(float), round(4 * DESPIKING.width))
        weight = gaussian_filter1d(near, DESPIKING.width).astype(x.dtype)[:, None]
        x = x + weight * (gaussian_filter1d(x, DESPIKING.width, axis=0, mode="nearest") - x)
    return x


def lay_palms(
    body: BodyModel,
    solved: SolvedBodies,
    targets: InteractionTargets,
    segments: Sequence[tuple[ContactSegment, ...]],
    free: Float[Tensor, " frames"],
) -> SolvedBodies:
    """Return bodies whose palms lie on what they hold, wrists within their range.

    Args:
        body: whose hands.
        solved: palms on their targets.
        targets: what they are solved for.
        segments: what each hand holds and when.
        free: how far each frame may be changed, from 0 to 1.
    """
    if not any(segments):
        return solved
    root, rotations = solved.root, solved.rotations.clone()
    field, T = targets.obstacle.field, targets.T_world_object
    joints = forward_kinematics(body, root, rotations).float()
    palms = joints[..., 22:, :]
    for k, held in enumerate(segments):
        holds = list(find_holds(joints[k], rotations[k].float(), held, T, field, free))
        turn = turn_palms(body, rotations[k][:, WRISTS].float(), holds, T, field)
        planned = roma.rotvec_to_rotmat(turn) @ rotations[k][:, WRISTS].float()
        wrists = _from_fixed(planned, rotations[k][:, WRISTS].float(), free)
        at = palms[k] - (wrists @ _hands(body)[..., None])[..., 0]
        rise = raise_palms(body, at, wrists, holds, T, field)
        palms[k] += free[:, None, None] * rise
        rotations[k][:, WRISTS] = wrists.to(rotations)
    for side in range(2):
        goal = palms[..., side, :].to(rotations)
        rotations, _ = reach(body, root, rotations, ARMS[side], goal, gently=True)
    twist = roma.rotmat_to_rotvec(share_twist(rotations[:, :, ELBOWS], rotations[:, :, WRISTS]))
    rotations[:, :, ELBOWS] = rotations[:, :, ELBOWS] @ roma.rotvec_to_rotmat(
        free[:, None, None] * twist
    )
    fixed = (free == 0)[:, None, None, None]
    rotations = torch.where(fixed, solved.rotations, rotations)
    miss = (forward_kinematics(body, root, rotations)[..., 22:, :] - targets.palms).norm(dim=-1)
    held = targets.hold > BODY_SOLVING.full_hold
    return replace(solved, rotations=rotations, miss=torch.where(held, miss, 0.0))


def _from_fixed(
    planned: Float[Tensor, "frames 2 3 3"],
    present: Float[Tensor, "frames 2 3 3"],
    free: Float[Tensor, " frames"],
) -> Float[Tensor, "frames 2 3 3"]:
    """Return planned rotations of wrists that are the present ones where frames are fixed.

    What differs at the last fixed frame, or at the least free one, fades out after it about one axis.
    """
    out = planned.clone()
    for start, stop in runs(free.numpy() < 1):
        frames = np.arange(start, stop)
        least = frames[free[start:stop].numpy() == float(free[start:stop].min())]
        edge = least[np.abs(frames[:, None] - least).argmin(axis=1)]
        apart = roma.rotmat_to_rotvec(planned[edge].mT @ present[edge])
        fading = (1 - free[start:stop])[:, None, None] * apart
        out[start:stop] = planned[start:stop] @ roma.rotvec_to_rotmat(fading)
    return torch.where((free == 0)[:, None, None, None], present, out)


def _hands(body: BodyModel) -> Float[Tensor, "2 3"]:
    """Return the way from each wrist to its palm joint, at rest, metres."""
    rest = body.rest_joints.float()
    return rest[list(PALM_JOINTS)] - rest[list(WRISTS)]


def face_palms(
    R_world_wrist: Float[Tensor, "frames 2 3 3"],
    segments: Sequence[ContactSegment],
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
) -> Float[Tensor, "frames 2 3 3"]:
    """Return R_world_wrist turned by as little as brings each palm to face the surface at its anchor.

    Args:
        R_world_wrist: of the sample; the palm looks along -y at rest.
        segments: what each hand holds and when.
        surface: of the object, its frame.
        T_world_object: its pose per frame.
    """
    turned = R_world_wrist.clone()
    R_world_object = torch.from_numpy(T_world_object[:, :3, :3]).to(turned)
    for s in segments:
        _, nearest = surface.tree.query(s.anchor)
        out = s.anchor - surface.points[nearest]
        out = out / max(float(np.linalg.norm(out)), 1e-6)
        frames = slice(s.start, s.stop)
        R = R_world_wrist[frames, s.hand]
        into = -(R_world_object[frames] @ torch.from_numpy(out).to(R))
        turn = _toward(-R[..., 1], into, WRIST.tolerance, WRIST.farthest)
        turned[frames, s.hand] = turn @ R
    return turned


def _toward(
    now: Float[Tensor, "*b 3"], goal: Float[Tensor, "*b 3"], tolerance: float, farthest: float
) -> Float[Tensor, "*b 3 3"]:
    """Return the rotation that brings `now` within `tolerance` of `goal`, by `farthest` at most."""
    axis = torch.linalg.cross(now, goal)
    angle = torch.atan2(axis.norm(dim=-1), (now * goal).sum(dim=-1))
    turn = (angle - tolerance).clamp(0.0, farthest)
    unit = torch.nn.functional.normalize(axis, dim=-1)
    return roma.rotvec_to_rotmat(unit * turn[..., None])


ROOT_AND_JOINTS = 24
"""Vectors at the beginning of stage 2's features that are positions."""

_CHEST = joint("spine3")


@dataclass(frozen=True)
class SampledBodies:
    """Bodies as stage 2 samples them, before anything is solved."""

    root: Float[Tensor, "samples frames 3"]
    """Pelvis joint of the body that is asked for, world, metres."""
    rotations: Float[Tensor, "samples frames 22 3 3"]
    """Global R_world_joint."""
    foot_contact: Float[Tensor, "samples frames 4"]

    def select(self, some: slice) -> "SampledBodies":
        """Return those of some samples."""
        return SampledBodies(self.root[some], self.rotations[some], self.foot_contact[some])

    @staticmethod
    def of(
        features: Float[Tensor, "samples frames channels"], retargeting: Retargeting
    ) -> "SampledBodies":
        """Return the bodies of features that `sample_body` returns, on the bones that are asked for."""
        # Patches of frames are decoded together; a light filter takes out the jumps between them.
        smooth = np.asarray(
            gaussian_filter1d(
                features.numpy(), BODY_DECODING.feature_smoothing, axis=1, mode="nearest"
            )
        )
        calm = [despike(smooth[k], ROOT_AND_JOINTS) for k in range(len(smooth))]
        x = torch.from_numpy(np.stack(calm))
        root, _, six, foot_contact = body_stage.unpack(x, torch.zeros(*x.shape[:2], 2))
        people = tilt_pelvis(retargeting.trained, root, rotmat_from_6d(six))
        return SampledBodies(*retargeting.to_body(*people), foot_contact)


@torch.inference_mode()
def solve_people(
    sampled: SampledBodies,
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    clip: ObjectClip,
    object_model: ObjectModel,
    body: BodyModel,
    prefix: SolvedPrefix | None,
    *,
    palms_known: bool,
    on_progress: Callable[[float], None] = lambda done: None,
) -> tuple[list[Person], SolvedBodies]:
    """Return the people that are solved from the sampled bodies, with their palms where `hands` says.

    Args:
        sampled: bodies of stage 2.
        hands: palms and contact weights of each sample.
        segments: what they hold.
        clip: where the object is.
        object_model: the object.
        body: whose bones.
        prefix: the first frames, which stay as they are.
        palms_known: the palms are given: arms follow them in every frame, not only where they hold.
        on_progress: called with the fraction done.
    """
    R = sampled.rotations
    targets = interaction_targets(R, hands, segments, clip, object_model, palms_known=palms_known)
    solved = solve_bodies(
        body, sampled.root, R, sampled.foot_contact, targets, prefix, on_progress=on_progress
    )
    return finish_people(
        solved, targets, sampled.foot_contact, hands, segments, object_model, body, prefix
    )


@torch.inference_mode()
def finish_people(
    solved: SolvedBodies,
    targets: InteractionTargets,
    foot_contact: Float[Tensor, "samples frames 4"],
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    object_model: ObjectModel,
    body: BodyModel,
    prefix: SolvedPrefix | None,
) -> tuple[list[Person], SolvedBodies]:
    """Return the people of solved bodies, and these with palms laid on what they hold; fingers are closed.

    Args:
        solved: bodies.
        targets: what they are solved for.
        foot_contact: as sampled.
        hands: palms and contact weights of each sample.
        segments: what they hold.
        object_model: the object.
        body: whose bones.
        prefix: the first frames, which stay as they are.
    """
    frames, before = solved.root.shape[1], 0 if prefix is None else prefix.frames
    free = free_after(before, frames)
    solved = finish_arms(body, solved, targets, hands, segments, free)
    T, planted = targets.T_world_object, foot_contact.double().numpy()
    people = assemble_people(
        body, solved, planted, hands, segments, T, object_model.obstacle, prefix
    )
    return people, solved


def finish_arms(
    body: BodyModel,
    solved: SolvedBodies,
    targets: InteractionTargets,
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    free: Float[Tensor, " frames"],
) -> SolvedBodies:
    """Return bodies whose palms lie on what they hold, free hands outside their thighs, and no arm leaps.

    Args:
        body: whose hands.
        solved: palms on their targets.
        targets: what they are solved for.
        hands: contact weights of each sample.
        segments: what they hold.
        free: how far each frame may be changed, from 0 to 1.
    """
    laid = lay_palms(body, solved, targets, segments, free)
    out = lead_hands_out(body, laid.root, laid.rotations, targets.hold, free)
    # Palms that are given are at their places in every frame.
    given = bool((targets.hold == 1).all())
    held = targets.hold.numpy() if given else np.stack([h.contact for h in hands])
    return replace(laid, rotations=steady_limbs(body, laid.root, out, ARMS, held, free))


def interaction_targets(
    R: Float[Tensor, "samples frames 22 3 3"],
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    clip: ObjectClip,
    object_model: ObjectModel,
    *,
    palms_known: bool = False,
) -> InteractionTargets:
    """Return the targets that sampled bodies are solved for.

    Args:
        R: sampled global rotations.
        hands: palms and contact weights of each sample.
        segments: what they hold.
        clip: where the object is.
        object_model: the object.
        palms_known: arms follow the palms in every frame, not only where they hold.
    """
    T = clip.take.motion.T_world_object
    contact = np.stack([h.contact for h in hands])
    pull = np.ones_like(contact) if palms_known else arms_follow(contact)
    wrists = [
        face_palms(R[k][:, WRISTS], held, object_model.surface, T)
        for k, held in enumerate(segments)
    ]
    return InteractionTargets(
        palms=torch.from_numpy(np.stack([h.palms for h in hands])).float(),
        hold=torch.from_numpy(pull).float(),
        R_world_wrist=torch.stack(wrists),
        T_world_object=T,
        obstacle=object_model.obstacle,
        balance=balance_weight(clip),
    )


def arms_follow(contact: Float[np.ndarray, "*b frames 2"]) -> Float[np.ndarray, "*b frames 2"]:
    """Return how far each arm follows its palm, in [0, 1]: a while longer than the palm touches.

    Arms that came from their sampled pose, and went back, as quickly as palms touch would whip round.

    Args:
        contact: weight of each hand's contact, in [0, 1].
    """
    if (contact < 1).all():
        return contact
    # Frames to the nearest full contact. Other hands and samples lie too far away to count.
    apart = np.full(contact.ndim, BODY_DECODING.following)
    apart[-2] = 1
    away = np.asarray(distance_transform_edt(contact < 1, sampling=apart))
    return np.maximum(contact, min_jerk(1 - away / BODY_DECODING.following))


def assemble_people(
    body: BodyModel,
    solved: SolvedBodies,
    foot_contact: Float[np.ndarray, "samples frames 4"],
    hands: Sequence[HandMotion],
    segments: Sequence[tuple[ContactSegment, ...]],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    obstacle: MeshObstacle,
    prefix: SolvedPrefix | None = None,
) -> list[Person]:
    """Return people from solved bodies, with closed fingers, palm misses and penetration depths."""
    # Solving in single precision leaves rotations a little off; they are made orthonormal again.
    root = solved.root.double()
    R = rotmat_from_6d(rotmat_to_6d(solved.rotations.double()))
    contact = np.stack([h.contact for h in hands])
    T, weight = torch.from_numpy(T_world_object), torch.from_numpy(contact)
    joints = forward_kinematics(body, root, R)
    closed = close_fingers(
        body, R[..., WRISTS, :, :], joints[..., WRISTS, :], T, obstacle.field, weight
    )
    depth = penetration_depth(body, root, R, T, obstacle).double().numpy()
    fingers, standing = _continued(prefix, closed.fingers.double()), np.tile(solved.standing, 2)
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
            FingerFit(
                closed.depth[k].double().numpy(),
                closed.pad_distance[k].double().numpy(),
                closed.grip[k].numpy(),
            ),
        )
        for k in range(len(hands))
    ]


def _continued(
    prefix: SolvedPrefix | None, fingers: Float[Tensor, "samples frames 30 3 3"]
) -> Float[Tensor, "samples frames 30 3 3"]:
    """Return fingers that begin with those of the prefix; the change of its last frame fades out after it."""
    if prefix is None or prefix.fingers is None:
        return fingers
    first, before = prefix.frames, prefix.fingers.to(fingers)
    step = roma.rotmat_to_rotvec(fingers[:, first - 1].mT @ before[:, -1])
    weight = fade(fingers.shape[1] - first + 1)[1:, None, None].to(fingers)
    rest = fingers[:, first:] @ roma.rotvec_to_rotmat(weight * step[:, None])
    return torch.cat([before, rest], dim=1)


def balance_weight(clip: ObjectClip) -> Float[np.ndarray, " frames"]:
    """Return 1 where the weight must be over the feet, 0 where the object may be leant on."""
    leaning = (clip.take.lowest < BODY_DECODING.leaning_height) & clip.must_hold
    return 1.0 - gaussian_filter1d(
        leaning.astype(float), BODY_DECODING.leaning_smoothing, mode="nearest"
    )


def tilt_pelvis(
    body: BodyModel, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
    """Return root and rotations with the pelvis turned about the line through the hips, which stay in place.

    People bend in the small of the back, so the pelvis takes only a part of the chest's pitch. The
    synthetic people that stage 2 was trained on hinge more at the hips, and sampled ones do so too.

    Args:
        body: whose bones.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
    """
    pelvis = rotations[..., 0, :, :]
    change = BODY_DECODING.pelvis_tilt * pitch(rotations, _CHEST) - pitch(rotations, 0)
    turned = roma.rotvec_to_rotmat(pelvis[..., 0] * change[..., None]) @ pelvis
    out = rotations.clone()
    out[..., 0, :, :] = turned
    return root + (pelvis - turned) @ body.hips.to(root), out


def pitch(rotations: Float[Tensor, "*b 22 3 3"], of: int) -> Float[Tensor, "*b"]:
    """Return how far a joint is pitched forward in the direction the pelvis faces, radians."""
    left, up = rotations[..., 0, :, 0], rotations[..., of, :, 1]
    ahead = torch.stack([left[..., 1], -left[..., 0]], dim=-1)
    ahead = ahead / ahead.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    return torch.atan2((up[..., :2] * ahead).sum(dim=-1), up[..., 2])
