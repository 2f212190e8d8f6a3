"""Grasp: fingers that lie on what a hand holds, with every joint free within its range.

Each contact has one grip (`grip.py`), from which the fingers of all key frames are fitted together
(`finger_fit.py`). Fingers take the grip's shape before the hand arrives and relax after it has let go.
"""

from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.body.body_config import GRASP, GRIP
from omomo_core.body.finger_fit import KeyFrames, fit_fingers, slowed
from omomo_core.body.finger_model import PER_PHALANX, finger_model, pose_fingers, rotations
from omomo_core.body.grip import HandPoses, find_grips, name_grips, opened_angles, relaxed_angles
from omomo_core.body.model import BodyModel
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.runs import frames_away, min_jerk, runs


@dataclass(frozen=True)
class ClosedFingers:
    """Finger rotations of both hands, and how they lie on the object."""

    fingers: Float[Tensor, "*b frames 30 3 3"]
    """Rotation of each finger joint relative to its parent."""
    depth: Float[Tensor, "*b frames 2"]
    """Depth of the deepest finger or palm of the left and the right hand, metres; 0 where none is inside."""
    pad_distance: Float[Tensor, "*b frames 2"]
    """Distance from the surface to the third nearest fingertip of a hand that holds, metres; else 0."""
    grip: Int[Tensor, "*b frames 2"]
    """Number of each hand's grip in `GRIPS`; 0 where it is free."""


@dataclass(frozen=True)
class _Sequences:
    """Hands over time, one after the other: of each sample the left, then the right."""

    poses: HandPoses
    """Poses by sequence and frame."""
    away: Float[Tensor, "rows frames"]
    """Frames to the nearest contact; infinite where there is none."""
    weight: Float[Tensor, "rows frames"]

    def at(self, row: Int[Tensor, " some"], frame: Int[Tensor, " some"]) -> HandPoses:
        """Return the hands of single frames."""
        return self.poses[row * self.away.shape[1] + frame]


def close_fingers(
    body: BodyModel,
    R_world_wrist: Float[Tensor, "*b frames 2 3 3"],
    wrists: Float[Tensor, "*b frames 2 3"],
    T_world_object: Float[Tensor, "frames 4 4"],
    field: DistanceField,
    weight: Float[Tensor, "*b frames 2"],
) -> ClosedFingers:
    """Return the fingers of both hands closed on an object.

    Args:
        body: whose hands; where they are free its fingers are relaxed.
        R_world_wrist: global rotation of the left and the right wrist.
        wrists: wrist joints, world, metres.
        T_world_object: the object's pose.
        field: signed distance to the object, in its frame.
        weight: how much each hand holds the object, 0 free to 1.
    """
    shape, frames = weight.shape, weight.shape[-2]
    fingers = body.relaxed_fingers.float().expand(*shape[:-1], 30, 3, 3)
    if not weight.numel():
        return ClosedFingers(
            *(fingers, torch.zeros(shape), torch.zeros(shape)), torch.zeros(shape).long()
        )
    fingers = _by_hand(fingers.reshape(-1, frames, 2, 5, 3, 3, 3)).clone()
    measures, grips = torch.zeros(2, len(fingers), frames), torch.zeros(len(fingers), frames).long()
    hands = _sequences(R_world_wrist, wrists, T_world_object, weight)
    share = _falling(hands.away, GRASP.shaping, GRASP.leaving)
    if (share > 0).any():
        keys = torch.arange(0, frames + GRASP.stride - 1, GRASP.stride).clamp(max=frames - 1)
        chosen = _key_frames(body, hands, keys, field)
        grips = _named(body, hands, T_world_object, field)
        angles = fit_fingers(finger_model(body), chosen, len(fingers), keys, field)
        relaxed = relaxed_angles()
        angles = slowed(relaxed + share[:, keys, None, None] * (angles - relaxed), keys)
        row, frame = _moved(angles, keys, frames).nonzero().T
        before, after, u = _between(keys, frame)
        a, b = angles[row, before], angles[row, after]
        found = rotations(finger_model(body), row % 2, a + u[:, None, None] * (b - a))
        fingers[row, frame] = found @ _recorded(body, row % 2, 1 - share[row, frame])
        seen = _measures(body, chosen, angles, field)
        measures[:, row, frame] = seen[:, row, before] + u * (
            seen[:, row, after] - seen[:, row, before]
        )
        measures[1] *= hands.weight >= GRASP.full_weight
    depth, pads = measures.unflatten(1, (-1, 2)).mT.reshape(2, *shape)
    fingers = fingers.unflatten(0, (-1, 2)).transpose(1, 2)
    grip = grips.unflatten(0, (-1, 2)).mT.reshape(shape)
    return ClosedFingers(fingers.reshape(*shape[:-1], 30, 3, 3), depth, pads, grip)


