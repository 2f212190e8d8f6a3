"""Targets: where a robot's pelvis, feet and hands belong in each frame of a person's motion.

The object keeps its size and its place. While hands hold, the robot's palms belong where the person's are;
everything else is the person scaled to the robot's legs about the place where they hold. So the way to
the object shrinks, and the way with the object does not.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from capture_app.exports.resample import ANKLES, Sampled
from capture_app.robots.robot_model import Robot, robot_package, site_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import frames_away, min_jerk, runs
from omomo_core.skeleton import joint

_UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""R_joint_frame of pelvis, trunk and feet: forward is our joints' z, left their x, up their y."""
_HANDS = (np.eye(3), np.diag([-1.0, -1.0, 1.0]))
"""R_joint_frame of the left and the right hand: along the fingers, then up toward the thumb."""
_REACHING = 0.6
"""Seconds before and after a hold in which a hand goes over from the scaled to the true place."""
_SETTLING = 0.2
"""Seconds over which the place that the person is scaled about goes from one hold to another."""
_SHORTEST = 3
"""Frames of the shortest stance."""


@dataclass(frozen=True)
class RobotTargets:
    """Poses for frames of the robot's map, in the world, metres; index 0 is left, 1 right."""

    fps: float
    scale: float
    """Ratio of the robot's legs to the person's."""
    pelvis: Float[np.ndarray, "frames 3"]
    R_pelvis: Float[np.ndarray, "frames 3 3"]
    R_torso: Float[np.ndarray, "frames 3 3"]
    palms: Float[np.ndarray, "frames 2 3"]
    R_palms: Float[np.ndarray, "frames 2 3 3"]
    held: Bool[np.ndarray, "frames 2"]
    elbows: Float[np.ndarray, "frames 2 3"]
    ankles: Float[np.ndarray, "frames 2 3"]
    R_feet: Float[np.ndarray, "frames 2 3 3"]
    """Level: the sole is parallel to the floor."""
    planted: Bool[np.ndarray, "frames 2"]


def robot_targets(robot: Robot, sampled: Sampled, body: BodyModel) -> RobotTargets:
    """Return where the robot's frames belong.

    Args:
        robot: who shall move.
        sampled: the person and the object at the rate of the files.
        body: whose bones the motion moves.
    """
    human, fps = sampled.human, sampled.fps
    joints, R = human.joints.astype(np.float64), human.rotations.astype(np.float64)
    rest = body.rest_joints.double().numpy()
    legs = _standing(robot)
    ankle_height = _ankle_height(joints)
    scale = legs.height / float(rest[0, 1] - rest[ANKLES[0], 1])
    held = human.hand_contact > 0.5
    about = _places_of_holds(joints[:, 22:], held, sampled)
    pelvis = _about(joints[:, 0], about, scale, ankle_height, robot.map.sole)
    R_pelvis = R[:, 0] @ _UPRIGHT
    widened = legs.width - scale * float(rest[joint("left_hip"), 0] - rest[joint("right_hip"), 0])
    planted = _stances(human.foot_contact[:, :2] > 0.5)
    lifted = scale * np.maximum(joints[:, ANKLES, 2] - ankle_height, 0.0)
    ankles, R_feet = _feet(joints, R, pelvis, lifted, scale, planted, widened, fps)
    ankles[..., 2] = robot.map.sole + np.maximum(ankles[..., 2], 0.0)
    near = np.stack([frames_away(held[:, k]) for k in range(2)], axis=1) / (_REACHING * fps)
    scaled = pelvis[:, None] + scale * (joints[:, 22:] - joints[:, :1])
    palms = joints[:, 22:] + min_jerk(near)[..., None] * (scaled - joints[:, 22:])
    elbows = [joint("left_elbow"), joint("right_elbow")]
    wrists = [joint("left_wrist"), joint("right_wrist")]
    return RobotTargets(
        fps=fps,
        scale=scale,
        pelvis=pelvis,
        R_pelvis=R_pelvis,
        R_torso=R[:, joint("spine3")] @ _UPRIGHT,
        palms=palms,
        R_palms=np.stack([R[:, w] @ _HANDS[k] for k, w in enumerate(wrists)], axis=1),
        held=held,
        elbows=pelvis[:, None] + scale * (joints[:, elbows] - joints[:, :1]),
        ankles=ankles,
        R_feet=R_feet,
        planted=planted,
    )


@dataclass(frozen=True)
class _Legs:
    """A robot's legs when its joints are zero."""

    height: float
    """From the ankles up to the pelvis' point, metres."""
    width: float
    """From the right ankle to the left one."""


def _standing(robot: Robot) -> _Legs:
    mujoco = robot_package("mujoco")
    data = mujoco.MjData(robot.model)
    mujoco.mj_kinematics(robot.model, data)
    at = {name: data.site(site_of(name)).xpos for name in robot.map.frames}
    height = at["pelvis"][2] - at["left_foot"][2]
    return _Legs(float(height), float(np.linalg.norm((at["left_foot"] - at["right_foot"])[:2])))


