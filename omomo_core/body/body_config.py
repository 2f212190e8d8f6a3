"""Numbers of the body: closing fingers, solving limbs, soles, and the trajectory optimisation."""

from dataclasses import dataclass

from omomo_core.body.trajectory_optimization.solver_config import OPTIMISATION, OptimisationConfig
from omomo_core.config import setting

Flexion = tuple[float, float, float]
"""Flexion of the three joints of a finger."""


FingerRange = tuple[tuple[float, float], ...]
"""Least and greatest flexion, abduction and twist of a finger's base, flexion of its outer joints."""


@dataclass(frozen=True)
class FingerRangesConfig:
    """Ranges of finger joints from the T-pose, in which fingers are straight (Kapandji)."""

    finger: FingerRange = setting(
        ((-0.5, 1.5), (-0.25, 0.25), (0.0, 0.0), (0.0, 1.8), (-0.1, 1.2)),
        "rad",
        "Of index, middle, ring and little finger: what is pressed on bends the base back.",
    )
    thumb: FingerRange = setting(
        ((-0.6, 0.6), (-0.9, 0.5), (-0.5, 0.9), (-0.25, 0.9), (-0.3, 1.2)),
        "rad",
        "Of the thumb: saddle joint, base joint and last joint.",
    )


@dataclass(frozen=True)
class GripConfig:
    """Postures of the fingers that are tried for each contact, and what each is worth."""

    poses: int = setting(3, "count", "Poses of the hand in a contact that a grip must suit.")
    bends: tuple[float, ...] = setting(
        (-0.4, -0.2, 0.0, 0.2, 0.45, 0.7, 1.0, 1.3), "rad", "Flexions of a finger's base."
    )
    curls: tuple[float, ...] = setting(
        (0.05, 0.3, 0.6, 0.9, 1.2, 1.5), "rad", "Flexions of a finger's middle joint."
    )
    last_joint: float = setting(
        0.6, "share", "Flexion of a finger's last joint over that of its middle joint."
    )
    thumb_bends: tuple[float, ...] = setting((-0.5, -0.2, 0.1, 0.4), "rad", "Of the saddle joint.")
    thumb_lifts: tuple[float, ...] = setting(
        (-0.9, -0.6, -0.3, 0.0, 0.3),
        "rad",
        "Abductions of the thumb: less is nearer to the palm's plane.",
    )
    thumb_turns: tuple[float, ...] = setting((-0.3, 0.2, 0.7), "rad", "Twists of the thumb's base.")
    thumb_curls: tuple[float, ...] = setting(
        (-0.15, 0.15, 0.5, 0.8), "rad", "Flexions of the thumb's two outer joints."
    )
    relaxed: Flexion = setting(
        (0.3, 0.18, 0.1), "rad", "Flexion of a relaxed finger's three joints."
    )
    opened: float = setting(0.35, "share", "Bend of a hand that opens for a grip.")
    touching: tuple[float, float, float] = setting(
        (0.3, 0.5, 1.0),
        "share",
        "What a touch of a finger's first, middle and last phalanx is worth.",
    )
    opposition: float = setting(
        0.3, "share", "What a fingertip's touch is worth on a face that looks against the palm."
    )
    thumb_opposition: float = setting(
        1.0, "share", "What the thumb's touch is worth on a face that looks against the palm."
    )
    touch_distance: float = setting(
        0.006, "m", "Distance from the surface at which skin touches it a third as much."
    )
    allowed_depth: float = setting(0.002, "m", "Depth of a tried posture that is free.")
    depth_cost: float = setting(600.0, "1/m", "Cost of more depth than is free.")
    crossing_cost: float = setting(
        3.0, "share", "Cost of each bone of a finger that goes through the surface."
    )
    apart_cost: float = setting(
        0.2, "1/rad^2", "Cost of a finger that bends otherwise than the one beside it."
    )
    finalists: int = setting(12, "count", "Best postures, which are measured exactly.")
    exact_range: float = setting(0.015, "m", "Distance within which they are.")
    idle_cost: float = setting(0.05, "1/rad^2", "Cost of another posture than the relaxed one.")


@dataclass(frozen=True)
class GripNamingConfig:
    """Which grip a contact is called after what is within a hand's span."""

    palm_thickness: float = setting(0.029, "m", "Distance from the palm joint to its skin.")
    spacing: float = setting(0.004, "m", "Distance between the places that are probed.")
    probes: int = setting(32, "count", "Places that are probed in each direction.")
    entry: float = setting(0.01, "m", "Distance in which a palm need not touch.")
    below: float = setting(0.012, "m", "Depth under the palm at which edges are looked for.")
    bar: float = setting(0.07, "m", "Thickness and width below which a hand goes around it.")
    board: float = setting(0.045, "m", "Thickness below which thumb and fingers pinch a board.")
    finger_reach: float = setting(0.1, "m", "Distance of an edge over which fingers hook.")
    thumb_reach: float = setting(0.06, "m", "Distance of an edge beside the palm.")
    level_cosine: float = setting(0.8, "cosine", "Of a face's tilt up to which it is a top.")


