"""A humanoid from an MJCF or URDF file, and which of its bodies answer to a person's.

mujoco and mink come with the extra `robot`; nothing here imports them before a robot is asked for.
"""

import json
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, FiniteFloat, ValidationError, model_validator
from scipy.spatial.transform import Rotation

from capture_app.commands.request import first_problem
from omomo_core.errors import InputError, in_words

Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
SIDES = ("left", "right")


class RobotFrame(BaseModel):
    """A point of a robot's body, and how it is turned there."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    body: str
    """Name of the body in the model."""
    point: Vector = (0.0, 0.0, 0.0)
    """In the body's frame, metres: the middle of a palm, the ankle of a foot."""
    forward: Vector = (1.0, 0.0, 0.0)
    """Axis of the body that looks forward; of a hand, the one along its fingers."""
    up: Vector = (0.0, 0.0, 1.0)
    """Axis of the body that looks up; of a hand, the one toward its thumb."""

    @model_validator(mode="after")
    def _axes(self) -> "RobotFrame":
        lengths = np.linalg.norm([self.forward, self.up], axis=1)
        if not lengths.all() or abs(np.dot(self.forward, self.up)) > 0.1 * lengths.prod():
            raise ValueError("forward and up must be two axes at a right angle")
        return self

    @property
    def R_body_frame(self) -> Float[np.ndarray, "3 3"]:
        """Axes forward, left and up of the frame, as columns in the body's axes."""
        x, z = (np.array(v) / np.linalg.norm(v) for v in (self.forward, self.up))
        return np.stack([x, np.cross(z, x), z], axis=1)


class RobotMap(BaseModel):
    """The bodies of a robot that answer to people's; a file for ‹frames› holds one of these as JSON."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pelvis: RobotFrame
    torso: RobotFrame
    left_foot: RobotFrame
    right_foot: RobotFrame
    left_palm: RobotFrame
    right_palm: RobotFrame
    left_elbow: RobotFrame
    right_elbow: RobotFrame
    sole: FiniteFloat
    """Height of the ankles' points over the floor when the feet stand, metres."""
    arms: tuple[str, str]
    """First bodies of the left and the right arm: what hangs on them may hit trunk and legs."""
    legs: tuple[str, str]
    """First bodies of the left and the right leg."""
    stance: dict[str, FiniteFloat] = {}
    """Joint -> angle in radians of an easy stance, from which the first frame is searched."""

    @property
    def frames(self) -> dict[str, RobotFrame]:
        """The frames by their names."""
        found = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: f for name, f in found.items() if isinstance(f, RobotFrame)}


def _unitree(
    foot: str, hand: str, reach: float, leg: str, arm: str, sole: float, bent: dict[str, float]
) -> RobotMap:
    """Return the map of a robot of Unitree; * stands for the side."""
    both = {
        f"{side}_{part}": RobotFrame(body=name.replace("*", side), point=(x, 0.0, 0.0))
        for side in SIDES
        for part, name, x in (
            ("foot", foot, 0.0), ("palm", hand, reach), ("elbow", "*_elbow_link", 0.0),
        )
    }  # fmt: skip
    return RobotMap(
        pelvis=RobotFrame(body="pelvis"),
        torso=RobotFrame(body="torso_link"),
        **both,
        sole=sole,
        arms=(arm.replace("*", "left"), arm.replace("*", "right")),
        legs=(leg.replace("*", "left"), leg.replace("*", "right")),
        stance={n.replace("*", side): x for n, x in bent.items() for side in SIDES},
    )


PRESETS: dict[str, RobotMap] = {
    "g1": _unitree(
        "*_ankle_roll_link", "*_wrist_yaw_link", 0.12, "*_hip_pitch_link", "*_shoulder_pitch_link",
        0.035, {"*_hip_pitch_joint": -0.3, "*_knee_joint": 0.6, "*_ankle_pitch_joint": -0.3},
    ),
    "h1": _unitree(
        "*_ankle_link", "*_elbow_link", 0.28, "*_hip_yaw_link", "*_shoulder_pitch_link",
        0.05, {"*_hip_pitch_joint": -0.3, "*_knee_joint": 0.6, "*_ankle_joint": -0.3},
    ),
}  # fmt: skip
"""Robots whose bodies are known; the first of which a model has every body is taken."""


@dataclass(frozen=True)
class Robot:
    """A robot whose first joint is free, with its map."""

    path: Path
    model: Any
    """mujoco.MjModel of the robot alone; each frame of the map is a site of it."""
    map: RobotMap
    joints: tuple[str, ...]
    """Names of the joints after the free one, in the model's order; each has one number."""
    standing: Float[np.ndarray, " qpos"]
    """The easy stance: root x, y, z, quaternion (w first), joints in radians."""


