"""Gauss-Newton over a whole clip, then exact hands and feet."""

from dataclasses import dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics, joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.polish.anatomy import BONES, VALUES, Anatomy, anatomy
from omomo_core.body.polish.calm import calmed
from omomo_core.body.polish.spline import Spline, solve
from omomo_core.body.polish.targets import Targets
from omomo_core.body.polish.terms import Goals, rows, support
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_SPACING = 6.0
"""Frames between the coefficients of the corrections: nothing changes faster than at 2.5 Hz."""
_STRIDE = 2
"""Every other frame is looked at."""
_SLOW = 0.3
"""Metres per second of the pelvis; a faster body need not be over its feet."""
_STEP = 0.25
"""Longest step of any value of the corrections in one iteration, metres or radians."""
_LEVEL, _HEIGHT = 6.0, 10.0
"""Closeness of the pelvis to the first guess, 1 / m."""
_TURN: dict[str, float] = {"pelvis": 2.0, "spine3": 1.5, "collar": 0.8, "shoulder": 0.12,
                           "elbow": 0.12, "wrist": 0.4, "hip": 0.12, "knee": 0.2}  # fmt: skip
"""Closeness of each bone's turn against its parent, 1 / rad."""
_SMOOTH = 60.0
"""Frames^2: how much a correction's acceleration costs against the correction itself."""
_PARENT_BONE = {"spine3": "pelvis", "collar": "spine3", "shoulder": "collar", "elbow": "shoulder",
                "wrist": "elbow", "hip": "pelvis", "knee": "hip"}  # fmt: skip
_ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")
_LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")
_ANKLES = (joint("left_ankle"), joint("right_ankle"))

_Pose = tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]


def polish(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    targets: Targets,
    *,
    clearance: float | None = None,
    free: Float[np.ndarray, " frames"] | None = None,
    steps: int = 4,
) -> _Pose:
    """Make a first guess of a whole clip physically and anatomically plausible.

    Smooth corrections of pelvis, trunk, shoulder girdle, arms and legs are found that weigh palms
    and planted feet on their places, joint ranges, flesh outside the object, the weight over the feet
    and closeness to the first guess; then arms and legs are solved exactly.

    Args:
        body: whose bones, flesh and weight to use.
        root: pelvis of the first guess, world, metres.
        rotations: its global R_world_joint.
        targets: what has to be satisfied.
        clearance: metres that flesh keeps from the object, see `anatomy`.
        free: how far each frame may be corrected, from 0 (not at all) to 1.
        steps: Gauss-Newton iterations.

    Returns:
        Root and rotations; held palms and planted feet are exact where the limbs reach.
    """
    frames = len(root)
    targets = _approached(body, root, rotations, targets)
    rotations = calmed(rotations)
    flesh, spline = anatomy(body, clearance=clearance), Spline(frames, _SPACING)
    basis = spline.basis(np.arange(frames, dtype=float))
    basis = basis if free is None else basis * _float(free)[:, None]
    guess = _Guess(_float(root), _float(rotations), basis)
    goals = _goals(flesh, root, targets)
    seen = np.unique(np.append(np.arange(0, frames, _STRIDE), frames - 1))
    values = torch.zeros(spline.count, VALUES)
    near, bending = _closeness(), spline.bending() * len(seen)
    stiffness = _SMOOTH**2 * near.diagonal()
    part, watched = guess.at(seen), goals.at(seen)
    for _ in range(steps):
        J, r = rows(flesh, watched, *part.corrected(flesh, values))
        hessian = J.mT @ J + near
        gradient = (J.mT @ r[..., None])[..., 0] + (part.basis @ values) @ near
        step = solve(part.basis, hessian, gradient, bending, stiffness, values)
        values = values + step.clamp(-_STEP, _STEP)
    moved, turned = guess.corrected(flesh, values)
    shift = (moved - guess.root).double().numpy()
    return _exact(body, root + shift, _orthonormal(turned.double()), targets)


