"""Procedural things to handle: how they are built, where hands can hold them, how a scan shows them."""

from omomo_core.learning.synthesis.props.affordances import WIDEST_HOLD, side_grasp
from omomo_core.learning.synthesis.props.catalogue import ALL, Stock, make_prop
from omomo_core.learning.synthesis.props.prop import Grasp, Kind, Prop, Use, scaled

__all__ = [
    "ALL",
    "WIDEST_HOLD",
    "Grasp",
    "Kind",
    "Prop",
    "Stock",
    "Use",
    "make_prop",
    "scaled",
    "side_grasp",
]
