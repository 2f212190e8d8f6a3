"""A robot's joints from its targets: one quadratic program a step, frame after frame (mink, DAQP).

Feet count most, then hands, then trunk and pelvis. What a joint may turn from one frame to the next is a
bound of the program, so no limit of place or speed is ever broken; parts of the robot that come near each
other may not come nearer than a margin.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from capture_app.exports.resample import Sampled
from capture_app.robots.robot_model import SIDES, Robot, joint_range, robot_package, site_of
from capture_app.robots.robot_targets import RobotTargets, robot_targets
from omomo_core.body.model import BodyModel


@dataclass(frozen=True)
class RobotSettings:
    """Numbers that shape a robot's motion; costs are per metre and per radian."""

    speed: float = 12.0
    """Fastest joint, radians a second."""
    steps: int = 4
    """Programs a frame."""
    foot_steps: int = 3
    """Programs a frame that end it, of planted feet alone: whatever hands asked for, feet stand."""
    first_steps: int = 60
    """Programs for the first frame, from the easy stance."""
    far: float = 1.0
    """Part of a palm's squared error that damps a program: arms at full reach would swing to and fro."""
    planted: tuple[float, float] = (600.0, 120.0)
    """Costs of the place and the turn of a planted foot."""
    swinging: tuple[float, float] = (60.0, 10.0)
    held: tuple[float, float] = (40.0, 0.6)
    """Costs of a holding hand."""
    free: tuple[float, float] = (4.0, 0.4)
    pelvis: tuple[float, float] = (1.5, 1.0)
    torso: tuple[float, float] = (0.0, 1.0)
    elbow: tuple[float, float] = (0.3, 0.0)
    posture: float = 0.03
    """Cost of a joint's way from the easy stance."""
    still: float = 0.1
    """Cost of a joint's way from the frame before."""
    damping: float = 0.05
    """Cost of a step's length; without it programs overshoot where legs are nearly straight."""
    longest: float = 0.15
    """Longest step of a joint in one program, radians."""
    margin: float = 0.008
    """Metres that parts of the robot stay apart."""
    parting: float = 0.005
    """Metres by which one program moves parts away from each other that are within the margin."""
    seen: float = 0.08
    """Metres from which parts of the robot look at each other."""


class SelfCollision:
    """Pairs of geoms of a robot that must stay apart, as rows of a quadratic program."""

    def __init__(self, robot: Robot, settings: RobotSettings) -> None:
        self._mujoco = robot_package("mujoco")
        self._model, self._settings = robot.model, settings
        self.pairs = _pairs(robot, self._mujoco)
        self._reach = robot.model.geom_rbound[self.pairs].sum(axis=1)

    def near(self, data: Any, seen: float) -> list[tuple[int, int, float, np.ndarray]]:
        """Return geoms nearer than `seen`: their numbers, distance, and the points nearest each other."""
        x = data.geom_xpos
        apart = np.linalg.norm(x[self.pairs[:, 0]] - x[self.pairs[:, 1]], axis=1) - self._reach
        found: list[tuple[int, int, float, np.ndarray]] = []
        for a, b in self.pairs[apart < seen].tolist():
            points = np.zeros(6)
            distance = self._mujoco.mj_geomDistance(self._model, data, a, b, seen, points)
            if distance < seen:
                found.append((a, b, distance, points.reshape(2, 3)))
        return found

    def rows(self, data: Any) -> tuple[Float[np.ndarray, "rows dofs"], Float[np.ndarray, " rows"]]:
        """Return G and h of G Δq <= h: what is near stays outside the margin, or goes toward its edge."""
        model, jacobians, room = self._model, [], []
        for a, b, distance, (p, q) in self.near(data, self._settings.seen):
            length = np.linalg.norm(q - p)
            if length < 1e-9:
                continue
            ends = np.zeros((2, 3, model.nv))
            for end, geom, point in zip(ends, (a, b), (p, q), strict=True):
                self._mujoco.mj_jac(model, data, end, None, point, model.geom_bodyid[geom])
            toward = (p - q) / length * np.sign(distance)
            jacobians.append(toward @ (ends[1] - ends[0]))
            room.append(max(distance - self._settings.margin, -self._settings.parting))
        return np.array(jacobians).reshape(-1, model.nv), np.array(room)


def _pairs(robot: Robot, mujoco: Any) -> Int[np.ndarray, "pairs 2"]:
    """Return geoms that collide, of bodies of different limbs, three joints or more from each other,
    and apart in the easy stance."""
    model = robot.model
    data = mujoco.MjData(model)
    data.qpos[:] = robot.standing
    mujoco.mj_kinematics(model, data)
    limbs = [_limb(robot, k) for k in range(model.nbody)]
    solid = np.flatnonzero((model.geom_contype > 0) | (model.geom_conaffinity > 0))
    out: list[tuple[int, int]] = []
    for i, a in enumerate(solid.tolist()):
        for b in solid[i + 1 :].tolist():
            first, second = int(model.geom_bodyid[a]), int(model.geom_bodyid[b])
            if not first or not second or limbs[first] == limbs[second]:
                continue
            if _joints_between(model, first, second) < 3:
                continue
            if mujoco.mj_geomDistance(model, data, a, b, 0.1, None) > 0.0:
                out.append((a, b))
    return np.array(out, int).reshape(-1, 2)


