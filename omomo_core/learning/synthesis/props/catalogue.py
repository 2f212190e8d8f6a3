"""All classes of props, and how often each is used in which way."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from omomo_core.learning.synthesis.props import carried_makers, furniture_makers
from omomo_core.learning.synthesis.props.affordances import find_grasps
from omomo_core.learning.synthesis.props.prop import Blueprint, Prop, Use, turned

MAKERS: dict[str, Callable[[np.random.Generator], Blueprint]] = {
    "largetable": furniture_makers.large_table,
    "smalltable": furniture_makers.small_table,
    "woodchair": furniture_makers.wood_chair,
    "whitechair": furniture_makers.white_chair,
    "officechair": furniture_makers.office_chair,
    "stool": furniture_makers.stool,
    "armchair": furniture_makers.armchair,
    "smallbox": carried_makers.small_box,
    "largebox": carried_makers.large_box,
    "plasticbox": carried_makers.plastic_box,
    "trashcan": carried_makers.trash_can,
    "bucket": carried_makers.bucket,
    "basket": carried_makers.basket,
    "toolbox": carried_makers.toolbox,
    "suitcase": carried_makers.suitcase,
    "pushcart": carried_makers.pushcart,
    "handtruck": carried_makers.hand_truck,
    "floorlamp": carried_makers.floor_lamp,
    "clothesstand": carried_makers.clothes_stand,
    "tripod": carried_makers.tripod,
    "mop": carried_makers.mop,
    "broom": carried_makers.broom,
    "vacuum": carried_makers.vacuum,
    "monitor": furniture_makers.monitor,
    "shelf": furniture_makers.shelf,
    "cabinet": furniture_makers.cabinet,
    "ladder": furniture_makers.ladder,
}
WEIGHTS: dict[Use, dict[str, float]] = {
    "lift": {
        "smallbox": 3, "largebox": 4, "plasticbox": 3, "woodchair": 4, "whitechair": 3, "stool": 1.5,
        "smalltable": 4, "largetable": 3, "suitcase": 2, "trashcan": 2.5, "monitor": 3, "floorlamp": 3,
        "clothesstand": 2.5, "tripod": 2.5, "mop": 0.7, "broom": 0.4, "vacuum": 0.8, "bucket": 0.7,
        "basket": 1, "toolbox": 0.7, "shelf": 1, "ladder": 0.8,
    },
    "push": {
        "largetable": 5, "smalltable": 3, "woodchair": 4, "whitechair": 3, "officechair": 2,
        "largebox": 5, "suitcase": 3, "trashcan": 2, "pushcart": 2, "handtruck": 0.7, "armchair": 1.2,
        "shelf": 1, "cabinet": 2, "floorlamp": 1.5, "clothesstand": 1.5, "tripod": 1, "ladder": 0.4,
        "stool": 0.5, "smallbox": 4, "plasticbox": 3, "toolbox": 0.5, "basket": 0.5, "monitor": 0.5,
    },
    "one_hand": {
        "suitcase": 3, "bucket": 1, "basket": 1, "toolbox": 1.5, "floorlamp": 2, "clothesstand": 1.5,
        "tripod": 2.5, "mop": 2, "broom": 1, "vacuum": 2, "woodchair": 1.5, "whitechair": 1.5,
        "smalltable": 0.5, "ladder": 0.7, "largebox": 0.4,
    },
    "tool": {"mop": 4, "broom": 2, "vacuum": 4},
    "tip": {
        "largetable": 3, "smalltable": 2, "woodchair": 4, "whitechair": 2.5, "largebox": 4,
        "suitcase": 2.5, "trashcan": 2, "handtruck": 1, "shelf": 1.5, "cabinet": 2, "floorlamp": 2,
        "clothesstand": 2, "tripod": 2, "ladder": 1, "armchair": 1,
    },
}  # fmt: skip
_TRIES = 6


@dataclass(frozen=True)
class Stock:
    """The classes of props that a data set draws from."""

    classes: frozenset[str] | None = None
    """Names of `MAKERS`; None for all."""

    def of_use(self, use: Use) -> dict[str, float]:
        """The classes that can be used in this way, and how often each is."""
        classes = MAKERS if self.classes is None else self.classes
        return {name: float(weight) for name, weight in WEIGHTS[use].items() if name in classes}


ALL = Stock()


def make_prop(rng: np.random.Generator, use: Use, stock: Stock = ALL) -> Prop:
    """A random prop that can be used in this way, seen from one of its sides.

    Args:
        rng: source of all randomness.
        use: what is done with it; see `Use`.
        stock: what there is; some class of it can be used so.
    """
    chances = stock.of_use(use)
    names, weights = list(chances), np.array(list(chances.values()))
    while True:
        name = names[rng.choice(len(names), p=weights / weights.sum())]
        # The same class again, so that classes with few such grasps do not become rare.
        for _ in range(_TRIES):
            prop = placed(rng, MAKERS[name](rng))
            if any(g.use == use for g in prop.grasps):
                return prop


def placed(rng: np.random.Generator, plan: Blueprint) -> Prop:
    """The thing before a person at one of its sides, with the ways to hold it from there."""
    sides = np.array(plan.sides)
    plan = turned(plan, int(rng.choice(4, p=sides / sides.sum())))
    grasps = find_grasps(rng, plan)
    return Prop(plan.name, plan.parts, grasps, plan.mass, plan.wheels, plan.stands)
