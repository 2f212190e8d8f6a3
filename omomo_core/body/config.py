"""Numbers of the body: closing fingers, solving limbs, soles, and the trajectory optimisation."""

from dataclasses import dataclass

from omomo_core.body.trajectory_optimization.config import OPTIMISATION, OptimisationConfig
from omomo_core.config import setting

Flexion = tuple[float, float, float]
"""Flexion of the three joints of a finger."""


@dataclass(frozen=True)
class GraspConfig:
    """How fingers close on an object: postures to choose from, and what each is worth."""

    open_finger: Flexion = setting(
        (-0.15, 0.05, 0.05), "rad", "Flexion of a finger's three joints in an open hand."
    )
    open_thumb: Flexion = setting(
        (-0.35, 0.0, 0.0),
        "rad",
        "Flexion of the thumb in an open hand, from the base of its palm bone.",
    )
    closed_finger: Flexion = setting(
        (1.15, 1.9, 1.2), "rad", "Flexion of a finger's three joints in a fist."
    )
    closed_thumb: Flexion = setting((0.45, 0.8, 1.1), "rad", "Flexion of the thumb in a fist.")
    flat_thumb: float = setting(
        0.0, "rad", "Turn of the thumb about the hand's long axis where it lies beside the palm."
    )
    round_thumb: float = setting(
        1.75, "rad", "Turn of the thumb about the hand's long axis where it is against the fingers."
    )
    gather: float = setting(0.7, "share", "Share of the spread that fingers lose in a fist.")
    allowed_depth: float = setting(
        0.002, "m", "Depth of fingers in the surface that is free, because flesh gives way."
    )
    touch_distance: float = setting(
        0.006, "m", "Distance from the surface at which a finger touches it a third as much."
    )
    depth_cost: float = setting(
        3000.0, "1/m", "Cost of more depth than is free, in whole fingers that touch."
    )
    idle_closing: float = setting(
        0.3, "share", "Closing of fingers that meet nothing: 0 is open, 1 a fist."
    )
    idle_turn: float = setting(
        0.5, "share", "Turn of a thumb that meets nothing: 0 is flat, 1 round."
    )
    idle_cost: float = setting(
        0.05, "cost", "Cost of another closing than the idle one: less than any touch is worth."
    )
    closings: int = setting(61, "count", "Postures from open to fist.")
    closing_stride: int = setting(6, "count", "Stride between the postures that are tried first.")
    thumb_turns: tuple[float, ...] = setting(
        (0.0, 0.35, 0.7, 1.0), "share", "Turns of the thumb that are tried: 0 is flat, 1 round."
    )
    opposition: float = setting(
        1.0, "share", "How much more a touch of the thumb is worth when it is round."
    )
    stride: int = setting(2, "frames", "Interval between the frames that are evaluated.")
    smoothing: float = setting(
        2.0, "frames", "Standard deviation of the filter over the evaluated frames."
    )
    palm_positions: tuple[float, ...] = setting(
        (0.6, 0.8, 1.0), "share", "Positions of a palm bone's spheres along its length."
    )
    sphere_positions: tuple[float, float] = setting(
        (0.45, 0.95), "share", "Positions of a finger bone's two spheres along its length."
    )


@dataclass(frozen=True)
class LimbConfig:
    """How arms and legs are solved onto a target."""

    stretch: float = setting(
        0.9995,
        "share",
        "Greatest length of a limb: an unreachable target leaves it almost, never quite, straight.",
    )
    folded_cosine: float = setting(
        -0.94, "share", "Cosine of the largest flexion, 160 degrees: calf against thigh."
    )
    straight_sine: float = setting(
        0.05,
        "share",
        "Sine of the flexion (3 degrees) below which the anatomical hinge decides the bend plane.",
    )


@dataclass(frozen=True)
class SoleConfig:
    """Where the sole of a foot is."""

    heel_behind_ankle: float = setting(0.04, "m", "Distance of the heel behind the ankle joint.")


GRASP = GraspConfig()
LIMB = LimbConfig()
SOLE = SoleConfig()


@dataclass(frozen=True)
class BodyConfig:
    """All numbers of the body."""

    grasp: GraspConfig = GRASP
    limb: LimbConfig = LIMB
    sole: SoleConfig = SOLE
    optimisation: OptimisationConfig = OPTIMISATION


BODY = BodyConfig()