def _recorded(
    body: BodyModel, side: Int[Tensor, " some"], weight: Float[Tensor, " some"]
) -> Float[Tensor, "some 5 3 3 3"]:
    """Return the turn from the relaxed angles to the body's relaxed fingers, as far as a hand is free."""
    relaxed = rotations(finger_model(body), torch.arange(2), relaxed_angles().expand(2, -1, -1))
    own = body.relaxed_fingers.float().view(2, 5, 3, 3, 3)
    turn = roma.rotmat_to_rotvec(relaxed.mT @ own)[side]
    return roma.rotvec_to_rotmat(weight[:, None, None, None] * turn)


def _sequences(
    R_world_wrist: Float[Tensor, "*b frames 2 3 3"],
    wrists: Float[Tensor, "*b frames 2 3"],
    T_world_object: Float[Tensor, "frames 4 4"],
    weight: Float[Tensor, "*b frames 2"],
) -> _Sequences:
    """Return the hands in the object's frame."""
    frames = weight.shape[-2]
    R_object_world = T_world_object[:, None, :3, :3].mT.float()
    shift = (wrists - T_world_object[:, None, :3, 3]).float()
    at = (R_object_world @ shift[..., None])[..., 0].reshape(-1, frames, 2, 3)
    R = (R_object_world @ R_world_wrist.float()).reshape(-1, frames, 2, 3, 3)
    held = _by_hand(weight.float().reshape(-1, frames, 2))
    side = (torch.arange(len(held)) % 2).repeat_interleave(frames)
    poses = HandPoses(_by_hand(R).flatten(0, 1), _by_hand(at).flatten(0, 1), side)
    away = np.zeros(held.shape, np.float32)
    for row, w in enumerate(held.numpy()):
        away[row] = _frames_to_contact(w)
    return _Sequences(poses, torch.from_numpy(away), held)


def _by_hand(x: Float[Tensor, "samples frames 2 *rest"]) -> Float[Tensor, "rows frames *rest"]:
    return x.transpose(1, 2).flatten(0, 1)


