"""The skin of the hands by part: palm, phalanges and finger pads; what grips are solved and judged on."""

from dataclasses import dataclass
from functools import lru_cache

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.config import HAND_SKIN
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.skinning import vertex_normals

PALM, THUMB = -1, 4
"""Of `HandSkin.finger`; index, middle, pinky, ring and thumb are 0 to 4, in the skeleton's order."""


@dataclass(frozen=True)
class HandSkin:
    """Vertices of one hand from the heel of the palm to the fingertips."""

    vertices: Int[Tensor, " verts"]
    """Indices into the body's vertices."""
    finger: Int[Tensor, " verts"]
    """Which finger each belongs to; `PALM` for none."""
    phalanx: Int[Tensor, " verts"]
    """0, 1, 2 from the knuckle to the tip; the thumb's first is its palm bone."""
    pad: Bool[Tensor, " verts"]
    """On the palmar side of a last phalanx."""


@lru_cache(maxsize=4)
def hand_skins(body: BodyModel) -> tuple[HandSkin, HandSkin]:
    """Return the skin of the left and the right hand."""
    normals = vertex_normals(body.vertices, body.faces)
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    bone = body.skin_joints.gather(1, strongest)[:, 0]
    palmar = palmar_directions(body)
    return _hand_skin(body, 0, bone, normals, palmar), _hand_skin(body, 1, bone, normals, palmar)


def _hand_skin(
    body: BodyModel,
    side: int,
    bone: Int[Tensor, " all"],
    normals: Float[Tensor, "all 3"],
    palmar: Float[Tensor, "2 5 3"],
) -> HandSkin:
    wrist, first = WRISTS[side], 22 + 15 * side
    knuckle = body.rest_joints[first + 3] - body.rest_joints[wrist]
    along = (body.vertices - body.rest_joints[wrist]) @ knuckle / knuckle.square().sum()
    link = bone - first
    fingers = (link >= 0) & (link < 15)
    chosen = (fingers | ((bone == wrist) & (along > HAND_SKIN.heel))).nonzero()[:, 0]
    finger = torch.where(fingers, link // 3, PALM)[chosen]
    phalanx = torch.where(fingers, link % 3, 0)[chosen]
    faces_palm = (normals[chosen] * palmar[side, finger]).sum(dim=-1) > HAND_SKIN.pad_cosine
    return HandSkin(chosen, finger, phalanx, (finger != PALM) & (phalanx == 2) & faces_palm)


def palmar_directions(body: BodyModel) -> Float[Tensor, "2 5 3"]:
    """Return the direction in which the pad of each finger of both hands looks at rest, unit length."""
    joints = body.rest_joints[22:].view(2, 5, 3, 3)
    along = normalize(joints[:, :, 2] - joints[:, :, 1], dim=-1)
    palmar = torch.tensor([0.0, -1.0, 0.0]).repeat(2, 5, 1)
    palmar[:, THUMB] = torch.stack([_nail(body, side, along[side, THUMB]) for side in range(2)])
    palmar = palmar - (palmar * along).sum(dim=-1, keepdim=True) * along
    return normalize(palmar, dim=-1)


def _nail(body: BodyModel, side: int, along: Float[Tensor, "3"]) -> Float[Tensor, "3"]:
    """Return where the thumb's pad looks: its tip is flattest from nail to pad."""
    tip = 22 + 15 * side + 3 * THUMB + 2
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    skin = body.vertices[body.skin_joints.gather(1, strongest)[:, 0] == tip]
    beside = skin - (skin @ along)[:, None] * along
    axes = torch.linalg.svd(beside - beside.mean(dim=0), full_matrices=False)[2]
    return axes[1] * torch.sign(axes[1] @ torch.tensor([0.0, -1.0, -1.0]))
