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
        0.999,
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
    rejoining: int = setting(
        10, "frames", "Time in which a foot comes from its last step to where the sample has it."
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
        0.98,
        "share",
        "Part of a straight arm's length within which palms are brought after the optimisation.",
    )
    leg_stretch: float = setting(
        0.99, "share", "Part of a straight leg's length within which the floor is brought."
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


@dataclass(frozen=True)
class PalmPlanConfig:
    """Orientations of holding hands: which are tried, and what each costs."""

    stride: int = setting(6, "frames", "Interval between the frames in which they are chosen.")
    heading: float = setting(1.6, "rad", "Largest turn about the surface's normal.")
    headings: int = setting(17, "count", "Turns about the normal that are tried.")
    lifts: tuple[float, ...] = setting(
        (0.0, -0.15, 0.15, 0.3, 0.6, 1.0),
        "rad",
        "Lifts of the wrist from the surface that are tried.",
    )
    least_heading: float = setting(
        0.2, "share", "Part of the hand along the surface below which its thumb tells its heading."
    )
    highest: float = setting(0.03, "m", "Largest rise of a palm out of the object.")
    ease: float = setting(
        18.0, "frames", "Time in which a hand takes its orientation, and in which it loses it."
    )
    smoothing: float = setting(
        3.0, "frames", "Standard deviation of the filter over headings and lifts."
    )
    change: float = setting(1.8, "1/rad^2", "Cost of a squared change between key frames.")
    farthest_step: float = setting(0.68, "rad", "Largest change between key frames.")
    leap: float = setting(1e3, "cost", "Cost of a larger one.")
    range: float = setting(14.0, "1/rad", "Cost of a wrist's turn beyond its range.")
    spare: float = setting(0.06, "rad", "Distance that a wrist keeps from its range's ends.")
    twist: float = setting(
        0.5, "share", "Part of a hand's turn about the forearm's axis that the forearm makes."
    )
    reach: float = setting(4000.0, "1/m^2", "Cost of a wrist's squared distance out of reach.")
    stretch: float = setting(0.985, "share", "Part of a straight arm's length within reach.")
    penetration: float = setting(800.0, "1/m^2", "Cost of the forearm's squared depth.")
    forearm_places: tuple[float, ...] = setting(
        (0.0, 0.15, 0.4, 0.7), "share", "Places on the forearm, from the wrist."
    )
    forearm_radii: tuple[float, ...] = setting(
        (0.024, 0.027, 0.034, 0.04), "m", "Radius of the forearm there."
    )
    closeness: float = setting(0.05, "1/rad^2", "Cost of a squared turn from the solved hand.")
    fixed: float = setting(100.0, "1/rad^2", "The same where the hand is fixed.")
    grip: float = setting(0.3, "share", "Cost of a grip that is worth less.")
    heading_cost: float = setting(0.05, "1/rad^2", "Cost of a squared turn from the mean heading.")
    lift_cost: float = setting(1.5, "1/rad^2", "Cost of a squared lift.")
    rise_cost: float = setting(40.0, "1/m", "Cost of a palm's rise out of the object.")


@dataclass(frozen=True)
class PalmClearanceConfig:
    """How hands that come, hold and go are kept out of the object."""

    stride: int = setting(3, "frames", "Interval between the frames that are measured.")
    rounds: int = setting(3, "count", "Steps along the normal until all skin is outside.")
    exact_range: float = setting(
        0.012, "m", "Distance within which the surface itself is measured, not the grid."
    )
    grid_error: float = setting(
        0.006, "m", "Distance by which the grid may mistake one point for deeper than another."
    )
    highest: float = setting(0.12, "m", "Largest rise of a hand.")
    reach: float = setting(
        28.0, "frames", "Time from a contact up to which a hand is kept out of the object."
    )
    fade: float = setting(12.0, "frames", "Last part of that time, in which it less and less is.")
    landing: float = setting(
        0.012, "m/frame", "Largest rise for each frame from a contact: so fast does a hand land."
    )
    window: int = setting(5, "frames", "Width of the neighbourhood whose largest rise counts.")
    smoothing: float = setting(1.5, "frames", "Standard deviation of the filter over the rise.")


@dataclass(frozen=True)
class FreeHandsConfig:
    """How far hands that hold nothing stay from the person's own legs."""

    thigh: float = setting(
        0.085,
        "m",
        "Distance of a finger joint from the line between hip and knee: recorded people are nearer in 1 % of "
        "the frames in which a hand is free.",
    )
    hips: float = setting(0.11, "m", "The same of the line between the hips.")
    sideways: float = setting(
        0.05,
        "m",
        "Weight of the person's side in the direction of a step, beside the way from the bone.",
    )
    rounds: int = setting(4, "count", "Most steps out, each smoothed over time.")
    solved_from: float = setting(
        0.005, "m", "Length of a step from which an arm is wholly solved for it."
    )
    smoothing: float = setting(3.0, "frames", "Standard deviation of the filter over a step.")


@dataclass(frozen=True)
class SteadyLimbsConfig:
    """How limbs that swing faster than people's are smoothed over time."""

    rounds: int = setting(5, "count", "Most rounds; each smooths more than the one before.")
    smoothing: float = setting(
        2.0, "frames", "Standard deviation of the filter of the first round; it grows by as much."
    )
    near: int = setting(6, "frames", "Time around a leap that is smoothed at least.")
    least: float = setting(0.001, "share", "Weight below which a frame stays as it is.")
    foot_ramp: int = setting(
        6, "frames", "Time after which the way of a foot that was planted may be smoothed wholly."
    )


BODY_SOLVING = BodySolvingConfig()
FOOT_PLAN = FootPlanConfig()
STEPS = StepConfig()
REACH = ReachConfig()
WRIST = WristConfig()
PALM_PLAN = PalmPlanConfig()
PALM_CLEARANCE = PalmClearanceConfig()
FREE_HANDS = FreeHandsConfig()
STEADY_LIMBS = SteadyLimbsConfig()


@dataclass(frozen=True)
class SolvingConfig:
    """All numbers of the solving of sampled bodies."""

    bodies: BodySolvingConfig = BODY_SOLVING
    foot_plan: FootPlanConfig = FOOT_PLAN
    steps: StepConfig = STEPS
    reach: ReachConfig = REACH
    wrists: WristConfig = WRIST
    palm_plan: PalmPlanConfig = PALM_PLAN
    palm_clearance: PalmClearanceConfig = PALM_CLEARANCE
    free_hands: FreeHandsConfig = FREE_HANDS
    steady_limbs: SteadyLimbsConfig = STEADY_LIMBS


SOLVING = SolvingConfig()
