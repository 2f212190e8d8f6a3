"""Numbers of collision avoidance: which choices are tried, and what each costs."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class SideConfig:
    """The cheapest path through choices of a side of the object (Viterbi)."""

    stride: int = setting(
        5,
        "frames",
        "Interval between choices, and standard deviation of the filter that blends them.",
    )
    fine_stride: int = setting(
        2,
        "frames",
        "Interval between choices in the last swing of the limbs: a thin part passes quickly by.",
    )
    penetration: float = setting(
        400.0, "1/m^2", "Cost of a sphere's squared depth in the object: 5 cm of one sphere cost 1."
    )
    fixed: float = setting(1e6, "cost", "Cost of changing a frame that is fixed.")


@dataclass(frozen=True)
class RootShiftConfig:
    """Horizontal shifts of the whole body out of the object."""

    spacing: float = setting(0.0625, "m", "Distance between the shifts that are tried.")
    farthest: float = setting(0.25, "m", "Length of the farthest shift that is tried.")
    shift: float = setting(3.0, "1/m^2", "Cost of a squared shift.")
    change: float = setting(40.0, "1/m^2", "Cost of a squared change of the shift.")
    reach: float = setting(4000.0, "1/m^2", "Cost of a palm's squared distance out of reach.")
    stretch: float = setting(0.98, "share", "Part of a straight arm's length that is within reach.")


@dataclass(frozen=True)
class FootShiftConfig:
    """Horizontal shifts of feet that the object runs into."""

    spacing: float = setting(0.05, "m", "Distance between the shifts that are tried.")
    farthest: float = setting(0.2, "m", "Length of the farthest shift that is tried.")
    shift: float = setting(4.0, "1/m^2", "Cost of a squared shift.")
    change: float = setting(20.0, "1/m^2", "Cost of a squared change of the shift.")
    reach: float = setting(4000.0, "1/m^2", "Cost of a leg's squared lack of length.")
    step: float = setting(0.15, "cost", "Cost of a step where the foot would have stayed planted.")
    half_step: int = setting(5, "frames", "Half the duration of such a step.")
    stretch: float = setting(
        0.985, "share", "Part of a straight leg's length that is within reach."
    )


@dataclass(frozen=True)
class LimbSwingConfig:
    """Swings of elbows and knees about the line from the limb's root to its end."""

    farthest_arm: float = setting(1.6, "rad", "Largest swing of an elbow.")
    arm_stiffness: float = setting(0.06, "1/rad^2", "Cost of an elbow's squared swing.")
    farthest_leg: float = setting(0.7, "rad", "Largest swing of a knee.")
    leg_stiffness: float = setting(0.12, "1/rad^2", "Cost of a knee's squared swing.")
    swings: int = setting(6, "count", "Swings that are tried in each direction.")
    change: float = setting(2.0, "1/rad^2", "Cost of a squared change of the swing.")


@dataclass(frozen=True)
class HandTurnConfig:
    """Turns of a holding hand about its palm."""

    headings: tuple[float, ...] = setting(
        (0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5),
        "rad",
        "Turns about the palm's normal that are tried.",
    )
    lifts: tuple[float, ...] = setting(
        (0.0, 0.5, 1.0), "rad", "Turns of the wrist up from the surface that are tried."
    )
    moved_share: float = setting(
        0.4,
        "share",
        "Least share of the wrist's motion in a sphere's for it to belong to the hand or forearm.",
    )
    stiffness: float = setting(0.15, "1/rad^2", "Cost of a hand's squared turn.")
    change: float = setting(2.0, "1/rad^2", "Cost of a squared change of the turn.")


@dataclass(frozen=True)
class ContactFaceConfig:
    """When a hand holds the other face of a thin board."""

    thickest: float = setting(0.08, "m", "Largest thickness of a board.")
    thinnest: float = setting(
        1.25,
        "palm thicknesses",
        "Depth behind the palm beyond which a surface is the other face, not the held one.",
    )
    beside: float = setting(
        0.03, "m", "Largest distance of its other face from the line through it."
    )
    crossed: float = setting(
        0.5,
        "cost",
        "Mean cost of penetration in a frame below which an arm only brushes the board.",
    )
    twist: float = setting(
        2.0, "cost", "Cost in a frame of a hand whose back, not palm, is towards what it holds."
    )
    on_top: float = setting(
        2.0, "cost", "Cost in a frame of a hand that lies on top of what rises."
    )
    rise: float = setting(0.1, "m", "Way up from which a place that is held rises.")
    top: float = setting(
        0.7,
        "share",
        "Cosine between up and the way out of the surface from which a hand is on top.",
    )


@dataclass(frozen=True)
class ApproachConfig:
    """When a hand that approaches or leaves an object is led around it."""

    longest: int = setting(30, "frames", "Longest time of an approach.")
    pace: float = setting(0.05, "m/frame", "Mean speed of a hand that is led around (1.5 m/s).")
    depth: float = setting(
        0.005, "m", "Depth of a palm joint in the object from which a hand is led around."
    )
    clearance: float = setting(
        0.01,
        "m",
        "Distance of a palm joint from the object where its curve around begins, and how far below its ends "
        "that curve may pass.",
    )
    finer: int = setting(3, "count", "Steps from frame to frame at which the depth is measured.")


SIDES = SideConfig()
ROOT_SHIFT = RootShiftConfig()
FOOT_SHIFT = FootShiftConfig()
LIMB_SWING = LimbSwingConfig()
HAND_TURN = HandTurnConfig()
CONTACT_FACE = ContactFaceConfig()
APPROACH = ApproachConfig()


@dataclass(frozen=True)
class CollisionConfig:
    """All numbers of collision avoidance."""

    sides: SideConfig = SIDES
    root: RootShiftConfig = ROOT_SHIFT
    feet: FootShiftConfig = FOOT_SHIFT
    limbs: LimbSwingConfig = LIMB_SWING
    hands: HandTurnConfig = HAND_TURN
    contact_face: ContactFaceConfig = CONTACT_FACE
    approach: ApproachConfig = APPROACH


COLLISION = CollisionConfig()
