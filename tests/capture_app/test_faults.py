"""What could not be satisfied is told with its time, the longest stretches first."""

from dataclasses import replace

import numpy as np

from capture_app.faults import unsatisfied
from omomo_core.generation.person import Person


def test_the_longest_stretches_are_told_in_the_order_of_time(people: tuple[Person, ...]) -> None:
    miss, depth = np.zeros((40, 2)), np.zeros(40)
    miss[3:6, 0], miss[20:30, 1], miss[35:37, 1] = 0.04, 0.08, 0.5
    depth[8:15], depth[16:20] = 0.06, 0.02
    assert unsatisfied(replace(people[0], miss=miss, depth=depth)) == (
        "From 0.10 to 0.20 s the left palm is up to 4 cm off its place on the object.",
        "From 0.27 to 0.50 s the body is up to 6 cm inside the object.",
        "From 0.67 to 1.00 s the right palm is up to 8 cm off its place on the object.",
    )


def test_nothing_is_told_of_a_motion_without_faults(people: tuple[Person, ...]) -> None:
    assert unsatisfied(replace(people[0], miss=np.zeros((40, 2)), depth=np.zeros(40))) == ()
