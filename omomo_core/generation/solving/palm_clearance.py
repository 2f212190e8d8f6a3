"""Palm clearance: hands that come, hold and go stay outside what they hold.

They are raised along the surface's normal at their anchor; near a contact, a hand lands.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.finger_model import finger_model, pose_fingers
from omomo_core.body.grip import HandPoses, relaxed_angles
from omomo_core.body.model import BodyModel
from omomo_core.generation.solving.config import PALM_CLEARANCE
from omomo_core.generation.solving.palm_plan import HeldPalm
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.easing import min_jerk


def raise_palms(
    body: BodyModel,
    wrists: Float[Tensor, "frames 2 3"],
    R_world_wrist: Float[Tensor, "frames 2 3 3"],
    holds: Sequence[HeldPalm],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    field: DistanceField,
) -> Float[Tensor, "frames 2 3"]:
    """Return how far hands move so that their skin is out of what they hold; world, metres.

    Palms are measured where they hold; before and after, the fingers of a relaxed hand are, too.

    Args:
        body: whose hands.
        wrists: world, metres.
        R_world_wrist: of the hands as they lie on what they hold.
        holds: their contacts.
        T_world_object: the object's pose.
        field: signed distance to the object.
    """
    shift, total = torch.zeros_like(wrists), torch.full(wrists.shape[:2], 1e-6)
    T = torch.from_numpy(T_world_object).float()
    for hold in holds:
        share = _share(hold, len(T))
        keys = _keys(share.numpy())
        to_object = T[keys, :3, :3].mT
        at = (to_object @ (wrists[keys, hold.side] - T[keys, :3, 3])[..., None])[..., 0]
        side = torch.full((len(keys),), hold.side)
        poses = HandPoses(to_object @ R_world_wrist[keys, hold.side], at, side)
        up = _landed(hold, keys, _needed(body, hold, keys, poses, field), len(T))
        shift[:, hold.side] += (share * up)[:, None] * (T[:, :3, :3] @ hold.out)
        total[:, hold.side] += share
    return shift / total.clamp(min=1.0)[..., None]


def _share(hold: HeldPalm, frames: int) -> Float[Tensor, " frames"]:
    """Return how far a hand is kept out of the object in each frame: it may pass through it elsewhere."""
    rest = PALM_CLEARANCE.reach - hold.away(frames)
    return torch.from_numpy(min_jerk(rest / PALM_CLEARANCE.fade)).float()


def _keys(share: Float[np.ndarray, " frames"]) -> Int[np.ndarray, " keys"]:
    """Return the frames that are measured: some of those in which a hold counts."""
    first, last = np.flatnonzero(share)[[0, -1]]
    return np.unique(np.append(np.arange(first, last, PALM_CLEARANCE.stride), last))


def _needed(
    body: BodyModel,
    hold: HeldPalm,
    keys: Int[np.ndarray, " keys"],
    poses: HandPoses,
    field: DistanceField,
) -> Float[np.ndarray, " keys"]:
    """Return how far a hand must go along the normal to be outside, metres."""
    model, needed = finger_model(body), torch.zeros(len(keys))
    side = torch.tensor([hold.side])
    fingers = pose_fingers(model, side, relaxed_angles()[None]).points[0].flatten(0, 1)
    whole = torch.cat([model.palm[hold.side], fingers])
    holding = torch.from_numpy((keys >= hold.start) & (keys < hold.stop))
    for some, skin in ((holding, model.palm[hold.side]), (~holding, whole)):
        own = poses[some]
        points = own.placed(skin.expand(len(own.side), -1, -1))
        needed[some] = _outside(points, hold.out, field)
    return needed.numpy()


def _landed(
    hold: HeldPalm,
    keys: Int[np.ndarray, " keys"],
    needed: Float[np.ndarray, " keys"],
    frames: int,
) -> Float[Tensor, " frames"]:
    """Return the rise of every frame, smooth; the nearer a contact is, the less a hand is raised."""
    t = np.arange(frames)
    own = (keys >= hold.start) & (keys < hold.stop)
    held, series = np.interp(t, keys[own], needed[own]), np.interp(t, keys, needed)
    away = hold.away(frames)
    most = held + PALM_CLEARANCE.landing * away
    series = np.minimum(np.where(away > 0, np.maximum(series, held), held), most)
    widest = np.minimum(maximum_filter1d(series, PALM_CLEARANCE.window, mode="nearest"), most)
    smooth = gaussian_filter1d(widest, PALM_CLEARANCE.smoothing, mode="nearest")
    return torch.from_numpy(smooth).float()


def _outside(
    skin: Float[Tensor, "keys points 3"], out: Float[Tensor, "3"], field: DistanceField
) -> Float[Tensor, " keys"]:
    """Return how far points must go along a direction until none is inside, metres."""
    rise, inside = torch.zeros(len(skin)), torch.arange(len(skin))
    for _ in range(PALM_CLEARANCE.rounds * (len(skin) > 0)):
        moved = skin[inside] + rise[inside, None, None] * out
        distance = field.at(moved)
        # The deepest point alone counts, and the grid tells which ones may be it.
        deepest = distance.amin(dim=1, keepdim=True)
        close = distance.abs() < PALM_CLEARANCE.exact_range
        close &= distance < deepest + PALM_CLEARANCE.grid_error
        distance[close] = field.exact(moved[close])[0]
        deepest = distance.amin(dim=1)
        rise[inside] += (-deepest).clamp(min=0.0)
        inside = inside[deepest < 0]
    return rise.clamp(max=PALM_CLEARANCE.highest)
