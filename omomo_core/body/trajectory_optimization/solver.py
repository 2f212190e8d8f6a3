"""Gauss-Newton over a whole sequence on spline corrections, and the approach of hands to the object."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float, Int
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics, joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import (
    BONES,
    PARENT_BONES,
    VALUES,
    Anatomy,
    FrameTargets,
    SolverTargets,
    build_anatomy,
    limit_arm_speed,
    linearise,
    support_extent,
)
from omomo_core.body.trajectory_optimization.solver_config import SOLVER, TURN_CLOSENESS
from omomo_core.geometry.runs import min_jerk
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS
from omomo_core.skeleton import joint
from omomo_core.system import one_blas_thread

_ORDER = 4
"""Coefficients that touch one frame."""


@dataclass(frozen=True)
class Spline:
    """A uniform cubic B-spline with a coefficient every `spacing` frames."""

    frames: int
    spacing: float

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return max(1, int(np.ceil((self.frames - 1) / self.spacing))) + _ORDER - 1

    def basis(self, frames: Float[np.ndarray, " times"]) -> Float[Tensor, "times coefficients"]:
        """Return the weight of every coefficient at some frames."""
        return self._weights(frames, 0)

    def bending(self) -> Float[Tensor, "coefficients coefficients"]:
        """Return the quadratic form of the mean squared second derivative in time, per frame^4."""
        B = self._weights(np.arange(self.frames, dtype=float), 2)
        return B.T @ B / self.frames

    def _weights(
        self, frames: Float[np.ndarray, " times"], derivative: int
    ) -> Float[Tensor, "times coefficients"]:
        at = frames / self.spacing
        first = np.minimum(np.floor(at).astype(int), self.count - _ORDER)
        u = (at - first)[:, None]
        if derivative == 0:
            w = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
            scale = 1 / 6
        else:
            w = [1 - u, 3 * u - 2, 1 - 3 * u, u]
            scale = 1 / self.spacing**2
        out = np.zeros((len(frames), self.count))
        rows = np.arange(len(frames))[:, None]
        out[rows, first[:, None] + np.arange(_ORDER)] = np.concatenate(w, axis=1) * scale
        return torch.as_tensor(out, dtype=torch.float32)


def gauss_newton_step(
    basis: Float[Tensor, "times coefficients"],
    hessian: Float[Tensor, "times n n"],
    gradient: Float[Tensor, "times n"],
    bending: Float[Tensor, "coefficients coefficients"],
    stiffness: Float[Tensor, "n n"],
    now: Float[Tensor, "coefficients n"],
) -> Float[Tensor, "coefficients n"]:
    """Return one Gauss-Newton step of the coefficients.

    Args:
        basis: weights of the coefficients at the frames that were looked at.
        hessian: of the cost of each frame in the value of the spline there.
        gradient: likewise.
        bending: quadratic form of the spline's second derivative.
        stiffness: its weight, a quadratic form of the n values.
        now: the present coefficients.
    """
    count, n = now.shape
    bands = _pairs(basis).mT.reshape(-1, len(basis)) @ hessian.flatten(1)
    bands = bands.view(_ORDER, count, n, n)
    stiff = torch.stack([_filled(bending.diagonal(k), count) for k in range(_ORDER)])
    bands.add_(stiff[..., None, None] * stiffness)
    slope = basis.T @ gradient + (bending @ now) @ stiffness
    with one_blas_thread():
        step = solveh_banded(
            _lower(bands), -slope.flatten().double().numpy(), lower=True, check_finite=False,
            overwrite_ab=True, overwrite_b=True,
        )  # fmt: skip
    return torch.as_tensor(step, dtype=now.dtype).reshape(count, n)


def _pairs(basis: Float[Tensor, "times coefficients"]) -> Float[Tensor, "order times coefficients"]:
    """Return the weight of each coefficient times that of the coefficient k after it, for each k."""
    count = basis.shape[1]
    return torch.stack([basis * _filled(basis[:, k:], count) for k in range(_ORDER)])


def _filled(x: Float[Tensor, "*b some"], count: int) -> Float[Tensor, "*b count"]:
    """Return `x` with zeros appended up to `count` entries."""
    return torch.nn.functional.pad(x, (0, count - x.shape[-1]))


def _lower(bands: Float[Tensor, "order count n n"]) -> Float[np.ndarray, "rows unknowns"]:
    """Return a symmetric block-banded matrix in LAPACK's lower band storage, with the ridge.

    Column (i, a) holds the entries (i + k, b) below it, which are entry (a, b) of band k.
    """
    order, count, n, _ = bands.shape
    column = bands.permute(1, 2, 0, 3).reshape(count, n, order * n).numpy()
    # Columns lie one after the other, as LAPACK wants them: nothing is copied again.
    out = np.empty((count, n, order * n))
    for a in range(n):
        out[:, a, : order * n - a] = column[:, a, a:]
        out[:, a, order * n - a :] = 0.0
    out[:, :, 0] += SOLVER.ridge
    return out.reshape(count * n, order * n).T


_TURN: dict[str, float] = asdict(TURN_CLOSENESS)
"""Closeness of each bone's turn against its parent, 1 / rad."""
_ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")
_LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")
_ANKLES = (joint("left_ankle"), joint("right_ankle"))

