"""Hips and footholds from which a character's legs reach the floor and its arms the object.

Each limb reaches while the hips are within a ball around a point, and a foothold moves as a whole while
its foot stands. So the hips and footholds of the least overstretch are those of a convex problem, and
no foot that stands slides. A foot in the air passes from the shift of one foothold to that of the next.
Shoulders turn towards what arms still do not reach.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation
from torch import Tensor

from omomo_core.body.body_config import LIMB
from omomo_core.body.kinematics import COLLARS, joints_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk, runs

HIPS, _SHOULDERS = (1, 2), tuple(COLLARS.values())
_ARM_STRETCH = 1e4
"""Cost of the squared overstretch of an arm, 1/m2. Where both cannot reach, arms fall short first."""
_LEG_STRETCH = 1e5
"""Cost of the squared overstretch of a leg, 1/m2."""
_ACCELERATION = 0.1
"""Cost of the squared acceleration of the hips' shift, s4/m2."""
_SHIFT = 30.0
"""Cost of the squared shift of the hips, 1/m2."""
_STRIDE = 3.0
"""Cost of the squared shift of a foot beside that of the hips, 1/m2: strides keep their shape."""
_SHORTEST_LEG = 0.2
"""Share of a leg's length below which hips do not sink towards an ankle."""
_COLLAR_TURN = np.radians(25.0)
"""Largest turn of a collar, radians."""
_ITERATIONS = 400
"""Most iterations of the solver."""

_Points = Float[np.ndarray, "frames 3"]
_Pairs = Float[np.ndarray, "frames 2 3"]


@dataclass(frozen=True)
class LimbTargets:
    """Places that left and right limbs of a body are to reach; world, metres."""

    ankles: _Pairs
    stands: Bool[np.ndarray, "frames 2"]
    palms: _Pairs
    hold: Float[np.ndarray, "frames 2"]
    """How firmly a palm holds its place, in [0, 1]."""


def limb_length(body: BodyModel, *chain: int) -> float:
    """Return the length of a chain of joints, metres."""
    rest = body.rest_joints[list(chain)].double()
    return float(rest.diff(dim=0).norm(dim=1).sum())


def leg_length(body: BodyModel) -> float:
    """Return the length of a leg from hip to ankle, metres."""
    return limb_length(body, 1, 4, 7)


def within_reach(
    body: BodyModel,
    root: _Points,
    R: Float[np.ndarray, "frames 22 3 3"],
    targets: LimbTargets,
    fps: float,
) -> tuple[_Points, _Pairs]:
    """Return hips and footholds, moved as little and as smoothly as limbs that are too short need.

    Args:
        body: whose limbs.
        root: pelvis, world, metres.
        R: global rotations of the body joints, which stay.
        targets: of its limbs.
        fps: frames a second.

    Returns:
        The pelvis, from where legs that stand reach, and the ankles.
    """
    joints = joints_of(body, root, R)
    carried = targets.palms - joints[:, 22:24] + joints[:, 20:22]
    problem = _Problem(
        root=torch.from_numpy(root),
        arms=torch.from_numpy(root[:, None] + carried - joints[:, _SHOULDERS]),
        legs=torch.from_numpy(root[:, None] + targets.ankles - joints[:, HIPS]),
        hold=torch.from_numpy(targets.hold),
        stands=torch.from_numpy(targets.stands),
        lengths=(limb_length(body, 16, 18, 20), leg_length(body)),
        fps=fps,
    )
    moves, shifts = _least_stretch(problem, _foothold_blend(targets.stands))
    ankles = targets.ankles + np.pad(shifts, ((0, 0), (0, 0), (0, 1)))
    root = root + moves
    way = joints_of(body, root, R)[:, HIPS] - ankles
    return root - _drop(body, way, targets.stands)[:, None] * [0.0, 0.0, 1.0], ankles