def _ankle_height(joints: Float[np.ndarray, "frames 24 3"]) -> float:
    """Return how high the ankles are when the person stands."""
    return float(np.percentile(joints[:, ANKLES, 2].min(axis=1), 10))


def _places_of_holds(
    palms: Float[np.ndarray, "frames 2 3"], held: Bool[np.ndarray, "frames 2"], sampled: Sampled
) -> Float[np.ndarray, "frames 2"]:
    """Return the place on the floor below the holding palms; between holds it goes from one to the next."""
    frames = np.flatnonzero(held.any(axis=1))
    if not len(frames):
        return np.tile(sampled.object_motion.T_world_object[:, :2, 3].mean(axis=0), (len(held), 1))
    share = held[frames] / held[frames].sum(axis=1, keepdims=True)
    below = np.einsum("fh,fhx->fx", share, palms[frames, :, :2])
    t = np.arange(len(held))
    all_frames = np.stack([np.interp(t, frames, below[:, k]) for k in range(2)], axis=1)
    return gaussian_filter1d(all_frames, _SETTLING * sampled.fps, axis=0, mode="nearest")


def _about(
    points: Float[np.ndarray, "frames 3"],
    place: Float[np.ndarray, "frames 2"],
    scale: float,
    ankle_height: float,
    sole: float,
) -> Float[np.ndarray, "frames 3"]:
    """Scale points about a place on the floor, heights from the ankles up."""
    out = np.empty_like(points)
    out[:, :2] = place + scale * (points[:, :2] - place)
    out[:, 2] = sole + scale * (points[:, 2] - ankle_height)
    return out


def _stances(contact: Bool[np.ndarray, "frames 2"]) -> Bool[np.ndarray, "frames 2"]:
    out = np.zeros_like(contact)
    for side in range(2):
        for start, stop in runs(contact[:, side]):
            out[start:stop, side] = stop - start >= _SHORTEST
    return out


def _feet(
    joints: Float[np.ndarray, "frames 24 3"],
    R: Float[np.ndarray, "frames 22 3 3"],
    pelvis: Float[np.ndarray, "frames 3"],
    lifted: Float[np.ndarray, "frames 2"],
    scale: float,
    planted: Bool[np.ndarray, "frames 2"],
    widened: float,
    fps: float,
) -> tuple[Float[np.ndarray, "frames 2 3"], Float[np.ndarray, "frames 2 3 3"]]:
    """Return ankles (heights over where they stand) and level feet, each still while it is planted."""
    left = R[:, 0, :2, 0] / np.maximum(np.linalg.norm(R[:, 0, :2, 0], axis=1, keepdims=True), 1e-6)
    ankles = joints[:, ANKLES].copy()
    ankles[..., :2] = pelvis[:, None, :2] + scale * (ankles[..., :2] - joints[:, :1, :2])
    ankles[..., :2] += left[:, None] * np.array([0.5, -0.5])[:, None] * widened
    ahead = R[:, ANKLES][..., :2, 2]
    yaw = np.unwrap(np.arctan2(ahead[..., 1], ahead[..., 0]), axis=0)
    yaw = gaussian_filter1d(yaw, 0.05 * fps, axis=0, mode="nearest")
    for side in range(2):
        path = np.column_stack([ankles[:, side, :2], lifted[:, side], yaw[:, side]])
        path = _still(path, runs(planted[:, side]))
        ankles[:, side], yaw[:, side] = path[:, :3], path[:, 3]
    turns = Rotation.from_euler("z", yaw.reshape(-1, 1)).as_matrix().reshape(*yaw.shape, 3, 3)
    return ankles, turns


def _still(
    path: Float[np.ndarray, "frames 4"], stances: list[tuple[int, int]]
) -> Float[np.ndarray, "frames 4"]:
    """Hold each stance at its middle, and ease what lies between from one to the next.

    Args:
        path: x, y, height over the stand, and yaw of a foot; the height of a stance is 0.
        stances: first frame and the one after the last.
    """
    if not stances:
        return path
    out, t = path.copy(), np.arange(len(path))
    spots = [path[start:stop].mean(axis=0) * [1, 1, 0, 1] for start, stop in stances]
    for (start, stop), spot in zip(stances, spots, strict=True):
        out[start:stop] = spot
    out[: stances[0][0]] += spots[0] - path[stances[0][0]]
    out[stances[-1][1] :] += spots[-1] - path[stances[-1][1] - 1]
    for k in range(len(stances) - 1):
        first, last = stances[k][1] - 1, stances[k + 1][0]
        u = min_jerk((t[first + 1 : last] - first) / (last - first))[:, None]
        moved = (1 - u) * (spots[k] - path[first]) + u * (spots[k + 1] - path[last])
        out[first + 1 : last] += moved
    return out
