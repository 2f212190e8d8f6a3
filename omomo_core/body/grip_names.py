"""Names of grips: what a hand does with what is under its palm, from thickness, edges and the way up."""

import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.body.config import GRIP_NAMING
from omomo_core.body.grip import HandPoses
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.skeleton import PALM_JOINTS

GRIPS = (
    "free",
    "flat press",
    "weight on a top",
    "hooked edge",
    "cupped corner",
    "pinched board",
    "power grip",
)
"""By number: a free hand; a palm on a face, from the side or from above; fingers over an edge, or over two;
thumb and fingers on the faces of a thin board; fingers around a bar."""


def name_grips(
    body: BodyModel,
    poses: HandPoses,
    up: Float[Tensor, "contacts 3"],
    field: DistanceField,
) -> Int[Tensor, " contacts"]:
    """Return the number of each contact's grip in `GRIPS`.

    Args:
        body: whose hands.
        poses: of one hand for each contact.
        up: the world's vertical in the object's frame.
        field: signed distance to the object.
    """
    if not len(up):
        return torch.zeros(0, dtype=torch.long)
    rest = body.rest_joints.float()
    ways = rest[list(PALM_JOINTS)] - rest[list(WRISTS)]
    x, y, z = poses.R_object_wrist.unbind(dim=-1)
    palm = poses.placed(ways[poses.side][:, None])[:, 0] - GRIP_NAMING.palm_thickness * y
    thickness = _extent(palm, -y, field)
    within = palm - (0.5 * thickness).clamp(max=GRIP_NAMING.below)[:, None] * y
    fingers = torch.where(poses.side == 0, 1.0, -1.0)[:, None] * x
    ahead, behind, thumb, little = (_extent(within, w, field) for w in (fingers, -fingers, z, -z))
    thin = thickness < GRIP_NAMING.bar
    bar = thin & (torch.minimum(ahead + behind, thumb + little) < GRIP_NAMING.bar)
    beside = torch.minimum(thumb, little) < GRIP_NAMING.thumb_reach
    over = ahead < GRIP_NAMING.finger_reach
    board = (thickness < GRIP_NAMING.board) & (over | beside)
    top = (y * up).sum(dim=-1) > GRIP_NAMING.level_cosine
    grips = torch.full_like(poses.side, GRIPS.index("flat press"))
    for name, found in (
        ("weight on a top", top),
        ("hooked edge", over),
        ("cupped corner", over & beside),
        ("pinched board", board),
        ("power grip", bar),
    ):
        grips[found] = GRIPS.index(name)
    return grips


def _extent(
    start: Float[Tensor, "contacts 3"], way: Float[Tensor, "contacts 3"], field: DistanceField
) -> Float[Tensor, " contacts"]:
    """Return how far the object goes on from a place on it or in it along a direction, metres."""
    steps = torch.arange(1, GRIP_NAMING.probes + 1) * GRIP_NAMING.spacing
    points = start[:, None] + steps[:, None] * way[:, None]
    distance = field.exact(points.flatten(0, 1))[0].view(len(start), -1)
    outside = (distance > 0) & (steps > GRIP_NAMING.entry)
    return torch.where(outside, steps, steps[-1] + GRIP_NAMING.spacing).amin(dim=1)
