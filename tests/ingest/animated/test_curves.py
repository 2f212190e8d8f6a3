"""F-curves: the numbers of Blender, and what an animator relies on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.animated.curves import MODES, evaluate

# Keys and FCurve.evaluate of Blender 5.0.1: new keys are auto-clamped with continuous acceleration.
BLENDER = [
    (
        [(1, 0.0), (10, 1.0), (31, 5.0), (40, 4.5), (60, 4.4), (61, 9.0)],
        ["bezier"] * 6,
        {3.0: 0.056241, 8.25: 0.671452, 15.0: 2.159702, 27.0: 4.744736, 39.25: 4.519291, 60.5: 6.7},
    ),
    (
        [(0, 0.0), (10, 1.0), (20, 3.0), (30, 3.5), (40, 7.0)],
        ["bezier", "linear", "bezier", "constant", "bezier"],
        {5.5: 0.3025, 11.5: 1.3, 22.75: 3.154945, 27.0: 3.2345, 33.5: 3.5, 39.25: 3.5},
    ),
    (
        [(0, 0.0), (10, 5.0), (11, 5.5), (12, 6.0), (40, 6.1), (50, 20.0)],
        ["bezier"] * 6,
        {3.0: 0.788365, 8.25: 4.042847, 22.75: 6.049375, 45.0: 13.063393, 50.5: 20.0},
    ),
]


@pytest.mark.parametrize(("keys", "modes", "expected"), BLENDER)
def test_curves_are_those_of_blender(keys, modes, expected):
    times, values = np.array(keys, float).T
    at = np.array(list(expected))
    found = evaluate(times, values, modes, None, at)
    np.testing.assert_allclose(found, list(expected.values()), atol=2e-6)


def test_handles_beyond_the_next_key_are_shortened_as_in_blender():
    values = [0.0, 0.8226570286936398, 0.8226570286936398]
    handles = [
        [(-1.0, 0.0), (26.916542053222656, 0.0005275654257275164)],
        [(-12.461289405822754, 1.0131981372833252), (45.78498840332031, 1.1319714784622192)],
        [(20.270105361938477, -0.16814568638801575), (51.763641357421875, 1.1547422409057617)],
    ]
    at = np.array([1.25, 3.5, 8.0, 10.25, 14.75, 19.25, 21.5])
    expected = [0.001856, 0.017399, 0.205003, 0.776054, 0.831533, 0.750441, 0.543734]
    found = evaluate(
        np.array([0.0, 17.0, 22.0]), np.array(values), ["bezier"] * 3, np.array(handles), at
    )
    np.testing.assert_allclose(found, expected, atol=2e-5)


keys = st.lists(st.tuples(st.floats(0.05, 5.0), st.floats(-3.0, 3.0)), min_size=2, max_size=9).map(
    lambda rows: (np.cumsum([step for step, _ in rows]), np.array([v for _, v in rows]))
)


@given(keys, st.sampled_from(MODES))
@settings(max_examples=30)
def test_curves_go_through_their_keys_and_never_beyond(keyed, mode):
    times, values = keyed
    at = np.linspace(times[0] - 1, times[-1] + 1, 301)
    found = evaluate(times, values, [mode] * len(times), None, at)
    at_keys = evaluate(times, values, [mode] * len(times), None, times)
    np.testing.assert_allclose(at_keys, values, atol=1e-9)
    k = (np.searchsorted(times, at, side="right") - 1).clip(0, len(times) - 2)
    low = np.minimum(values[k], values[k + 1]) - 1e-9
    high = np.maximum(values[k], values[k + 1]) + 1e-9
    assert ((low <= found) & (found <= high)).all()


def test_a_free_key_has_continuous_acceleration():
    times, values = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 3.5, 4.2])
    h = 1e-3
    for key in times[1:3]:
        at = key + np.arange(-2, 3) * h
        f = evaluate(times, values, ["bezier"] * 4, None, at)
        before, after = f[0] - 2 * f[1] + f[2], f[2] - 2 * f[3] + f[4]
        assert abs(before - after) / h**2 < 0.05
