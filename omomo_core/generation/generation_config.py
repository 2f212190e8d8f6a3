"""Numbers of the generator: chunks, prefixes, despiking, decoding, and those of its rooms."""

from dataclasses import dataclass

from omomo_core.config import setting
from omomo_core.generation.collision.collision_config import COLLISION, CollisionConfig
from omomo_core.generation.selection.selection_config import SELECTION, SelectionConfig
from omomo_core.generation.solving.solving_config import SOLVING, SolvingConfig


@dataclass(frozen=True)
class ChunkSizes:
    """Sizes of chunks.

    Every chunk begins with frames that the chunk before has fixed (`context`) and ends with frames that the
    chunk after generates again with more of the future in view (`margin`).
    """

    length: int = setting(600, "frames", "Length of a chunk.")
    context: int = setting(30, "frames", "Frames that the chunk before has fixed.")
    margin: int = setting(30, "frames", "Frames that the chunk after generates again.")
    spare: int = setting(
        120, "frames", "A rest of the take that is no longer than this is added to its last chunk."
    )

    @property
    def step(self) -> int:
        """Frames between the beginnings of two chunks."""
        return self.length - self.context - self.margin


@dataclass(frozen=True)
class PrefixConfig:
    """How fixed first frames pull on those after them."""

    fade: int = setting(20, "frames", "Time over which a prefix pulls on the frames after it.")
    start_pose_fade: int = setting(
        90,
        "frames",
        "Time over which a start pose pulls on the body: people keep their way of standing for a while.",
    )
    start_pose_touch: float = setting(
        0.05, "m", "Distance between palm joint and surface that counts as holding in a start pose."
    )


@dataclass(frozen=True)
class DespikingConfig:
    """How jumps of a sampled motion are spread over time."""

    fastest: float = setting(0.12, "m/frame", "Faster joints (3.6 m/s) are spikes.")
    width: float = setting(
        4.0, "frames", "Standard deviation of the filter that spreads a spike over time."
    )
    rounds: int = setting(3, "count", "Most passes of that filter.")


@dataclass(frozen=True)
class BodyDecodingConfig:
    """From the features of stage 2 to a body."""

    feature_smoothing: float = setting(
        1.0,
        "frames",
        "Standard deviation of the filter over features: frames of a patch are decoded together.",
    )
    pelvis_tilt: float = setting(
        0.25,
        "share",
        "Pitch of the pelvis for each degree of the chest's: the mean over four libraries of recorded "
        "people (benchmarks/pelvis.py: 0.29 cmu_bvh, 0.45 cmu_jump, -0.08 hdm05, 0.29 o3de).",
    )
    following: int = setting(
        16, "frames", "Time in which an arm comes from the sample to its palm's path, and back."
    )
    leaning_height: float = setting(
        0.05, "m", "Height of the lowest point of an object below which it may be leant on."
    )
    leaning_smoothing: float = setting(
        5.0, "frames", "Standard deviation of the filter between leaning and balancing."
    )


@dataclass(frozen=True)
class RetargetingConfig:
    """When two bodies differ only in size."""

    equal_legs: float = setting(
        1e-4, "m", "Largest difference of legs that count as of one shape at one size."
    )


@dataclass(frozen=True)
class CorrectionConfig:
    """Solving again around contacts that were corrected by hand."""

    blend: int = setting(
        20,
        "frames",
        "Time before and after a changed contact in which the body blends into the unchanged motion.",
    )
    same_anchor: float = setting(1e-4, "m", "Largest distance of anchors that count as the same.")


@dataclass(frozen=True)
class PublishedConfig:
    """What the published model needs and a phone does not know."""

    standing_distance: float = setting(
        0.35, "m", "Distance of the person who is assumed to stand before the object from its side."
    )


RECORDED = ChunkSizes()
"""Sizes for takes that are complete: twenty seconds at a time."""
LIVE = ChunkSizes(length=120, context=60, margin=20, spare=0)
"""Sizes for poses that still arrive: the newest motion is at most two seconds behind them."""
PREFIX = PrefixConfig()
DESPIKING = DespikingConfig()
BODY_DECODING = BodyDecodingConfig()
RETARGETING = RetargetingConfig()
CORRECTION = CorrectionConfig()
PUBLISHED = PublishedConfig()


@dataclass(frozen=True)
class GenerationConfig:
    """All numbers of the generator."""

    recorded_chunks: ChunkSizes = RECORDED
    live_chunks: ChunkSizes = LIVE
    prefix: PrefixConfig = PREFIX
    despiking: DespikingConfig = DESPIKING
    body_decoding: BodyDecodingConfig = BODY_DECODING
    retargeting: RetargetingConfig = RETARGETING
    collision: CollisionConfig = COLLISION
    selection: SelectionConfig = SELECTION
    solving: SolvingConfig = SOLVING
    correction: CorrectionConfig = CORRECTION
    published: PublishedConfig = PUBLISHED


GENERATION = GenerationConfig()
