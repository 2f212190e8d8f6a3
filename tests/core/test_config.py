"""Numbers that shape a motion are fields of configurations, and each says what it is."""

import ast
from dataclasses import dataclass

import pytest

from omomo_core.config import Setting, setting, settings_of
from tests.conftest import REPO

ROOMS = (
    "omomo_core/contact",
    "omomo_core/generation",
    "omomo_core/body",
    "omomo_core/geometry",
    "omomo_core/stages",
    "ingest/trajectory",
)
NO_SETTINGS = {
    # The body's shape and mass, measured or fitted once: data, as the mesh is.
    "omomo_core/body/trajectory_optimization/obstacle.py": {
        *("STATURE", "_MIDDLE", "_LEFT", "_ROWS", "COARSE_SPHERES"),
    },
    "omomo_core/body/trajectory_optimization/residuals.py": {"_BETWEEN", "_MASSES"},
    # Axes of hinges in the skeleton's rest pose.
    "omomo_core/body/limbs.py": {"LIMBS"},
    # Directions that the words of a side name.
    "omomo_core/generation/selection/person_constraint.py": {"_AHEAD"},
    # Signs of a half turn.
    "omomo_core/generation/selection/plausibility.py": {"_HALF_TURN"},
    # Axes, weights of a difference, a factor of statistics, and what stamps are rounded to.
    "ingest/trajectory/gravity.py": {"_Y"},
    "omomo_core/geometry/transforms.py": {"_SIXTH"},
    "ingest/trajectory/smooth.py": {"_MAD", "_SAME_TIME"},
    # What a network was trained with; another value needs another network.
    "omomo_core/geometry/object_features.py": {"BASIS_RADIUS"},
    # What single precision changes in a quaternion.
    "omomo_core/geometry/rotations.py": {"ROUNDING"},
    "omomo_core/stages/stage_config.py": {"LEVEL_SHIFT"},
    # Parts of the time that a progress bar shows.
    "omomo_core/generation/solving/bodies.py": {"_BEFORE", "_OPTIMISING"},
}
"""Constants with fractional numbers that are no settings. This list only shrinks."""


def float_constants(source: str) -> set[str]:
    """Names that a module assigns a value with a floating-point number in it."""
    return {
        name.id
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None
        if any(isinstance(x, ast.Constant) and type(x.value) is float for x in ast.walk(node.value))
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        for name in ast.walk(target)
        if isinstance(name, ast.Name)
    }


def test_no_number_that_shapes_a_motion_is_a_module_constant():
    found = {
        file: names
        for room in ROOMS
        for path in sorted((REPO / room).rglob("*.py"))
        if path.name != "config.py"
        if (names := float_constants(path.read_text(encoding="utf-8")))
        for file in [path.relative_to(REPO).as_posix()]
    }
    assert found == NO_SETTINGS


@dataclass(frozen=True)
class Inner:
    near: float = setting(0.5, "m", "Nearness.")


@dataclass(frozen=True)
class Outer:
    rounds: int = setting(3, "count", "Rounds.")
    inner: Inner = Inner()


def test_settings_are_named_by_their_path():
    assert list(settings_of(Outer(rounds=4))) == [
        Setting("rounds", 4, "count", "Rounds."),
        Setting("inner.near", 0.5, "m", "Nearness."),
    ]


@pytest.mark.parametrize("source", ["A = 0.5", "A, B = 1, 2.0", "A: dict = {'a': (1, 0.5)}"])
def test_float_constants_are_found(source: str):
    assert "A" in float_constants(source)
