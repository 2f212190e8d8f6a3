"""What a prop is: parts, ways to hold it, weight.

A prop stands on z = 0 at the origin of its own frame; a person who handles it stands at -x and looks
along +x, with +y to the left. Metres.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.props.scan import scanned
from omomo_core.learning.synthesis.shapes import SolidPart
from omomo_core.motion import ObjectMesh

Use = Literal["lift", "push", "one_hand", "tool", "tip"]
"""Lifted with both hands; slid over the floor (pushed, pulled, dragged, turned); carried in one hand;
a pole whose end is swept over the floor; tilted on an edge or on some of its legs."""
Kind = Literal["side", "edge", "under", "rim", "face", "rail", "pole", "handle", "pinch"]
"""Opposed sides; palms on top near the near edge; under something; opposed sides at the rim of a
vessel; palms flat on the near face; a bar across; a bar to close the hands around; a carrying handle;
something thin between thumb and fingers."""


@dataclass(frozen=True)
class Grasp:
    """Where the palms lie; index 0 is left, 1 right."""

    use: Use
    points: Float[np.ndarray, "2 3"]
    """On the surface, prop frame."""
    inward: Float[np.ndarray, "2 3"]
    """From the palm into the surface, unit length."""
    fingers: Float[np.ndarray, " 3"] | None = None
    """Where the fingers point; None lets them follow the forearm."""
    kind: Kind = "side"
    one_handed: bool = False
    """Either hand alone: index 0 is how the left would do it, index 1 how the right would."""


@dataclass(frozen=True)
class Prop:
    """A thing with its possible grasps."""

    name: str
    parts: list[SolidPart]
    grasps: list[Grasp]
    mass: float = 5.0
    """Estimate, kilograms."""
    wheels: bool = False
    stands: bool = True
    """False for what falls over when it is let go."""

    @property
    def low(self) -> Float[np.ndarray, " 3"]:
        """Lower corner of the bounding box."""
        return np.min([p.low for p in self.parts], axis=0)

    @property
    def high(self) -> Float[np.ndarray, " 3"]:
        """Upper corner of the bounding box."""
        return np.max([p.high for p in self.parts], axis=0)

    def mesh(self, rng: np.random.Generator) -> ObjectMesh:
        """Its surface as a phone would scan it, whole within 1 cm around every palm; prop frame."""
        palms = np.concatenate([g.points for g in self.grasps] or [np.zeros((0, 3))])
        return ObjectMesh(*scanned(rng, self.parts, palms), self.name)


def scaled(prop: Prop, scale: float) -> Prop:
    """The prop in the world of somebody who is `scale` times as large; its weight stays."""
    parts = [
        replace(p, vertices=p.vertices * scale, low=p.low * scale, high=p.high * scale)
        for p in prop.parts
    ]
    grasps = [replace(g, points=g.points * scale) for g in prop.grasps]
    return replace(prop, parts=parts, grasps=grasps)
