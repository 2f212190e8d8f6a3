"""What is told of a person's motion: what could not be satisfied, and how the hands hold, with the frames."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from omomo_core.body.grip import GRIPS
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


class Told(NamedTuple):
    """Something of a stretch of a motion."""

    start: int
    """First frame."""
    stop: int
    """The frame after the last one."""
    text: str

    @property
    def sentence(self) -> str:
        """What is told, and when."""
        return f"From {self.start / FPS:.2f} to {self.stop / FPS:.2f} s {self.text}."


def told_faults(person: Person) -> tuple[Told, ...]:
    """Return when a palm is off its place, the body is in the object, or a limb is too fast.

    In the order of time.
    """
    return tuple(sorted([*_misses(person), *_leaps(person)]))


def told_grips(person: Person) -> tuple[Told, ...]:
    """Return how each hand holds and when, in the order of time; nothing where it is not known."""
    if person.finger_fit is None:
        return ()
    held = sorted(
        (start, stop, side, name)
        for side, column in enumerate(person.finger_fit.grip.T)
        for number, name in enumerate(GRIPS)
        for start, stop in runs((column == number) & (column > 0))
    )
    return tuple(
        Told(start, stop, f"the {('left', 'right')[side]} hand holds: {name}")
        for start, stop, side, name in held
    )


def unsatisfied(person: Person) -> tuple[str, ...]:
    """The sentences of `told_faults`."""
    return tuple(told.sentence for told in told_faults(person))


def held_grips(person: Person) -> tuple[str, ...]:
    """The sentences of `told_grips`."""
    return tuple(told.sentence for told in told_grips(person))


def _misses(person: Person) -> list[Told]:
    fit = person.finger_fit
    hands = np.zeros((0, 2)) if fit is None else fit.depth
    events = (
        ("the left hand is up to {:.0f} cm inside the object", hands[:, 0]),
        ("the right hand is up to {:.0f} cm inside the object", hands[:, 1]),
        ("the left palm is up to {:.0f} cm off its place on the object", person.miss[:, 0]),
        ("the right palm is up to {:.0f} cm off its place on the object", person.miss[:, 1]),
        ("the body without hands is up to {:.0f} cm inside the object", person.depth),
    )
    stretches = [
        Told(start, stop, text.format(100 * curve[start:stop].max()))
        for text, curve in events
        for start, stop in runs(curve > FAR)
    ]
    return sorted(stretches, key=lambda s: s.start - s.stop)[:MOST]


def _leaps(person: Person) -> list[Told]:
    worst = sorted(find_leaps(person.human), key=lambda leap: -leap.speed / leap.limit)[:MOST_LEAPS]
    return [Told(leap.start, leap.stop, _in_words(leap)) for leap in worst]


def cause_of_leaps(person: Person, mesh: Path | None) -> Iterator[str]:
    """Say what to look at where a person is faster than people are."""
    if mesh is not None and find_leaps(person.human):
        yield (
            "Nobody is that fast. A mesh of another size or another thing makes such motions, and so does a "
            f"wrong mount: check that {mesh.name} is the object, in metres, and look at the phone on it "
            "(omocap inspect, or the page)."
        )


def _in_words(leap: Leap) -> str:
    name, speed, limit = leap.part.name, leap.speed, leap.limit
    if leap.turns:
        return f"the {name} turns at {speed:.0f} degrees a second; people reach {limit:.0f}"
    return f"the {name} moves at {speed:.1f} m/s; people reach {limit:.1f}"
