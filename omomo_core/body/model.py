"""BodyModel: a skinned body whose joints are those of `omomo_core.skeleton`."""

from dataclasses import dataclass, replace

from jaxtyping import Float, Int
from torch import Tensor


@dataclass(frozen=True)
class BodyModel:
    """Rest pose: T-pose, y up, facing +z, +x = body left, metres; the pelvis may be anywhere."""

    name: str
    credit: str
    """Licence and authors of the shape, shown wherever the body is used."""
    rest_joints: Float[Tensor, "52 3"]
    """Joint positions in the order of ALL_JOINTS."""
    vertices: Float[Tensor, "verts 3"]
    faces: Int[Tensor, "faces 3"]
    skin_joints: Int[Tensor, "verts influences"]
    """Index into ALL_JOINTS of each vertex's bones."""
    skin_weights: Float[Tensor, "verts influences"]
    """Weights summing to 1."""
    relaxed_fingers: Float[Tensor, "30 3 3"]
    """Rotation of each finger joint relative to its parent in a relaxed hand."""
    shoe_sole: float = 0.0
    """Metres by which shoes raise every joint above where bare feet have it; the surface includes them."""

    @property
    def height(self) -> float:
        """Stature without shoes, metres."""
        y = self.vertices[:, 1]
        return float(y.max() - y.min()) - self.shoe_sole

    @property
    def hips(self) -> Float[Tensor, "3"]:
        """Middle of the hip joints from the pelvis joint, at rest."""
        return self.rest_joints[[1, 2]].mean(dim=0) - self.rest_joints[0]


def with_height(body: BodyModel, height: float) -> BodyModel:
    """The same body scaled to a stature, metres."""
    scale = height / body.height
    return replace(
        body,
        rest_joints=body.rest_joints * scale,
        vertices=body.vertices * scale,
        shoe_sole=body.shoe_sole * scale,
    )
