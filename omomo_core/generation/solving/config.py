"""Numbers of the solving of sampled bodies: foot plans, steps, reach, wrists and the optimisation's use."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class BodySolvingConfig:
    """How the trajectory optimisation is used."""

    clearance: float = setting(
        0.02,
        "m",
        "Distance that collision spheres keep from the object: they do not fill the skin "
        "to its last "
        "fold, the distance field has a grid's resolution, and choices pass smoothly into "
        "each other.",
    )
    iterations: int = setting(5, "count", "Gauss-Newton steps of the trajectory optimisation.")
    full_hold: float = setting(
        0.99,
        "share",
        "Hold of a hand, which is blended in and out, above which its palm's miss is reported.",
    )


@dataclass(frozen=True)
class FootPlanConfig:
    """When feet are planted, and how they come to lie flat."""

    planted: float = setting(
        0.5, "probability", "Foot contact of the network above which heel or toe is planted."
    )
    shortest_plant: int = setting(4, "frames", "Shorter plants are not locked.")
    ease: float = setting(
        2.0,
        "frames",
        "Standard deviation of the filter over which a foot is turned to lie flat and is let go.",
    )
    settle: int = setting(
        10, "frames", "Time in which a foot comes back to its plan after a prefix."
    )
    least_swing: float = setting(
        0.018, "m", "Least height of the toe joint in a step of no length, above a standing one."
    )
    swing_per_metre: float = setting(
        0.06,
        "m/m",
        "Added height for each metre of the step: toes of three in four recorded steps rise higher.",
    )
    highest_swing: float = setting(0.06, "m", "Greatest height that a step is raised to.")


@dataclass(frozen=True)
class StepConfig:
    """Steps that replace the gliding of feet."""

    standing_speed: float = setting(0.3, "m/s", "Speed below which a foot stands.")
    swing: float = setting(0.72, "share", "Part of a step in which the moving foot is in the air.")
    lift: float = setting(0.07, "m", "Height to which a stepping ankle rises at a normal walk.")
    full_lift_length: float = setting(
        0.4, "m", "Length from which on a step is lifted to the full height."
    )
    cadence: float = setting(
        1.35, "1/s", "Steps per second of the slowest walk; a walk of 0.8 m/s has 1.75."
    )
    cadence_per_speed: float = setting(
        0.5, "1/m", "Steps per second that are added for each m/s: a faster walk has quicker steps."
    )
    shortest_glide: int = setting(8, "frames", "Shorter glides are left as they are.")
    longest_gap: int = setting(10, "frames", "Shorter interruptions of a glide are bridged.")
    hurried: int = setting(
        16, "frames", "Glides shorter than this have time for two steps only where these are slow."
    )
    fastest: float = setting(
        4.9, "m/s", "Speed of an ankle from which on such steps are left out; people reach it."
    )


@dataclass(frozen=True)
class ReachConfig:
    """How the pelvis moves to where arms reach what they hold, and legs the floor."""

    least_height_squared: float = setting(
        0.04,
        "m^2",
        "Squared height of a hip above the ankle that a leg keeps where the foot is far out.",
    )
    first_stretch: float = setting(
        1.1,
        "share",
        "Part of a straight arm's length within which palms are brought before the "
        "optimisation, which "
        "covers the last tenth better, because it also bends, turns and lifts shoulders.",
    )
    last_stretch: float = setting(
        0.999,
        "share",
        "Part of a straight arm's length within which palms are brought after the optimisation.",
    )
    leg_stretch: float = setting(
        0.995, "share", "Part of a straight leg's length within which the floor is brought."
    )
    farthest: float = setting(
        0.25,
        "m",
        "Farthest move of the pelvis: beyond that the sample is wrong and must say so.",
    )
    lowest: float = setting(
        0.05,
        "m",
        "Deepest lowering of the pelvis for the legs: a foot that is planted for longer "
        "than its leg "
        "reaches leaves the floor; the person does not sink for it.",
    )
    rounds: int = setting(
        8, "count", "Most moves of the pelvis, each of which takes about half of the way left."
    )
    near: float = setting(0.0015, "m", "Way left at which the moves end.")
    smoothing: float = setting(
        4.0, "frames", "Standard deviation of the filter over a move towards palm targets."
    )
    lowering_window: int = setting(
        7, "frames", "Width of the neighbourhood whose largest lowering counts."
    )
    lowering_smoothing: float = setting(
        2.0, "frames", "Standard deviation of the filter over the lowering."
    )


@dataclass(frozen=True)
class WristConfig:
    """How far hands are turned so that their palms face what they hold."""

    tolerance: float = setting(
        0.05, "rad", "Angle between palm and surface that needs no correction."
    )
    farthest: float = setting(1.0, "rad", "Largest turn of a hand: beyond that it holds an edge.")


BODY_SOLVING = BodySolvingConfig()
FOOT_PLAN = FootPlanConfig()
STEPS = StepConfig()
REACH = ReachConfig()
WRIST = WristConfig()


@dataclass(frozen=True)
class SolvingConfig:
    """All numbers of the solving of sampled bodies."""

    bodies: BodySolvingConfig = BODY_SOLVING
    foot_plan: FootPlanConfig = FOOT_PLAN
    steps: StepConfig = STEPS
    reach: ReachConfig = REACH
    wrists: WristConfig = WRIST


SOLVING = SolvingConfig()
