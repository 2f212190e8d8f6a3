"""How a trunk bends, leans and twists: bent poses of a base motion, for any amount per frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.directions import about_z, ahead_of, in_space
from omomo_core.skeleton import BODY_JOINTS, joint

_PITCH_SHARE = {
    "pelvis": 0.6, "spine1": 0.7, "spine2": 0.82, "spine3": 1.0, "neck": 0.8, "head": 0.6,
    "left_collar": 1.0, "right_collar": 1.0,
}  # fmt: skip
_TWIST_SHARE = {
    "pelvis": 0.1, "spine1": 0.25, "spine2": 0.42, "spine3": 0.6, "neck": 0.6, "head": 0.7,
    "left_collar": 0.6, "right_collar": 0.6,
}  # fmt: skip
_ARM_PITCH, _ARM_TWIST = 0.4, 0.6
"""Free arms hang: they follow the trunk only in part."""
_LOWEST_DROP = 0.6
"""Of the hips: thighs lie on the calves, metres."""
_ARMS = tuple(f"{side}_{p}" for side in ("left", "right") for p in ("shoulder", "elbow", "wrist"))


@dataclass(frozen=True)
class BendStyle:
    """What full bending (amount 1) means for one person; from stooping to sitting on the heels."""

    pitch: Float[np.ndarray, "*b"]
    drop: Float[np.ndarray, "*b"]
    """The hips go down by this, metres."""
    back: Float[np.ndarray, "*b"]
    """The hips go back by this, metres, so that the feet stay under the weight."""
    hang: Float[np.ndarray, "*b"]
    """How much arms hang straight down: 1 for those who stoop, 0 for those who squat."""

    def rows(self, frames: Int[np.ndarray, " n"]) -> "BendStyle":
        """Some frames, with room for another axis."""
        parts = (self.pitch, self.drop, self.back, self.hang)
        return BendStyle(*(part[frames, None] for part in parts))


def manner(squat: Float[np.ndarray, " frames"]) -> BendStyle:
    """Stooping (0) bends the back over nearly straight knees, squatting (1) the knees (the styles of
    lifting of von Arx et al. 2021), and some sit down on their heels (2)."""

    def style(stoop: float, squatting: float, sitting: float) -> Float[np.ndarray, " frames"]:
        return np.interp(squat, [0.0, 1.0, 2.0], [stoop, squatting, sitting])

    return BendStyle(
        pitch=style(2.1, 0.9, 0.6),
        drop=style(0.02, 0.47, 0.6),
        back=style(0.2, 0.13, 0.11),
        hang=style(1.0, 0.0, 0.0),
    )


def _share(table: dict[str, float], arms: float) -> Float[np.ndarray, " 22"]:
    arm_table = dict.fromkeys(_ARMS, arms)
    return np.array([(table | arm_table).get(name, 0.0) for name in BODY_JOINTS])


_PITCH, _TWIST = _share(_PITCH_SHARE, _ARM_PITCH), _share(_TWIST_SHARE, _ARM_TWIST)


@dataclass(frozen=True)
class Torso:
    """What the trunk does besides going down."""

    yaw: Float[np.ndarray, "*b"]
    """Heading that "forward" means."""
    how: BendStyle
    lean: Float[np.ndarray, "*b"]
    """Forward pitch of the trunk, radians."""
    twist: Float[np.ndarray, "*b"]
    """Of the shoulders against the feet, radians, positive to the left."""

    def rows(self, frames: Int[np.ndarray, " n"]) -> "Torso":
        """Some frames, with room for another axis."""
        return Torso(
            self.yaw[frames, None],
            self.how.rows(frames),
            self.lean[frames, None],
            self.twist[frames, None],
        )


def bent(
    body: BodyModel,
    root: Float[np.ndarray, "*#c 3"],
    rotations: Float[np.ndarray, "*#c 22 3 3"],
    amount: Float[np.ndarray, "*#c"],
    torso: Torso,
) -> tuple[Float[np.ndarray, "*c 3"], Float[np.ndarray, "*c 22 3 3"]]:
    """Bend a base motion down, lean it forward and twist it. All batch axes are broadcast.

    Args:
        body: whose hips the pelvis turns about.
        root: pelvis, world, metres.
        rotations: global R_world_joint.
        amount: 0 upright, 1 fully down as `torso.how` says.
        torso: the manner of bending, lean and twist.

    Returns:
        Root and rotations; the legs keep their rotations and must be solved to their feet.
    """
    how, yaw = torso.how, torso.yaw
    pitch = amount * how.pitch + torso.lean
    turn = about_z(torso.twist[..., None] * _TWIST) @ _about_left(yaw, pitch[..., None] * _PITCH)
    turned = turn @ rotations
    rest = body.rest_joints.double().numpy()
    to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    hips = root + rotations[..., 0, :, :] @ to_hips
    ahead = in_space(ahead_of(yaw))
    # Going down, hips and back lead and the knees follow (Burgess-Limerick et al. 1995).
    down = np.array([0.0, 0.0, 1.0]) * np.minimum(amount**2 * how.drop, _LOWEST_DROP)[..., None]
    hips = hips - (amount * how.back)[..., None] * ahead - down
    return hips - turned[..., 0, :, :] @ to_hips, turned


def _about_left(
    yaw: Float[np.ndarray, "*#b"], angle: Float[np.ndarray, "*#b n"]
) -> Float[np.ndarray, "*b n 3 3"]:
    """Pitch forward about the horizontal axis to the left of the heading."""
    heading = about_z(yaw)[..., None, :, :]
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    pitch = np.stack([c, o, s, o, o + 1.0, o, -s, o, c], axis=-1).reshape(*angle.shape, 3, 3)
    return heading @ pitch @ np.swapaxes(heading, -1, -2)
