"""What the solver could not satisfy in a motion, and when, in words."""

from omomo_core.generation.person import Person
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

FAR = 0.03
"""Metres off a palm's place, or inside the object, that are worth a word."""
MOST = 3
"""So many stretches are told, the longest ones."""


def unsatisfied(person: Person) -> tuple[str, ...]:
    """When a holding palm is off its place or the body is in the object, in the order of time."""
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
    longest = sorted(stretches, key=lambda s: s[0] - s[1])[:MOST]
    return tuple(f"From {a / FPS:.2f} to {b / FPS:.2f} s {text}." for a, b, text in sorted(longest))
