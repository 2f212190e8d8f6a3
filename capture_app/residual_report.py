"""What the solver could not satisfy in a motion, what of it no person does, and when, in words."""

from omomo_core.generation.person import Person
from omomo_core.generation.selection.speed_limits import Leap, find_leaps
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

FAR = 0.03
"""Metres off a palm's place, or inside the object, that are worth a word."""
MOST = 3
"""So many stretches are told, the longest ones."""
MOST_LEAPS = 5
"""So many leaps are told besides, the farthest beyond what people do: one of each limb at a time."""

_Told = tuple[int, int, str]
"""First frame, frame after the last, what is wrong."""


def unsatisfied(person: Person) -> tuple[str, ...]:
    """When a palm is off its place, the body is in the object, or a limb is faster than people are.

    In the order of time.
    """
    told = sorted([*_misses(person), *_leaps(person)])
    return tuple(f"From {a / FPS:.2f} to {b / FPS:.2f} s {text}." for a, b, text in told)


def _misses(person: Person) -> list[_Told]:
    told = (
        ("the left palm is up to {:.0f} cm off its place on the object", person.miss[:, 0]),
        ("the right palm is up to {:.0f} cm off its place on the object", person.miss[:, 1]),
        ("the body is up to {:.0f} cm inside the object", person.depth),
    )
    stretches = [
        (start, stop, text.format(100 * curve[start:stop].max()))
        for text, curve in told
        for start, stop in runs(curve > FAR)
    ]
    return sorted(stretches, key=lambda s: s[0] - s[1])[:MOST]


def _leaps(person: Person) -> list[_Told]:
    worst = sorted(find_leaps(person.human), key=lambda leap: -leap.speed / leap.limit)[:MOST_LEAPS]
    return [(leap.start, leap.stop, _in_words(leap)) for leap in worst]


def _in_words(leap: Leap) -> str:
    name, speed, limit = leap.part.name, leap.speed, leap.limit
    if leap.turns:
        return f"the {name} turns at {speed:.0f} degrees a second; people reach {limit:.0f}"
    return f"the {name} moves at {speed:.1f} m/s; people reach {limit:.1f}"
