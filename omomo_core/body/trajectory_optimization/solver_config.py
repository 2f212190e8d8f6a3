"""Numbers of the trajectory optimisation: weights of the residuals, steps, joint ranges, body mass."""

from dataclasses import dataclass

from omomo_core.config import setting

AxisRanges = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""Least and greatest component of a rotation vector about x, y and z."""


@dataclass(frozen=True)
class ResidualConfig:
    """Weights of the residuals; a palm that is 1/60 m off costs as much as a turn of 1 rad."""

    palm: float = setting(60.0, "1/m", "Weight of a holding palm's distance from its target.")
    planted_ankle: float = setting(
        60.0, "1/m", "Weight of a planted foot's distance from its target."
    )
    swinging_ankle: float = setting(
        6.0, "1/m", "Weight of a swinging foot's distance from its target."
    )
    penetration: float = setting(50.0, "1/m", "Weight of a collision sphere's depth in the object.")
    balance: float = setting(
        14.0, "1/m", "Weight of the centre of mass's distance beyond the support."
    )
    joint_range: float = setting(3.0, "1/rad", "Weight of a turn beyond a joint's range.")
    wrist: float = setting(1.5, "1/rad", "Weight of a holding wrist's turn from its target.")
    foot_support: float = setting(
        0.05, "m", "Extent of a foot's support beyond the lines from heel to ball."
    )
    support_directions: int = setting(
        16, "count", "Horizontal directions in which the support of the feet is measured."
    )
    support_in_air: float = setting(
        1e6, "m", "Support of a body in the air: there is no balance to keep."
    )


@dataclass(frozen=True)
class SolverConfig:
    """Splines, steps and smoothness of the corrections."""

    coefficient_spacing: float = setting(
        6.0,
        "frames",
        "Interval between the spline's coefficients: no correction changes faster than at 2.5 Hz.",
    )
    stride: int = setting(2, "frames", "Interval between the frames that are evaluated.")
    longest_step: float = setting(
        0.25, "m or rad", "Longest step of any value of the corrections in one iteration."
    )
    level_closeness: float = setting(
        6.0, "1/m", "Weight of a horizontal shift of the pelvis from the initial motion."
    )
    height_closeness: float = setting(
        10.0, "1/m", "Weight of a vertical shift of the pelvis from the initial motion."
    )
    smoothness: float = setting(
        60.0, "frames^2", "Weight of a correction's acceleration against the correction itself."
    )
    ridge: float = setting(
        1e-6, "share", "Added to the normal equations: it keeps undetermined coefficients at rest."
    )
    slow_pelvis: float = setting(
        0.3, "m/s", "Speed of the pelvis above which a body need not be over its feet."
    )
    pelvis_speed_smoothing: float = setting(
        5.0, "frames", "Standard deviation of the filter over the pelvis's speed."
    )
    approach_hold: float = setting(
        0.75,
        "share",
        "Contact weight at which a hand that comes or goes is wholly kept on its initial path.",
    )
    stance_window: int = setting(
        9, "frames", "Width of the neighbourhood in which a foot that stands counts as firm."
    )
    stance_smoothing: float = setting(
        1.5, "frames", "Standard deviation of the filter over the firmness of a stance."
    )


@dataclass(frozen=True)
class TurnClosenessConfig:
    """Closeness of each bone's turn to that of its parent; arms and legs follow cheaply."""

    pelvis: float = setting(2.0, "1/rad", "Weight of a turn of the pelvis.")
    spine3: float = setting(1.5, "1/rad", "Weight of a turn of the chest against the pelvis.")
    collar: float = setting(0.8, "1/rad", "Weight of a turn of a collar against the chest.")
    shoulder: float = setting(0.12, "1/rad", "Weight of a turn of an upper arm against its collar.")
    elbow: float = setting(0.12, "1/rad", "Weight of a turn of a forearm against the upper arm.")
    wrist: float = setting(0.4, "1/rad", "Weight of a turn of a hand against the forearm.")
    hip: float = setting(0.12, "1/rad", "Weight of a turn of a thigh against the pelvis.")
    knee: float = setting(0.2, "1/rad", "Weight of a turn of a shin against the thigh.")