def _frames_to_contact(weight: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Return the frames to the nearest contact: where the hand holds fully, or else most."""
    most = max(float(weight.max(initial=0.0)), 1e-3)
    return frames_away(weight >= min(GRASP.full_weight, most))


def _falling(away: Float[Tensor, "*n"], first: float, last: float) -> Float[Tensor, "*n"]:
    """Return 1 up to `first` frames away from a contact, falling smoothly to 0 at `last`."""
    return torch.from_numpy(min_jerk(((last - away) / (last - first)).numpy())).float()


def _key_frames(
    body: BodyModel, hands: _Sequences, keys: Int[Tensor, " keys"], field: DistanceField
) -> KeyFrames:
    """Return the key frames in which fingers leave their rest, with the grip of the nearest contact."""
    rows, start, stop = _spans(hands)
    part = (torch.arange(GRIP.poses) + 0.5) / GRIP.poses
    seen = (start[:, None] + part * (stop - start)[:, None]).long().flatten()
    grips = find_grips(body, hands.at(rows.repeat_interleave(GRIP.poses), seen), field)
    row, key = (hands.away[:, keys] < GRASP.leaving + GRASP.stride).nonzero().T
    frame = keys[key]
    apart = torch.maximum(start - frame[:, None], frame[:, None] - stop + 1).clamp(min=0).float()
    nearest = apart.masked_fill(rows != row[:, None], torch.inf).argmin(dim=1)
    shape = _falling(hands.away[row, frame], 0.0, GRASP.shaping)[:, None, None]
    relaxed, grip = relaxed_angles(), grips[nearest]
    within = _within(hands)[row, frame]
    opened = torch.from_numpy(min_jerk((1 - within / GRASP.closing).numpy())).float()
    grip = grip + opened[:, None, None] * (opened_angles(grip) - grip)
    return KeyFrames(
        hands.at(row, frame),
        torch.stack([row, key], dim=1),
        hands.weight[row, frame],
        relaxed + shape * (grip - relaxed),
        _coarse_weights(within, key),
    )


def _coarse_weights(
    within: Float[Tensor, " some"], key: Int[Tensor, " some"]
) -> Float[Tensor, " some"]:
    """Return the weights of key frames in the coarse steps: amid a contact, grips hardly change."""
    every = GRASP.coarse_stride
    middle = within > GRASP.closing + every * GRASP.stride
    measured = ~middle | (key % every == 0)
    return measured * torch.where(middle, float(every), 1.0)


def _named(
    body: BodyModel,
    hands: _Sequences,
    T_world_object: Float[Tensor, "frames 4 4"],
    field: DistanceField,
) -> Int[Tensor, "rows frames"]:
    """Return the grip of each frame: that of its contact, seen in the contact's middle."""
    rows, start, stop = _spans(hands)
    middle = (start + stop) // 2
    up = T_world_object[middle, 2, :3].float()
    found = name_grips(body, hands.at(rows, middle), up, field)
    grips = torch.zeros(hands.away.shape, dtype=torch.long)
    for row, a, b, grip in zip(rows, start, stop, found, strict=True):
        grips[row, a:b] = grip
    return grips


def _spans(
    hands: _Sequences,
) -> tuple[Int[Tensor, " spans"], Int[Tensor, " spans"], Int[Tensor, " spans"]]:
    """Return sequence, first frame and the frame after the last of each contact."""
    spans = [
        (row, *span) for row, away in enumerate(hands.away.numpy()) for span in runs(away == 0)
    ]
    rows, start, stop = torch.tensor(spans).T
    return rows, start, stop


def _within(hands: _Sequences) -> Float[Tensor, "rows frames"]:
    """Return how many frames a hand is from the nearer end of its contact; 0 where it has none."""
    within = np.stack([frames_away(away > 0) for away in hands.away.numpy()])
    return torch.from_numpy(within).float()


def _moved(
    angles: Float[Tensor, "rows keys 5 angles"], keys: Int[Tensor, " keys"], frames: int
) -> Bool[Tensor, "rows frames"]:
    """Return the frames in which fingers are not relaxed."""
    before, after, _ = _between(keys, torch.arange(frames))
    apart = (angles - relaxed_angles()).abs().amax(dim=(-2, -1)) > GRASP.still
    return apart[:, before] | apart[:, after]


def _between(
    keys: Int[Tensor, " keys"], frame: Int[Tensor, " some"]
) -> tuple[Int[Tensor, " some"], Int[Tensor, " some"], Float[Tensor, " some"]]:
    """Return the key frames before and after each frame, and how far it is from one to the other."""
    before = torch.searchsorted(keys, frame, right=True) - 1
    after = (before + 1).clamp(max=len(keys) - 1)
    return before, after, (frame - keys[before]) / (keys[after] - keys[before]).clamp(min=1)


def _measures(
    body: BodyModel,
    keys: KeyFrames,
    angles: Float[Tensor, "rows keys 5 angles"],
    field: DistanceField,
) -> Float[Tensor, "2 rows keys"]:
    """Return the depth of the deepest skin, and the distance of the third nearest fingertip."""
    row, key = keys.place.T
    model = finger_model(body)
    skin = pose_fingers(model, keys.poses.side, angles[row, key]).points
    distance = field.fine(keys.poses.placed(skin))
    palm = field.fine(keys.poses.placed(model.palm[keys.poses.side]))
    found = torch.zeros(2, *angles.shape[:2])
    deepest = torch.minimum(distance.flatten(1).amin(dim=1), palm.amin(dim=1))
    found[0, row, key] = (-deepest).clamp(min=0.0)
    tips = distance[..., -PER_PHALANX:].amin(dim=-1).clamp(min=0.0)
    found[1, row, key] = tips.sort(dim=-1).values[:, 2]
    return found