_Pose = tuple[Float[np.ndarray, "*b frames 3"], Float[np.ndarray, "*b frames 22 3 3"]]


def optimise_trajectory(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
    targets: SolverTargets,
    *,
    anatomy: Anatomy | None = None,
    free: Float[np.ndarray, " frames"] | None = None,
    steps: int = 4,
    on_progress: Callable[[float], None] = lambda done: None,
) -> _Pose:
    """Return an initial motion corrected to be physically and anatomically plausible.

    Smooth corrections of pelvis, trunk, shoulder girdle, arms and legs minimise a weighted sum: palms and
    planted feet off their targets, joint ranges, flesh inside the object, the weight beside the feet, and
    distance from the initial motion. Then arms and legs are solved exactly. Several clips with the same
    object and of the same length are solved side by side.

    Args:
        body: whose bones, flesh and weight to use.
        root: pelvis of the initial motion, world, metres.
        rotations: its global R_world_joint.
        targets: of hands and feet, and the obstacle; `approach.py` says where hands are that come or go.
        anatomy: collision spheres; the coarse ones of the synthesis if not given.
        free: how far each frame may be corrected, from 0 (not at all) to 1.
        steps: Gauss-Newton iterations.
        on_progress: called with the fraction done after each iteration.

    Returns:
        Root and rotations; held palms and planted feet are exact where the limbs reach.
    """
    clips, frames = root.shape[:-2], root.shape[-2]
    rotations = _each(limit_arm_speed, rotations)
    anatomy, spline = anatomy or build_anatomy(body), Spline(frames, SOLVER.coefficient_spacing)
    basis = spline.basis(np.arange(frames, dtype=float))
    basis = basis if free is None else basis * _float(free)[:, None]
    initial = _InitialMotion(_float(root), _float(rotations), basis)
    seen = np.unique(np.append(np.arange(0, frames, SOLVER.stride), frames - 1))
    values = torch.zeros(*clips, spline.count, VALUES)
    near, bending = _closeness(), spline.bending() * len(seen)
    stiffness = SOLVER.smoothness**2 * near
    part, frame_targets = initial.at(seen), _frame_targets(anatomy, root, targets, seen)
    for step_number in range(1, steps + 1):
        at, turned = part.corrected(anatomy, values)
        J, r = linearise(anatomy, frame_targets, at.flatten(0, -2), turned.flatten(0, -4))
        hessian = (J.mT @ J + near).view(*clips, len(seen), VALUES, VALUES)
        gradient = (J.mT @ r[..., None]).view(*clips, len(seen), VALUES)
        gradient = gradient + (part.basis @ values) @ near
        for clip in np.ndindex(clips):
            step = gauss_newton_step(
                part.basis, hessian[clip], gradient[clip], bending, stiffness, values[clip]
            )
            values[clip] += step.clamp(-SOLVER.longest_step, SOLVER.longest_step)
        on_progress(step_number / steps)
    moved, turned = initial.corrected(anatomy, values)
    shift = (moved - initial.root).double().numpy()
    return _solve_limbs(body, root + shift, _orthonormal(turned.double()), targets)


