"""Numbers of the contacts: when an object must be held, by which hand, and at which place."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class SupportConfig:
    """When an object moves by itself, rests, or must be held."""

    moving_speed: float = setting(
        0.10, "m/s", "Speed of the centre above which an object does not move by itself."
    )
    turning_speed: float = setting(
        0.5, "rad/s", "Angular speed above which an object does not move by itself."
    )
    resting_speed: float = setting(
        0.02,
        "m/s",
        "Speed below which an object may rest on something; a held object trembles more.",
    )
    resting_turning_speed: float = setting(
        0.1, "rad/s", "Angular speed below which an object may rest on something."
    )
    smoothing: int = setting(
        5,
        "frames",
        "Least width of the mean over velocities that are compared with the resting speeds.",
    )
    widest_smoothing: int = setting(21, "frames", "Greatest width of it, in a noisy take.")
    noise_margin: float = setting(
        8.0,
        "standard deviations",
        "Way between two poses of a resting object that noise does not reach.",
    )
    quiet_share: float = setting(
        0.2, "share", "Share of the frames, the quietest, that tell the tracker's noise."
    )
    rest_frames: int = setting(
        15,
        "frames",
        "Shortest stillness that counts as a rest, and shortest slow motion that counts as one.",
    )
    short_rest: int = setting(
        20, "frames", "Half the longest rest that does not end the time for which it is held."
    )
    longest_hold: int = setting(
        300, "frames", "Time of a hold within which its middle is looked for."
    )
    shortest_run: int = setting(
        6, "frames", "Shorter stretches in which an object must be held are noise of the tracker."
    )
    gripping: int = setting(
        6,
        "frames",
        "Time that hands may be on an object before it is first lifted, and after it was set down. Palms "
        "are within 5 cm of it some frames longer.",
    )
    touching: int = setting(
        0,
        "frames",
        "The same for an object that slides flat over the floor, which moves as soon as it is pushed.",
    )
    flat_rise: float = setting(
        0.02, "m", "Rise of the middle of an object up to which it slides flat."
    )
    lifted_rise: float = setting(
        0.05, "m", "Rise of the middle of an object from which it is lifted or tipped."
    )


@dataclass(frozen=True)
class StabilityConfig:
    """When a tilted object would fall, and the force that holds it up."""

    floor_reach: float = setting(
        0.03, "m", "Height of the lowest point below which the floor carries the object."
    )
    stable_overhang: float = setting(
        0.03, "m", "Largest overhang of the centre of mass beyond the support that is stable."
    )
    sole: float = setting(
        0.02, "m", "Points no higher than this above the lowest one may touch the floor."
    )
    tilt_step: float = setting(0.01, "rad", "Tilts that differ by less share one computation.")
    outline_directions: int = setting(
        256, "count", "Directions in which the object's outline is sampled."
    )
    support_directions: int = setting(
        32, "count", "Horizontal directions in which the object's support is sampled."
    )
    friction: float = setting(
        0.4, "share", "Coefficient of friction of wood, metal or plastic on a floor."
    )
    shortest_tipping: int = setting(
        15, "frames", "An object that is tipped for less does not tell from which side it is held."
    )
    shortest_lever: float = setting(0.02, "m", "Shortest lever arm of a hand that holds it up.")


@dataclass(frozen=True)
class DecodingConfig:
    """Costs of the likeliest path of both hands through holding and letting go (Viterbi)."""

    shortest: int = setting(6, "frames", "Shorter contacts and pauses vanish.")
    certain: float = setting(
        3.0,
        "log odds",
        "Certainty of a network (a probability of 0.95) beyond which more does not count.",
    )
    unheld: float = setting(
        1000.0, "cost", "Cost of a frame in which an object that must be held is not."
    )
    distance: float = setting(
        1.0,
        "log odds/m",
        "Cost of holding with a palm off the surface: it decides between two hands that are equally "
        "unlikely.",
    )

    @property
    def change(self) -> float:
        """Cost of taking hold or letting go, log odds: `shortest` certain frames pay for both."""
        return self.shortest * self.certain / 2


@dataclass(frozen=True)
class RegraspConfig:
    """When a hand on the object goes from one place of it to another."""

    stay: int = setting(12, "frames", "Shortest stay of a palm at a place.")
    apart: float = setting(
        0.10, "m", "Smallest distance between two places: less is the prediction's wavering."
    )
    pace: float = setting(0.05, "m/frame", "Speed of the hand on its way (1.5 m/s).")
    quickest: int = setting(6, "frames", "Shortest time on the way.")
    slowest: int = setting(15, "frames", "Longest time on the way.")


@dataclass(frozen=True)
class DetourConfig:
    """Which curves around the object are tried for a hand that goes to another place of it."""

    points: int = setting(48, "count", "Points of a path.")
    lifts: tuple[float, ...] = setting(
        (0.1, 0.25), "m", "Distances of the curve's control points from the surface."
    )
    bulges: tuple[float, ...] = setting(
        (0.0, 0.15, 0.3, 0.5, 0.75), "m", "How far the control points are moved to a side."
    )
    sides: int = setting(12, "count", "Sides that are tried, all around the straight line.")


@dataclass(frozen=True)
class AnchorConfig:
    """Numbers of keeping palms on the object, and of their approach."""

    palm_thickness: float = setting(
        0.029, "m", "Distance from the palm joint, inside the hand, to the skin that touches."
    )
    least_clearance: float = setting(
        0.75,
        "palm thicknesses",
        "Distance of a palm joint from the surface below which it would be in another part of the object.",
    )
    blend: int = setting(
        8, "frames", "Time in which a palm goes from the prediction onto its anchor, and back."
    )


@dataclass(frozen=True)
class EditedContactsConfig:
    """What contacts that were corrected by hand may ask for."""

    shortest_travel: int = setting(3, "frames", "Shortest time of a hand between two places.")
    farthest_anchor: float = setting(
        0.08, "m", "Distance from the surface beyond which a palm joint holds nothing."
    )


SUPPORT = SupportConfig()
STABILITY = StabilityConfig()
DECODING = DecodingConfig()
REGRASP = RegraspConfig()
DETOUR = DetourConfig()
ANCHOR = AnchorConfig()
EDITED_CONTACTS = EditedContactsConfig()


@dataclass(frozen=True)
class ContactConfig:
    """All numbers of the contacts."""

    support: SupportConfig = SUPPORT
    stability: StabilityConfig = STABILITY
    decoding: DecodingConfig = DECODING
    regrasp: RegraspConfig = REGRASP
    detour: DetourConfig = DETOUR
    anchor: AnchorConfig = ANCHOR
    edited: EditedContactsConfig = EDITED_CONTACTS


CONTACT = ContactConfig()
