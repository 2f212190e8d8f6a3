"""Numbers of the two stages that are used when a motion is generated, as they were in training."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class HandStageConfig:
    """Headings in which samples of the hands are generated."""

    heading_spread: float = setting(
        0.4, "rad", "Standard deviation of headings from the heading of travel."
    )
    uniform_every: int = setting(4, "samples", "One heading of so many is uniform over the circle.")


@dataclass(frozen=True)
class BodyStageConfig:
    """The path from which the body is measured."""

    reference_smoothing: float = setting(
        10.0, "frames", "Standard deviation of the filter over the reference path."
    )


@dataclass(frozen=True)
class ContactRuleConfig:
    """The paper's contact constraint."""

    touch: float = setting(
        0.03,
        "m",
        "Distance from palm to nearest vertex that counts as touching (OMOMO, section 3.3).",
    )


HAND_STAGE = HandStageConfig()
BODY_STAGE = BodyStageConfig()
CONTACT_RULE = ContactRuleConfig()


@dataclass(frozen=True)
class StagesConfig:
    """All numbers of the stages."""

    hands: HandStageConfig = HAND_STAGE
    body: BodyStageConfig = BODY_STAGE
    contact_rule: ContactRuleConfig = CONTACT_RULE


STAGES = StagesConfig()