@dataclass(frozen=True)
class _InitialMotion:
    """The motion to correct, and how the spline's coefficients reach its frames."""

    root: Float[Tensor, "*b frames 3"]
    rotations: Float[Tensor, "*b frames 22 3 3"]
    basis: Float[Tensor, "frames coefficients"]

    def at(self, frames: np.ndarray) -> "_InitialMotion":
        return _InitialMotion(
            self.root[..., frames, :], self.rotations[..., frames, :, :, :], self.basis[frames]
        )

    def corrected(
        self, anatomy: Anatomy, values: Float[Tensor, "*b coefficients values"]
    ) -> tuple[Float[Tensor, "*b frames 3"], Float[Tensor, "*b frames 22 3 3"]]:
        """Return the motion with the pelvis shifted and the bones turned about world axes."""
        now = (self.basis @ values).unflatten(-1, (-1, 3))
        turns = anatomy.mixing @ now[..., 1:, :]
        return self.root + now[..., 0, :], roma.rotvec_to_rotmat(turns) @ self.rotations


def _each(
    change: Callable[[np.ndarray], np.ndarray], rotations: Float[np.ndarray, "*b frames 22 3 3"]
) -> Float[np.ndarray, "*b frames 22 3 3"]:
    """Return the rotations with `change` applied to each clip."""
    clips = rotations.reshape(-1, *rotations.shape[-4:])
    return np.stack([change(clip) for clip in clips]).reshape(rotations.shape)


def _float(a: np.ndarray) -> Tensor:
    return torch.as_tensor(a, dtype=torch.float32)


def _frame_targets(
    anatomy: Anatomy,
    root: Float[np.ndarray, "*b frames 3"],
    targets: SolverTargets,
    seen: Int[np.ndarray, " seen"],
) -> FrameTargets:
    """Return the targets of all clips at the evaluated frames, one clip after another."""
    clips = root.shape[:-2]

    def at(x: Float[np.ndarray, "..."], beside: int) -> Tensor:
        """Return an array at the evaluated frames of all clips; it has `beside` axes after that of frames."""
        x = np.broadcast_to(x, (*clips, *x.shape[x.ndim - beside - 1 :]))
        return _float(x.take(seen, axis=len(clips))).flatten(0, -beside - 1)

    level = np.moveaxis(root[..., :2], -2, 0)
    speed = np.moveaxis(np.linalg.norm(velocity(level, FPS), axis=-1), 0, -1)
    slow = np.exp(
        -(
            (
                gaussian_filter1d(speed, SOLVER.pelvis_speed_smoothing, mode="nearest")
                / SOLVER.slow_pelvis
            )
            ** 2
        )
    )
    carried = targets.carried_mass * targets.hold.max(axis=-1)
    T, middle = targets.T_world_object, targets.obstacle.middle.double().numpy()
    centre = T[:, :3, :3] @ middle + T[:, :3, 3]
    planted = at(targets.planted.astype(float), 1)
    return FrameTargets(
        palms=at(targets.palms, 2),
        R_world_wrist=at(targets.R_world_wrist, 3),
        hold=at(targets.hold, 1),
        ankles=at(targets.ankles, 2),
        planted=at(_stance(targets), 1),
        support=support_extent(at(targets.soles, 2), planted, at(targets.centre, 1)),
        balance=at(targets.balance * slow, 0),
        carried_moment=at(centre * carried[..., None], 1),
        carried_mass=at(carried, 0),
        T_world_object=at(T, 2),
        obstacle=targets.obstacle,
    )


def _stance(targets: SolverTargets) -> Float[np.ndarray, "*b frames 2"]:
    """Return how firmly each foot stands, on heel or ball, in [0, 1]."""
    return firmness(targets.planted[..., :2] | targets.planted[..., 2:])


