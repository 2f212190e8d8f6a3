"""All classes of props, and how often each is used in which way."""

from collections.abc import Callable

import numpy as np

from omomo_core.data.synthesis.props import (
    containers,
    household,
    poles,
    rolling,
    seating,
    tables,
    tools,
)
from omomo_core.data.synthesis.props.affordances import find_grasps
from omomo_core.data.synthesis.props.blueprint import Blueprint, turned
from omomo_core.data.synthesis.props.furniture import Furniture
from omomo_core.data.synthesis.props.prop import Prop, Use

MAKERS: dict[str, Callable[[np.random.Generator], Blueprint]] = {
    "large_table": tables.large_table,
    "small_table": tables.small_table,
    "wood_chair": seating.wood_chair,
    "white_chair": seating.white_chair,
    "office_chair": seating.office_chair,
    "stool": seating.stool,
    "armchair": seating.armchair,
    "small_box": containers.small_box,
    "large_box": containers.large_box,
    "plastic_box": containers.plastic_box,
    "trash_can": containers.trash_can,
    "bucket": containers.bucket,
    "basket": containers.basket,
    "toolbox": containers.toolbox,
    "suitcase": rolling.suitcase,
    "pushcart": rolling.pushcart,
    "hand_truck": rolling.hand_truck,
    "floor_lamp": poles.floor_lamp,
    "clothes_stand": poles.clothes_stand,
    "tripod": poles.tripod,
    "mop": tools.mop,
    "broom": tools.broom,
    "vacuum": tools.vacuum,
    "monitor": household.monitor,
    "shelf": household.shelf,
    "cabinet": household.cabinet,
    "ladder": household.ladder,
}
WEIGHTS: dict[Use, dict[str, float]] = {
    "lift": {
        "small_box": 3, "large_box": 4, "plastic_box": 3, "wood_chair": 4, "white_chair": 3, "stool": 1.5,
        "small_table": 4, "large_table": 3, "suitcase": 2, "trash_can": 2.5, "monitor": 3, "floor_lamp": 3,
        "clothes_stand": 2.5, "tripod": 2.5, "mop": 0.7, "broom": 0.4, "vacuum": 0.8, "bucket": 0.7,
        "basket": 1, "toolbox": 0.7, "shelf": 1, "ladder": 0.8,
    },
    "push": {
        "large_table": 5, "small_table": 3, "wood_chair": 4, "white_chair": 3, "office_chair": 2,
        "large_box": 4, "suitcase": 3, "trash_can": 2, "pushcart": 2, "hand_truck": 0.7, "armchair": 1.2,
        "shelf": 1, "cabinet": 2, "floor_lamp": 1.5, "clothes_stand": 1.5, "tripod": 1, "ladder": 0.4,
        "stool": 0.5,
    },
    "one_hand": {
        "suitcase": 3, "bucket": 1, "basket": 1, "toolbox": 1.5, "floor_lamp": 2, "clothes_stand": 1.5,
        "tripod": 2.5, "mop": 2, "broom": 1, "vacuum": 2, "wood_chair": 1.5, "white_chair": 1.5,
        "small_table": 0.5, "ladder": 0.7, "large_box": 0.4, "monitor": 0.5,
    },
    "tool": {"mop": 4, "broom": 2, "vacuum": 4},
    "tip": {
        "large_table": 3, "small_table": 2, "wood_chair": 4, "white_chair": 2.5, "large_box": 4,
        "suitcase": 2.5, "trash_can": 2, "hand_truck": 1, "shelf": 1.5, "cabinet": 2, "floor_lamp": 2,
        "clothes_stand": 2, "tripod": 2, "ladder": 1, "armchair": 1,
    },
}  # fmt: skip
_FURNITURE = 0.15
"""Share of props that come from meshes, when there are any."""
_TRIES = 6


def make_prop(rng: np.random.Generator, use: Use, furniture: Furniture | None = None) -> Prop:
    """A random prop that can be used in this way, seen from one of its sides.

    Args:
        rng: source of all randomness.
        use: what is done with it; see `Use`.
        furniture: meshes to choose from besides the procedural classes.
    """
    names = list(WEIGHTS[use])
    chances = np.array(list(WEIGHTS[use].values()))
    while True:
        name = names[rng.choice(len(names), p=chances / chances.sum())]
        build = MAKERS[name]
        if furniture is not None and rng.random() < _FURNITURE:
            build = furniture.draw
        # The same class again, so that classes with few such grasps do not become rare.
        for _ in range(_TRIES):
            prop = placed(rng, build(rng))
            if any(g.use == use for g in prop.grasps):
                return prop


def placed(rng: np.random.Generator, plan: Blueprint) -> Prop:
    """The thing before a person at one of its sides, with the ways to hold it from there."""
    sides = np.array(plan.sides)
    plan = turned(plan, int(rng.choice(4, p=sides / sides.sum())))
    grasps = find_grasps(rng, plan)
    return Prop(plan.name, plan.parts, grasps, plan.mass, plan.wheels, plan.stands)