@dataclass(frozen=True)
class GraspConfig:
    """How fingers are fitted to what is held: residuals in millimetres, angles in radians."""

    full_weight: float = setting(
        0.99,
        "share",
        "Weight of a hand, which is blended in and out, from which on it is in contact.",
    )
    stride: int = setting(4, "frames", "Interval between key frames.")
    coarse_stride: int = setting(
        4,
        "key frames",
        "Interval, in the middle of a contact, of the key frames that the first steps measure.",
    )
    shaping: float = setting(
        20.0,
        "frames",
        "Time in which fingers take the shape of a grip before a contact, and lose it after.",
    )
    leaving: float = setting(
        32.0,
        "frames",
        "Time from a contact at which fingers are relaxed as recorded, whatever is near.",
    )
    coarse_points: int = setting(
        12, "count", "Points of each phalanx, of 20, that the first steps measure."
    )
    stuck_depth: float = setting(
        0.004,
        "m",
        "Depth from which on a finger takes the posture of its grip if that is less deep.",
    )
    crossing_depth: float = setting(
        0.02, "m", "Depth that counts for a finger with a bone that passes through the surface."
    )
    closing: float = setting(
        8.0, "frames", "Time in which an opened hand closes, and in which it opens to let go."
    )
    rounds: int = setting(
        7, "count", "Gauss-Newton steps; after 6, some hands are still inside a wall."
    )
    full_rounds: int = setting(1, "count", "Last steps, which measure every key frame.")
    exact_rounds: int = setting(
        4, "count", "Last steps, which measure to the surface itself instead of the grid."
    )
    exact_range: float = setting(0.012, "m", "Distance within which they do so.")
    counting_range: float = setting(
        0.009,
        "m",
        "Distance from the surface, and beyond the nearest point of its phalanx, within which skin counts.",
    )
    longest_step: float = setting(0.3, "rad", "Longest step of an angle.")
    firmness: float = setting(3.0, "share", "Weight of depth in the object against a pad's touch.")
    brushing: float = setting(
        1.0, "share", "Part of that weight for a hand that comes or goes and does not hold."
    )
    margin: float = setting(0.001, "m", "Distance from the surface at which skin rests.")
    touch_range: float = setting(
        0.015, "m", "Distance from the surface beyond which it hardly draws skin to it."
    )
    pad_softness: float = setting(
        0.002, "m", "Distance by which one point of a pad is farther than another to count a third."
    )
    touching: tuple[float, float, float] = setting(
        (0.1, 0.3, 1.0), "share", "Weight of the touch of the first, middle and last phalanx."
    )
    stiffness: tuple[float, ...] = setting(
        (10.0, 40.0, 40.0, 10.0, 10.0),
        "mm^2/rad^2",
        "Weight of each angle's distance from the grip.",
    )
    synergy: float = setting(
        10.0, "mm^2/rad^2", "Weight of the last joint's bend against that of the middle joint."
    )
    smoothness: float = setting(
        1500.0, "mm^2/rad^2", "Weight of the change of an angle between key frames."
    )
    rest: float = setting(1e6, "mm^2/rad^2", "Weight of the relaxed hand where it is free.")
    still: float = setting(1e-5, "rad", "Distance of an angle from the relaxed hand that is none.")
    fastest: tuple[float, ...] = setting(
        (0.08, 0.028, 0.028, 0.115, 0.115), "rad/frame", "Largest speed of each angle."
    )


@dataclass(frozen=True)
class HandSkinConfig:
    """Which skin belongs to the palm, to the palmar side of fingers, and to their pads."""

    palmar_cosine: float = setting(
        0.35, "cosine", "Cosine of the angle to the palmar direction from which on skin is palmar."
    )
    pad_cosine: float = setting(
        0.5, "cosine", "The same from which on skin of a last phalanx belongs to its pad."
    )
    heel: float = setting(
        0.2, "share", "Part of the way from wrist to middle knuckle at which the palm begins."
    )


@dataclass(frozen=True)
class LimbConfig:
    """How arms and legs are solved onto a target."""

    stretch: float = setting(
        0.9995,
        "share",
        "Greatest length of a limb: an unreachable target leaves it almost, never quite, straight.",
    )
    easy: float = setting(
        0.98, "share", "Length from which on a limb that is solved gently straightens more slowly."
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
    """The place of the sole of a foot."""

    heel_behind_ankle: float = setting(0.04, "m", "Distance of the heel behind the ankle joint.")


FINGER_RANGES = FingerRangesConfig()
GRIP = GripConfig()
GRIP_NAMING = GripNamingConfig()
GRASP = GraspConfig()
HAND_SKIN = HandSkinConfig()
LIMB = LimbConfig()
SOLE = SoleConfig()


@dataclass(frozen=True)
class BodyConfig:
    """All numbers of the body."""

    finger_ranges: FingerRangesConfig = FINGER_RANGES
    grip: GripConfig = GRIP
    grip_naming: GripNamingConfig = GRIP_NAMING
    grasp: GraspConfig = GRASP
    hand_skin: HandSkinConfig = HAND_SKIN
    limb: LimbConfig = LIMB
    sole: SoleConfig = SOLE
    optimisation: OptimisationConfig = OPTIMISATION


BODY = BodyConfig()