def raised_shoulders(
    body: BodyModel, root: _Points, R: Float[np.ndarray, "frames 22 3 3"], targets: LimbTargets
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Return the rotations with collars turned as far as arms are too short, within limits."""
    joints, turned = joints_of(body, root, R), R.copy()
    wrists = targets.palms - joints[:, 22:24] + joints[:, 20:22]
    arm = LIMB.stretch * limb_length(body, 16, 18, 20)
    for side, (collar, shoulder) in enumerate(COLLARS.items()):
        bone = joints[:, shoulder] - joints[:, collar]
        way = wrists[:, side] - joints[:, collar]
        axis, sizes = np.cross(bone, way), np.linalg.norm([bone, way], axis=-1).clip(min=1e-6)
        cosines = (bone * way).sum(axis=1), ((sizes**2).sum(axis=0) - arm**2) / 2
        now, wanted = np.arccos((np.stack(cosines) / sizes.prod(axis=0)).clip(-1.0, 1.0))
        turn = (now - wanted).clip(0.0, _COLLAR_TURN) * targets.hold[:, side]
        axis *= (turn / np.linalg.norm(axis, axis=1).clip(min=1e-6))[:, None]
        turned[:, collar] = Rotation.from_rotvec(axis).as_matrix() @ R[:, collar]
    return turned


@dataclass(frozen=True)
class _Problem:
    """What hips and footholds are to fit."""

    root: Float[Tensor, "frames 3"]
    """The pelvis as it was."""
    arms: Float[Tensor, "frames 2 3"]
    """Place of the pelvis at which each arm would have no length."""
    legs: Float[Tensor, "frames 2 3"]
    """Place of the pelvis at which each leg would have no length."""
    hold: Float[Tensor, "frames 2"]
    stands: Bool[Tensor, "frames 2"]
    lengths: tuple[float, float]
    """Length of an arm and of a leg, metres."""
    fps: float

    def cost(
        self, moves: Float[Tensor, "frames 3"], shifts: Float[Tensor, "frames 2 2"]
    ) -> Float[Tensor, ""]:
        """Return the cost of shifts of the pelvis, and of the ankles over the floor."""
        root = (self.root + moves)[:, None]
        legs = self.legs + torch.nn.functional.pad(shifts, (0, 1))
        lowest = torch.minimum(
            self.root[:, None, 2], legs[..., 2] + _SHORTEST_LEG * self.lengths[1]
        )
        parts = (
            (_ARM_STRETCH, _overstretch(root - self.arms, self.lengths[0]) * self.hold),
            (_LEG_STRETCH, _overstretch(root - legs, self.lengths[1]) * self.stands),
            (_LEG_STRETCH, (lowest - root[..., 2]).clamp(min=0.0)),
            (_ACCELERATION, moves.diff(n=2, dim=0) * self.fps**2),
            (_SHIFT, moves),
            (_STRIDE, shifts - moves[:, None, :2]),
        )
        return torch.stack([cost * part.square().sum() for cost, part in parts]).sum() / self.fps


_FootholdBlend = tuple[
    Int[Tensor, "frames 2"], Int[Tensor, "frames 2"], Float[Tensor, "frames 2 1"]
]


def _least_stretch(
    problem: _Problem, blend: _FootholdBlend
) -> tuple[_Points, Float[np.ndarray, "frames 2 2"]]:
    """Return the shifts of the pelvis, and of the ankles over the floor, that cost least."""
    before, after, share = blend
    moves = torch.zeros_like(problem.root, requires_grad=True)
    places = moves.new_zeros(int(after.max()) + 1, 2).requires_grad_()
    solver = torch.optim.LBFGS(
        [moves, places], max_iter=_ITERATIONS, history_size=20, tolerance_grad=1e-9,
        tolerance_change=1e-12, line_search_fn="strong_wolfe",
    )  # fmt: skip

    def shifts() -> Float[Tensor, "frames 2 2"]:
        return torch.lerp(places[before], places[after], share)

    def cost() -> Tensor:
        solver.zero_grad()
        total = problem.cost(moves, shifts())
        total.backward()
        return total

    solver.step(cost)
    return moves.detach().numpy(), shifts().detach().numpy()


def _overstretch(way: Float[Tensor, "frames 2 3"], length: float) -> Float[Tensor, "frames 2"]:
    return (torch.linalg.vector_norm(way, dim=-1) - LIMB.stretch * length).clamp(min=0.0)


def _foothold_blend(stands: Bool[np.ndarray, "frames 2"]) -> _FootholdBlend:
    """Return the footholds between which each foot is, and its share of the way from one to the next.

    Footholds are numbered, those of the left foot first.
    """
    along, last, first = np.zeros(stands.shape), np.zeros(stands.shape, int), 0
    for side in range(2):
        spans = list(runs(stands[:, side])) or [(0, len(stands))]
        numbers = first + np.arange(len(spans))
        ends = [frame for start, stop in spans for frame in (start, stop - 1)]
        along[:, side] = np.interp(np.arange(len(stands)), ends, np.repeat(numbers, 2))
        last[:, side] = numbers[-1]
        first += len(spans)
    before = along.astype(int)
    share = min_jerk(along - before)[..., None]
    after = (before + 1).clip(max=last)
    return torch.from_numpy(before), torch.from_numpy(after), torch.from_numpy(share)


def _drop(
    body: BodyModel, way: _Pairs, stands: Bool[np.ndarray, "frames 2"]
) -> Float[np.ndarray, " frames"]:
    """Return how much lower the hips must be for legs that stand to reach; `way` is from ankle to hip."""
    across = np.linalg.norm(way[..., :2], axis=-1)
    high = np.sqrt(((LIMB.stretch * leg_length(body)) ** 2 - across**2).clip(min=0.0))
    need = ((way[..., 2] - high) * stands).max(axis=1).clip(min=0.0)
    # The largest need of the neighbourhood, then smoothed: never less than the need itself.
    near = maximum_filter1d(need, 13, mode="nearest")
    return gaussian_filter1d(near, 2.0, truncate=3.0, mode="nearest")