def robot_package(name: str) -> Any:
    """Return a module that the extra `robot` brings.

    Raises:
        InputError: "robot-extra-missing".
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(
            "robot-extra-missing",
            f"The package {name.partition('.')[0]} is not installed, and robots need it.",
            fix="Install the extra: pip install '.[robot]'",
        ) from error


def load_robot(path: Path, frames: Path | None = None) -> Robot:
    """Read a robot's model, and choose its map.

    Args:
        path: MJCF (.xml) or URDF (.urdf); meshes lie where it says.
        frames: a RobotMap as JSON; one of the presets is chosen if not given.

    Raises:
        InputError: "robot-extra-missing", "robot-missing", "robot-unreadable", "robot-joints",
            "robot-unknown", "robot-frames" or "robot-unmapped".
    """
    if not path.is_file():
        raise InputError(
            "robot-missing",
            "There is no such robot file.",
            where=str(path),
            fix="Give the robot's MJCF or URDF file, as its maker publishes it.",
        )
    mujoco = robot_package("mujoco")
    try:
        spec = robot_spec(path)
        chosen = _map_of(path, spec, frames)
        model = _with_sites(spec, chosen).compile()
    except ValueError as error:
        raise unreadable(path, error) from error
    free, rest = int(mujoco.mjtJoint.mjJNT_FREE), model.jnt_type[1:]
    hinges = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    if model.jnt_type[0] != free or not np.isin(rest, hinges).all():
        raise InputError(
            "robot-joints",
            "This model is not one robot with a free root and joints of one axis.",
            where=str(path),
            fix="Give the model of the robot alone, without a scene.",
        )
    joints = tuple(model.joint(k).name for k in range(1, model.njnt))
    standing, (low, high) = np.array(model.qpos0), joint_range(model)
    for name, angle in chosen.stance.items():
        k = joints.index(name) if name in joints else None
        if frames and (k is None or not low[k] <= angle <= high[k]):
            may = "has no angle" if k is None else f"goes from {low[k]:.3f} to {high[k]:.3f}"
            raise _no_map(frames, f"stance gives {name} {angle:g} rad, but that joint {may}")
        standing[7 + joints.index(name)] = angle
    standing[7:] = np.clip(standing[7:], low, high)
    return Robot(path, model, chosen, joints, standing)


def joint_range(model: Any) -> tuple[Float[np.ndarray, " joints"], Float[np.ndarray, " joints"]]:
    """Return the least and the greatest value of each joint but the free one."""
    limited = model.jnt_limited[1:] > 0
    low, high = model.jnt_range[1:].T
    return np.where(limited, low, -np.inf), np.where(limited, high, np.inf)


def robot_spec(path: Path) -> Any:
    """Return the mujoco.MjSpec of a robot; one without a free root gets it."""
    spec = robot_package("mujoco").MjSpec.from_file(str(path))
    root = spec.worldbody.first_body()
    if root is not None and root.first_joint() is None:
        spec.compiler.fusestatic = False
        root.add_freejoint()
    return spec


def unreadable(
    path: Path, error: Exception, code: str = "robot-unreadable", deed: str = "read this robot"
) -> InputError:
    """Return the error of a robot that MuJoCo cannot read, or do another deed with."""
    return InputError(
        code,
        f"MuJoCo cannot {deed}: {str(error).strip().splitlines()[0]}",
        where=str(path),
        fix="Give an MJCF or URDF file of the robot alone, whose meshes are where it says.",
    )


def _with_sites(spec: Any, chosen: RobotMap) -> Any:
    """Give the model a site for each frame of the map, under its name."""
    for name, frame in chosen.frames.items():
        quat = np.roll(Rotation.from_matrix(frame.R_body_frame).as_quat(), 1)
        spec.body(frame.body).add_site(name=site_of(name), pos=frame.point, quat=quat)
    return spec


def site_of(name: str) -> str:
    """Name of the site that stands for a frame of the map."""
    return f"omocap_{name}"


def _map_of(path: Path, spec: Any, frames: Path | None) -> RobotMap:
    bodies, joints = {b.name for b in spec.bodies}, {j.name for j in spec.joints}
    if frames is not None:
        chosen = _read_map(frames)
        lacking = _needed(chosen) - bodies | set(chosen.stance) - joints
        if lacking:
            raise InputError(
                "robot-unmapped",
                f"The robot has no {', '.join(sorted(lacking))}.",
                where=str(frames),
                fix=f"Use names of {path.name}.",
            )
        return chosen
    for preset in PRESETS.values():
        if _needed(preset) <= bodies and set(preset.stance) <= joints:
            return preset
    raise InputError(
        "robot-unknown",
        f"This robot is none of those whose bodies are known ({', '.join(PRESETS)}).",
        where=str(path),
        fix="Give ‹frames› with a file that maps its bodies; docs/robots.md shows one.",
    )


def _needed(chosen: RobotMap) -> set[str]:
    return {f.body for f in chosen.frames.values()} | {*chosen.arms, *chosen.legs}


def _read_map(path: Path) -> RobotMap:
    try:
        return RobotMap.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        raise _no_map(path, ": ".join(first_problem(error.errors()))) from error
    except (OSError, ValueError) as error:
        raise _no_map(path, in_words(error)) from error


def _no_map(path: Path, problem: str) -> InputError:
    what = f"This file cannot be used as the map of the robot's bodies: {problem}."
    fix = "Correct it; docs/robots.md shows one."
    return InputError("robot-frames", what, where=str(path), fix=fix)