@dataclass(frozen=True)
class ArmSpeedConfig:
    """Limit on the angular speed of arms before the optimisation."""

    fastest: float = setting(
        9.0, "rad/s", "Angular speed of an arm joint against the chest; quicker turns are spread."
    )
    width: float = setting(
        4.5, "frames", "Standard deviation of the filter that spreads a quicker turn over time."
    )
    rounds: int = setting(3, "count", "Most passes of that filter.")


@dataclass(frozen=True)
class BodyMassConfig:
    """Weight of the body, against which a carried object is balanced."""

    body_mass_index: float = setting(22.5, "kg/m^2", "Body mass over the square of the stature.")


@dataclass(frozen=True)
class JointRangesConfig:
    """Ranges of the rotation vectors from parent to child about rest x, y, z.

    After the ranges of Boone and Azen (1979) and Kapandji; x is to the left, y up, z ahead. The trunk bends
    forward, elbows and knees are hinges that open to nearly straight, a forearm turns about x.
    """

    spine3: AxisRanges = setting(
        ((-0.45, 1.25), (-0.75, 0.75), (-0.6, 0.6)), "rad", "The chest against the pelvis."
    )
    left_collar: AxisRanges = setting(
        ((-0.6, 0.6), (-0.5, 0.5), (-0.45, 0.7)), "rad", "The left collar against the chest."
    )
    right_collar: AxisRanges = setting(
        ((-0.6, 0.6), (-0.5, 0.5), (-0.7, 0.45)), "rad", "The right collar against the chest."
    )
    left_elbow: AxisRanges = setting(
        ((-1.5, 1.5), (-2.55, -0.05), (-0.25, 0.25)), "rad", "The left forearm against its arm."
    )
    right_elbow: AxisRanges = setting(
        ((-1.5, 1.5), (0.05, 2.55), (-0.25, 0.25)), "rad", "The right forearm against its arm."
    )
    left_wrist: AxisRanges = setting(
        ((-1.6, 1.6), (-0.55, 0.55), (-1.3, 1.2)), "rad", "The left hand against its forearm."
    )
    right_wrist: AxisRanges = setting(
        ((-1.6, 1.6), (-0.55, 0.55), (-1.2, 1.3)), "rad", "The right hand against its forearm."
    )
    left_hip: AxisRanges = setting(
        ((-2.2, 0.55), (-0.8, 0.8), (-0.5, 0.9)), "rad", "The left thigh against the pelvis."
    )
    right_hip: AxisRanges = setting(
        ((-2.2, 0.55), (-0.8, 0.8), (-0.9, 0.5)), "rad", "The right thigh against the pelvis."
    )
    left_knee: AxisRanges = setting(
        ((0.02, 2.75), (-0.4, 0.4), (-0.15, 0.15)), "rad", "The left shin against its thigh."
    )
    right_knee: AxisRanges = setting(
        ((0.02, 2.75), (-0.4, 0.4), (-0.15, 0.15)), "rad", "The right shin against its thigh."
    )


RESIDUALS = ResidualConfig()
SOLVER = SolverConfig()
TURN_CLOSENESS = TurnClosenessConfig()
ARM_SPEED = ArmSpeedConfig()
BODY_MASS = BodyMassConfig()
JOINT_RANGES = JointRangesConfig()


@dataclass(frozen=True)
class OptimisationConfig:
    """All numbers of the trajectory optimisation."""

    residuals: ResidualConfig = RESIDUALS
    solver: SolverConfig = SOLVER
    turn_closeness: TurnClosenessConfig = TURN_CLOSENESS
    arm_speed: ArmSpeedConfig = ARM_SPEED
    body_mass: BodyMassConfig = BODY_MASS
    joint_ranges: JointRangesConfig = JOINT_RANGES


OPTIMISATION = OptimisationConfig()