def firmness(standing: Bool[np.ndarray, "*b frames 2"]) -> Float[np.ndarray, "*b frames 2"]:
    """Return 1 while a foot stands, falling smoothly to 0 in the air."""
    down = maximum_filter1d(standing.astype(float), SOLVER.stance_window, axis=-2)
    return gaussian_filter1d(down, SOLVER.stance_smoothing, axis=-2, mode="nearest")


def _closeness() -> Float[Tensor, "values values"]:
    """Return the quadratic form of corrections; turns count relative to the parent's, so arms follow."""
    form = torch.diag(
        torch.tensor(
            [SOLVER.level_closeness, SOLVER.level_closeness, SOLVER.height_closeness]
            + [0.0] * (VALUES - 3)
        )
        ** 2
    )
    for k, bone in enumerate(BONES):
        row = torch.zeros(len(BONES))
        row[k] = 1.0
        if bone in PARENT_BONES:
            row[BONES.index(PARENT_BONES[bone])] = -1.0
        turns = (
            torch.kron(torch.outer(row, row), torch.eye(3)) * _TURN[bone.rpartition("_")[2]] ** 2
        )
        form[3:, 3:] += turns
    return form


def _orthonormal(turned: Float[Tensor, "*b 3 3"]) -> Float[Tensor, "*b 3 3"]:
    """Return rotations without the shear that single precision leaves (two Newton steps)."""
    for _ in range(2):
        turned = 1.5 * turned - 0.5 * turned @ turned.mT @ turned
    return turned


def _solve_limbs(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[Tensor, "*b frames 22 3 3"],
    targets: SolverTargets,
) -> _Pose:
    """Return the motion with holding palms and standing feet exactly on their targets."""
    at = torch.as_tensor(root)
    standing = torch.as_tensor(_stance(targets))
    ankles = forward_kinematics(body, at, rotations)[..., _ANKLES, :]
    ankle_targets = ankles + standing[..., None] * (torch.as_tensor(targets.ankles) - ankles)
    palms, hold = torch.as_tensor(targets.palms), torch.as_tensor(targets.hold)
    for h in (0, 1):
        rotations, _ = reach(body, at, rotations, _LEGS[h], ankle_targets[..., h, :])
        rotations, _ = reach(
            body, at, rotations, _ARMS[h], palms[..., h, :], weight=hold[..., h].contiguous()
        )
    return root, rotations.numpy()


def keep_approach(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
    targets: SolverTargets,
) -> SolverTargets:
    """Return targets in which hands that come or go stay on the path of the initial motion.

    It must reach what it holds, as synthetic people do: where it does not, the path jumps.

    Args:
        body: whose hands.
        root: pelvis of the initial motion, world, metres.
        rotations: its global R_world_joint.
        targets: to change.
    """
    firm = targets.hold >= 1.0
    palms = np.where(firm[..., None], targets.palms, _palms(body, root, rotations))
    return replace(targets, palms=palms, hold=np.where(firm, 1.0, _pull(targets)))


def blend_approach(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
    targets: SolverTargets,
) -> SolverTargets:
    """Return targets in which hands come from the path of the initial motion, and go back to it.

    Sampled people often do not reach what they hold before they are optimised. The arguments are those of
    `keep_approach`.
    """
    palms = _palms(body, root, rotations)
    blended = palms + targets.hold[..., None] * (targets.palms - palms)
    return replace(targets, palms=blended, hold=_pull(targets))


def _palms(
    body: BodyModel,
    root: Float[np.ndarray, "*b frames 3"],
    rotations: Float[np.ndarray, "*b frames 22 3 3"],
) -> Float[np.ndarray, "*b frames 2 3"]:
    return joints_of(body, root, rotations)[..., 22:, :]


def _pull(targets: SolverTargets) -> Float[np.ndarray, "*b frames 2"]:
    """Return how firmly hands are kept on their path: wholly, long before they touch."""
    return min_jerk(targets.hold / SOLVER.approach_hold)