def _limb(robot: Robot, body: int) -> int:
    starts = [robot.model.body(name).id for name in (*robot.map.arms, *robot.map.legs)]
    above = _above(robot.model, body)
    return next((k for k, start in enumerate(starts) if start in above), -1)


def _above(model: Any, body: int) -> list[int]:
    path = [body]
    while path[-1]:
        path.append(int(model.body_parentid[path[-1]]))
    return path


def _joints_between(model: Any, a: int, b: int) -> int:
    apart = set(_above(model, a)) ^ set(_above(model, b))
    return sum(int(model.body_jntnum[body]) for body in apart)


class RobotSolver:
    """Solves frame after frame, each from the one before."""

    def __init__(self, robot: Robot, targets: RobotTargets, settings: RobotSettings) -> None:
        self._mink, self._qp = robot_package("mink"), robot_package("qpsolvers")
        self._robot, self._targets, self._settings = robot, targets, settings
        self._configuration = self._mink.Configuration(robot.model, q=_beginning(robot, targets))
        self.collision = SelfCollision(robot, settings)
        self._poses = _poses(targets)
        self._tasks = {
            name: self._mink.FrameTask(
                site_of(name), "site", 0.0, 0.0, lm_damping=settings.far if "palm" in name else 0.0
            )
            for name in self._poses
        }
        self._set_costs("pelvis", settings.pelvis)
        self._set_costs("torso", settings.torso)
        free = np.r_[np.zeros(6), np.ones(robot.model.nv - 6)]
        self._posture = self._mink.PostureTask(robot.model, cost=settings.posture * free)
        self._posture.set_target(robot.standing)
        self._still = self._mink.PostureTask(robot.model, cost=settings.still * free)
        self._range = joint_range(robot.model)

    def solve(self) -> Float[np.ndarray, "frames qpos"]:
        """Return the joints of every frame: root x, y, z, quaternion (w first), then radians."""
        settings, frames = self._settings, len(self._targets.pelvis)
        out = np.empty((frames, self._robot.model.nq))
        self._aim(0)
        self._still.set_target(self._robot.standing)
        for _ in range(settings.first_steps):
            self._step(*self._range)
        for frame in range(frames):
            self._aim(frame)
            before = np.array(self._configuration.q)
            self._still.set_target(before)
            turn = settings.speed / self._targets.fps * (frame > 0 or np.inf)
            low = np.maximum(self._range[0], before[7:] - turn)
            high = np.minimum(self._range[1], before[7:] + turn)
            for _ in range(settings.steps):
                self._step(low, high)
            for _ in range(settings.foot_steps):
                self._step(low, high, feet_only=True)
            out[frame] = self._configuration.q
        return out

    def _aim(self, frame: int) -> None:
        """Set targets and costs of a frame."""
        settings, targets = self._settings, self._targets
        for name, task in self._tasks.items():
            task.transform_target_to_world = self._mink.SE3(wxyz_xyz=self._poses[name][frame])
        for k, side in enumerate(SIDES):
            foot = settings.planted if targets.planted[frame, k] else settings.swinging
            hand = settings.held if targets.held[frame, k] else settings.free
            self._set_costs(f"{side}_foot", foot)
            self._set_costs(f"{side}_palm", hand)
            self._set_costs(f"{side}_elbow", settings.elbow)

    def _set_costs(self, name: str, costs: tuple[float, float]) -> None:
        self._tasks[name].cost[:3], self._tasks[name].cost[3:] = costs

    def _step(
        self,
        low: Float[np.ndarray, " joints"],
        high: Float[np.ndarray, " joints"],
        *,
        feet_only: bool = False,
    ) -> None:
        """Go once to the minimum of the program around the present joints, within the bounds."""
        configuration = self._configuration
        tasks = [*self._tasks.values(), self._posture, self._still]
        if feet_only:
            tasks = [self._tasks["left_foot"], self._tasks["right_foot"]]
        problem = self._mink.build_ik(
            configuration, tasks, 1.0, damping=self._settings.damping, limits=[]
        )
        G, h = self.collision.rows(configuration.data)
        if len(h):
            problem.G, problem.h = G, h
        joints, longest = configuration.q[7:], self._settings.longest
        problem.lb = np.r_[np.full(6, -longest), np.clip(low - joints, -longest, 0.0)]
        problem.ub = np.r_[np.full(6, longest), np.clip(high - joints, 0.0, longest)]
        solution = self._qp.solve_problem(problem, solver="daqp")
        if not solution.found and len(h):
            # Joints at their bounds cannot part what is too near: then it comes no nearer.
            problem.h = np.maximum(h, 0.0)
            solution = self._qp.solve_problem(problem, solver="daqp")
        if solution.found and solution.x is not None:
            # The solver keeps bounds up to a tolerance only.
            step = np.clip(solution.x, problem.lb, problem.ub)
            configuration.integrate_inplace(step, 1.0)