@dataclass(frozen=True)
class _Guess:
    """The motion to correct, and how the spline's coefficients reach its frames."""

    root: Float[Tensor, "frames 3"]
    rotations: Float[Tensor, "frames 22 3 3"]
    basis: Float[Tensor, "frames coefficients"]

    def at(self, frames: np.ndarray) -> "_Guess":
        return _Guess(self.root[frames], self.rotations[frames], self.basis[frames])

    def corrected(
        self, flesh: Anatomy, values: Float[Tensor, "coefficients values"]
    ) -> tuple[Float[Tensor, "frames 3"], Float[Tensor, "frames 22 3 3"]]:
        """Shift the pelvis and turn the bones about world axes."""
        now = (self.basis @ values).unflatten(1, (-1, 3))
        turns = flesh.mixing @ now[:, 1:]
        return self.root + now[:, 0], roma.rotvec_to_rotmat(turns) @ self.rotations


def _approached(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    targets: Targets,
) -> Targets:
    """Hands that come or go keep the way the first guess has for them."""
    palms = joints_of(body, root, rotations)[:, 22:]
    firm = targets.pull[..., None] >= 1.0
    return replace(
        targets,
        palms=np.where(firm, targets.palms, palms),
        pull=np.where(firm[..., 0], 1.0, min_jerk(targets.pull / 0.75)),
    )


def _float(a: np.ndarray) -> Tensor:
    return torch.as_tensor(a, dtype=torch.float32)


def _goals(flesh: Anatomy, root: Float[np.ndarray, "frames 3"], targets: Targets) -> Goals:
    speed = np.linalg.norm(velocity(root[:, :2], FPS), axis=-1)
    calm = np.exp(-((gaussian_filter1d(speed, 5.0, mode="nearest") / _SLOW) ** 2))
    carried = targets.load * targets.pull.max(axis=1)
    middle = targets.barrier.middle.double().numpy()
    T = targets.T_world_object
    centre = T[:, :3, :3] @ middle + T[:, :3, 3]
    standing = _float(targets.planted.astype(float))
    return Goals(
        palms=_float(targets.palms),
        R_world_wrist=_float(targets.R_world_wrist),
        pull=_float(targets.pull),
        ankles=_float(targets.ankles),
        planted=_float(_standing(targets)),
        support=support(_float(targets.soles), standing, _float(targets.centre)),
        balance=_float(targets.balance * calm),
        load=_float(centre * carried[:, None]),
        load_mass=_float(carried),
        T_world_object=_float(T),
        barrier=targets.barrier,
    )


def _standing(targets: Targets) -> Float[np.ndarray, "frames 2"]:
    """1 while heel or ball stands, falling smoothly to 0 in the air."""
    down = (targets.planted[:, :2] | targets.planted[:, 2:]).astype(float)
    return gaussian_filter1d(maximum_filter1d(down, 9, axis=0), 1.5, axis=0, mode="nearest")


def _closeness() -> Float[Tensor, "values values"]:
    """Quadratic form of corrections: turns count against the parent's, so arms follow the trunk."""
    form = torch.diag(torch.tensor([_LEVEL, _LEVEL, _HEIGHT] + [0.0] * (VALUES - 3)) ** 2)
    for k, bone in enumerate(BONES):
        side, _, name = bone.rpartition("_")
        row = torch.zeros(len(BONES))
        row[k] = 1.0
        parent = _PARENT_BONE.get(name)
        if parent is not None:
            row[BONES.index(parent if parent in BONES else f"{side}_{parent}")] = -1.0
        turns = torch.kron(torch.outer(row, row), torch.eye(3)) * _TURN[name] ** 2
        form[3:, 3:] += turns
    return form


def _orthonormal(turned: Float[Tensor, "*b 3 3"]) -> Float[Tensor, "*b 3 3"]:
    """Remove the shear that single precision leaves (two Newton steps to the nearest rotation)."""
    for _ in range(2):
        turned = 1.5 * turned - 0.5 * turned @ turned.mT @ turned
    return turned


def _exact(
    body: BodyModel,
    root: Float[np.ndarray, "frames 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    targets: Targets,
) -> _Pose:
    """Palms that hold and feet that stand exactly on their places."""
    at = torch.as_tensor(root)
    standing = torch.as_tensor(_standing(targets))
    ankles = forward_kinematics(body, at, rotations)[:, _ANKLES]
    goals = ankles + standing[..., None] * (torch.as_tensor(targets.ankles) - ankles)
    for h in (0, 1):
        rotations, _ = reach(body, at, rotations, _LEGS[h], goals[:, h])
        rotations, _ = reach(
            body, at, rotations, _ARMS[h], torch.as_tensor(targets.palms[:, h]),
            weight=torch.as_tensor(targets.pull[:, h]),
        )  # fmt: skip
    return root, rotations.numpy()
