"""Numbers of the selection of palm hypotheses and of the ranking of finished samples."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class CoverageConfig:
    """How many palm hypotheses are sampled, and how those that cover them are found."""

    hypotheses_per_sample: int = setting(
        5, "count", "Hypotheses that are sampled for each sample that is kept."
    )
    most_hypotheses: int = setting(100, "count", "Most hypotheses in all.")
    stride: int = setting(4, "frames", "Interval between the frames that are compared.")
    neighbours: int = setting(
        5, "count", "The kernel is as wide as the distance to the nearest so many hypotheses."
    )
    kernel_width: float = setting(0.25, "m", "Greatest width of the kernel.")
    contact_distance: float = setting(
        0.5,
        "m",
        "Added to the distance of two hypotheses for each hand that holds in one of them only.",
    )
    kernel_smoothing: float = setting(
        15.0, "frames", "Standard deviation of the filter over distances for the kernel."
    )


@dataclass(frozen=True)
class PlausibilityConfig:
    """Which palm hypotheses hold the object as a person could."""

    grasp_distance: float = setting(
        0.15,
        "m",
        "Mean distance of holding palms from the surface below which contacts can move them onto it.",
    )
    largest_turn: float = setting(
        60.0,
        "deg",
        "Angle by which the line between two holding palms may leave its mean in the object: "
        "hypotheses of several windows may hold from one side at first and from another later.",
    )
    lasting: int = setting(9, "frames", "Time over which that angle is averaged.")


@dataclass(frozen=True)
class SlidingConfig:
    """Who stands in front of an object that slides flat over the floor, where nobody who pushes it can be."""

    tilt: float = setting(4.0, "deg", "Tilt from the first frame below which an object stays flat.")
    lift: float = setting(
        0.05, "m", "Height of its lowest point below which an object stays on the floor."
    )
    slowest: float = setting(0.1, "m/s", "Speed of its centre from which an object slides.")
    ahead: float = setting(
        0.2,
        "share",
        "Cosine between the object's way and the direction to the person above which they are in front.",
    )
    share: float = setting(
        0.4, "share", "Share of the frames that it slides in which a person in front is in the way."
    )


@dataclass(frozen=True)
class OppositeSideConfig:
    """Samples in which the person stands on the opposite side of the object."""

    one_in: int = setting(5, "count", "One of so many samples changes sides.")
    lighter: float = setting(
        0.9,
        "share",
        "People hold up a tipped object from the side where it takes less than this share of the "
        "force; of 44 synthetic people who tip something, 42 have no side that is so much lighter.",
    )


@dataclass(frozen=True)
class StartConfig:
    """Selection of hypotheses by a start position or start pose, and the way from there."""

    candidates_per_sample: float = setting(
        1.5,
        "count",
        "Candidates for each sample, where the start pose holds the object: those that begin nearest to it.",
    )
    fewest_candidates: int = setting(4, "count", "Fewest candidates in all.")
    shortest_blend: int = setting(
        10, "frames", "Shortest time in which palms blend from the start to the hypothesis."
    )
    longest_blend: int = setting(60, "frames", "Longest time of that blend.")
    fastest_blend: float = setting(
        1.8, "m/s", "Greatest speed of that blend from a start position."
    )
    fastest_palm: float = setting(
        2.5, "m/s", "Greatest speed of that blend from the palms of a start pose."
    )
    pace: float = setting(
        1.3,
        "m/s",
        "Mean speed, from stand to stand, at which people walk around an object before they take it.",
    )
    free_step: float = setting(
        0.3, "m", "Way that takes no time, because people lean and step while they reach."
    )
    holding_reach: float = setting(
        0.4, "m", "Distance from the pelvis forward to the middle of palms that hold."
    )
    idle_reach: float = setting(
        0.1, "m", "Distance from the pelvis forward to the middle of palms that do not hold."
    )


@dataclass(frozen=True)
class PersonConstraintConfig:
    """Which hypotheses fit what is said of the person."""

    side_tolerance: float = setting(
        60.0, "deg", "Angle from the side that is said up to which a hypothesis is on that side."
    )
    nearest_side: float = setting(
        0.2, "m", "Distance from the object's centre within which a place is on no side of it."
    )
    least_way: float = setting(
        0.2, "m", "Way that an object must go over the floor to have a front."
    )
    least_straight: float = setting(
        0.3, "share", "Least way from end to end, as a share of the whole, of what has a front."
    )
    side_frames: int = setting(30, "frames", "Time over which a hypothesis is on a side.")
    end_tolerance: float = setting(
        0.4, "m", "Distance from the end position up to which a hypothesis ends there."
    )
    implausible: float = setting(
        2.0, "cost", "Added to the misfit of a hypothesis that is implausible; up to 1 it fits."
    )
    left_one_in: int = setting(
        4, "count", "One of so many samples that hold with one hand takes the left: as people do."
    )


@dataclass(frozen=True)
class ScoreWeights:
    """Weight of each fault in the sum that ranks the samples."""

    unheld: float = setting(
        20.0, "cost", "Weight of the share of frames in which nobody holds the object but must."
    )
    miss_cm: float = setting(
        1.0, "1/cm", "Weight of the mean distance of palms from their targets."
    )
    skate_cm_s: float = setting(0.2, "s/cm", "Weight of the mean speed of planted feet.")
    inside_cm: float = setting(1.0, "1/cm", "Weight of the mean penetration depth.")
    hands_inside_cm: float = setting(
        2.0, "1/cm", "Weight of the mean depth of fingers and palms that hold."
    )
    wrists_beyond: float = setting(
        5.0, "cost", "Weight of the share of held frames with a wrist beyond its range."
    )
    floating: float = setting(
        10.0, "cost", "Weight of the share of frames in which both feet are in the air."
    )
    jerk_m_s3: float = setting(0.02, "s^3/m", "Weight of the mean jerk of the joints.")
    leaping: float = setting(
        1.0, "cost", "Weight of the excess over the speed limits, summed over frames."
    )


@dataclass(frozen=True)
class ScoreConfig:
    """How the faults of a sample are measured, and which samples count for its distance."""

    wrist_slack: float = setting(0.02, "rad", "Turn beyond a wrist's range that does not count.")
    floating_height: float = setting(
        0.06, "m", "Height of the lower toe above its floor from which a body floats."
    )
    floor_quantile: float = setting(
        0.05, "share", "Quantile of the lower toe's height that is its floor."
    )
    turn_frames: int = setting(
        3, "frames", "Time over which a turn about the vertical is measured."
    )
    extra_depth: float = setting(
        0.02,
        "m",
        "How much deeper than the least deep sample's, on average, a shown sample's body may be.",
    )
    most_solved: int = setting(
        2,
        "count",
        "Samples of a take of several chunks that are solved until one is good, at most.",
    )
    most_faults: float = setting(
        4.0,
        "cost",
        "Sum of faults without leaps of a solved sample above which the next one is solved, too.",
    )
    more_leaping: float = setting(
        0.5,
        "cost",
        "How much more than the least a shown sample may exceed the speed limits where all leap, summed over "
        "frames.",
    )
    leaping_a_minute: float = setting(
        0.5,
        "1/min",
        "Excess over the speed limits that a minute after the first chunk may have, summed over frames.",
    )
    stride: int = setting(
        2, "frames", "Step between the frames in which people who are not solved are compared."
    )
    outliers_one_in: int = setting(
        4, "count", "The farthest one in so many samples does not count for a sample's distance."
    )


@dataclass(frozen=True)
class SpeedLimits:
    """Largest speeds of people who do not run, jump, throw or dance.

    Each is the 99.9th percentile over the frames of recorded people (`benchmarks/speeds.py`), rounded up.
    """

    pelvis: float = setting(2.2, "m/s", "Speed limit of the pelvis joint.")
    head: float = setting(2.4, "m/s", "Speed limit of the head joint.")
    palm: float = setting(5.0, "m/s", "Speed limit of a palm.")
    ankle: float = setting(4.9, "m/s", "Speed limit of an ankle.")
    toe: float = setting(5.8, "m/s", "Speed limit of a toe joint.")
    thigh: float = setting(550.0, "deg/s", "Angular speed limit of the line from hip to knee.")
    shin: float = setting(530.0, "deg/s", "Angular speed limit of the line from knee to ankle.")
    upper_arm: float = setting(
        420.0, "deg/s", "Angular speed limit of the line from shoulder to elbow."
    )
    forearm: float = setting(590.0, "deg/s", "Angular speed limit of the line from elbow to wrist.")
    turn: float = setting(
        340.0, "deg/s", "Limit of the turn of pelvis or chest about the vertical."
    )


COVERAGE = CoverageConfig()
PLAUSIBILITY = PlausibilityConfig()
SLIDING = SlidingConfig()
OPPOSITE_SIDE = OppositeSideConfig()
START = StartConfig()
PERSON_CONSTRAINT = PersonConstraintConfig()
SCORE_WEIGHTS = ScoreWeights()
SCORE = ScoreConfig()
HUMAN_LIMITS = SpeedLimits()
"""The limits that samples are judged by."""


@dataclass(frozen=True)
class SelectionConfig:
    """All numbers of selection and ranking."""

    coverage: CoverageConfig = COVERAGE
    plausibility: PlausibilityConfig = PLAUSIBILITY
    sliding: SlidingConfig = SLIDING
    opposite_side: OppositeSideConfig = OPPOSITE_SIDE
    start: StartConfig = START
    person_constraint: PersonConstraintConfig = PERSON_CONSTRAINT
    score_weights: ScoreWeights = SCORE_WEIGHTS
    score: ScoreConfig = SCORE
    speed_limits: SpeedLimits = HUMAN_LIMITS


SELECTION = SelectionConfig()