def _beginning(robot: Robot, targets: RobotTargets) -> Float[np.ndarray, " qpos"]:
    """Return the easy stance at the first place of the pelvis, turned as it is about the upright axis."""
    q = robot.standing.copy()
    q[:2] = targets.pelvis[0, :2]
    ahead = targets.R_pelvis[0, :2, 0]
    yaw = np.arctan2(ahead[1], ahead[0])
    q[3:7] = [np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
    return q


def _poses(targets: RobotTargets) -> dict[str, Float[np.ndarray, "frames 7"]]:
    """Return quaternion (w first) and place of each frame of the map that is aimed at."""
    ahead = np.tile(np.eye(3), (len(targets.pelvis), 1, 1))
    poses = {
        "pelvis": _pose(targets.R_pelvis, targets.pelvis),
        "torso": _pose(targets.R_torso, targets.pelvis),
    }
    for k, side in enumerate(SIDES):
        poses[f"{side}_foot"] = _pose(targets.R_feet[:, k], targets.ankles[:, k])
        poses[f"{side}_palm"] = _pose(targets.R_palms[:, k], targets.palms[:, k])
        poses[f"{side}_elbow"] = _pose(ahead, targets.elbows[:, k])
    return poses


def _pose(
    R: Float[np.ndarray, "frames 3 3"], place: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 7"]:
    return np.hstack([np.roll(Rotation.from_matrix(R).as_quat(), 1, axis=1), place])


@dataclass(frozen=True)
class RobotMotion:
    """A robot's motion, and how well it keeps to its targets."""

    robot: Robot
    targets: RobotTargets
    qpos: Float[np.ndarray, "frames qpos"]
    """Root x, y, z in metres, quaternion (w first), joints in radians in the model's order."""
    miss: Float[np.ndarray, "frames 2"]
    """Metres from each palm to its place on the object; 0 while it is free."""
    ankles: Float[np.ndarray, "frames 2 3"]
    apart: Float[np.ndarray, " frames"]
    """Least distance between parts of the robot, metres; at most what the solver sees."""

    @property
    def planted_speed(self) -> Float[np.ndarray, " steps"]:
        """Metres a frame of each ankle, from every planted frame to the next planted one."""
        both = self.targets.planted[1:] & self.targets.planted[:-1]
        return np.linalg.norm(np.diff(self.ankles, axis=0), axis=2)[both]

    @property
    def joint_speed(self) -> float:
        """Speed of the fastest joint, radians a second."""
        return float(np.abs(np.diff(self.qpos[:, 7:], axis=0)).max(initial=0.0) * self.targets.fps)


def solve_robot(
    robot: Robot, targets: RobotTargets, settings: RobotSettings | None = None
) -> RobotMotion:
    """Return the robot's motion for targets.

    Args:
        robot: who moves.
        targets: from `robot_targets`.
        settings: the usual ones if not given.
    """
    solver = RobotSolver(robot, targets, settings or RobotSettings())
    return measured(robot, targets, solver.solve(), solver.collision)


def measured(
    robot: Robot,
    targets: RobotTargets,
    qpos: Float[np.ndarray, "frames qpos"],
    collision: SelfCollision,
) -> RobotMotion:
    """Return a motion with its distances, by forward kinematics of its joints."""
    mujoco = robot_package("mujoco")
    data, frames = mujoco.MjData(robot.model), len(qpos)
    places = {part: np.empty((frames, 2, 3)) for part in ("palm", "foot")}
    apart = np.empty(frames)
    for frame, q in enumerate(qpos):
        data.qpos[:] = q
        mujoco.mj_kinematics(robot.model, data)
        for part, at in places.items():
            at[frame] = [data.site(site_of(f"{side}_{part}")).xpos for side in SIDES]
        near = collision.near(data, 0.02)
        apart[frame] = min((distance for _, _, distance, _ in near), default=0.02)
    off: Bool[np.ndarray, "frames 2"] = targets.held
    miss = np.where(off, np.linalg.norm(places["palm"] - targets.palms, axis=2), 0.0)
    return RobotMotion(robot, targets, qpos, miss, places["foot"], apart)


def robot_motion(robot: Robot, sampled: Sampled, body: BodyModel) -> RobotMotion:
    """Return the motion of a robot for a person's.

    Args:
        robot: who moves.
        sampled: the person and the object at the rate of the files.
        body: whose bones the motion moves.
    """
    return solve_robot(robot, robot_targets(robot, sampled, body))
