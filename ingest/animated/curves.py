"""Blender's F-curves: one number over time, through keyframes.

Facts: Blender manual, "F-Curves > Handles & Interpolation" (auto-clamped handles never overshoot a
key, ends are eased, handle smoothing is "continuous acceleration"); the numbers agree with
`FCurve.evaluate` of Blender 5.0.
"""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from jaxtyping import Bool, Float64, Int
from scipy.linalg import solve_banded

Mode = Literal["bezier", "linear", "constant"]
MODES: tuple[Mode, ...] = get_args(Mode)

_BISECTIONS = 52
_ROUNDING = 1e-5
_MAX_ROUNDS = 100


def evaluate(
    times: Float64[np.ndarray, " keys"],
    values: Float64[np.ndarray, " keys"],
    modes: Sequence[Mode],
    handles: Float64[np.ndarray, "keys 2 2"] | None,
    at: Float64[np.ndarray, " samples"],
) -> Float64[np.ndarray, " samples"]:
    """The curve at the wanted times; before the first and after the last key it is constant.

    Args:
        times: of the keys, increasing, at least two.
        values: of the keys.
        modes: how the curve goes on from each key to the next.
        handles: (time, value) of each key's left and right Bezier handle; None makes them
            auto-clamped.
        at: when the curve is wanted.
    """
    handles = auto_clamped(times, values) if handles is None else handles
    at = at.clip(times[0], times[-1])
    k = last_key(times, at).clip(0, len(times) - 2)
    mode = np.array([MODES.index(m) for m in modes])[k]
    along = ((at - times[k]) / (times[k + 1] - times[k])).clip(0, 1)
    straight = values[k] + along * (values[k + 1] - values[k])
    curves = [_bezier(times, values, handles, k, along), straight, values[k]]
    return np.where(last_key(times, at) == len(times) - 1, values[-1], np.choose(mode, curves))


def last_key(
    times: Float64[np.ndarray, " keys"], at: Float64[np.ndarray, " samples"]
) -> Int[np.ndarray, " samples"]:
    """The last key at or before each time (seconds), the first where there is none.

    A key that is only a rounding error away is reached: a step must not come a frame late.
    """
    return (np.searchsorted(times, at + _ROUNDING, side="right") - 1).clip(0)


def auto_clamped(
    times: Float64[np.ndarray, " keys"], values: Float64[np.ndarray, " keys"]
) -> Float64[np.ndarray, "keys 2 2"]:
    """(time, value) of each key's left and right handle, as Blender places them by itself.

    Each handle is a third of its interval long. Slopes are those of the spline with continuous
    acceleration that starts and ends flat, within bounds: flat where the keys turn, nowhere beyond
    the value of the neighbouring key.
    """
    step = np.diff(times)
    slopes = _bounded_slopes(step, np.diff(values) / step)
    reach = np.stack([-np.append(step[0], step), np.append(step, step[-1])], axis=1) / 3
    return np.stack([times[:, None] + reach, values[:, None] + slopes[:, None] * reach], axis=2)


def _bounded_slopes(
    step: Float64[np.ndarray, " steps"], rise: Float64[np.ndarray, " steps"]
) -> Float64[np.ndarray, " keys"]:
    """Slope at each key, given the length of the intervals and the mean slope in each."""
    before, after = rise[:-1], rise[1:]
    steepest = 3 * np.minimum(np.abs(before), np.abs(after))
    bound = np.where(before * after > 0, np.sign(before) * steepest, 0.0)
    low, high = np.minimum(bound, 0), np.maximum(bound, 0)
    weight = 1 / step
    wanted = 3 * (before * weight[:-1] + after * weight[1:])
    at_low = at_high = low == high
    slopes = low
    for _ in range(_MAX_ROUNDS):
        slopes, push = _solve(weight, wanted, at_low | at_high, np.where(at_high, high, low))
        # A slope is let go of its bound when the spline pulls it back inside.
        now_low = (low == high) | np.where(at_low, push < 0, slopes < low)
        now_high = (low == high) | np.where(at_high, push > 0, slopes > high)
        if (now_low == at_low).all() and (now_high == at_high).all():
            break
        at_low, at_high = now_low, now_high
    return np.pad(slopes.clip(low, high), 1)


def _solve(
    weight: Float64[np.ndarray, " steps"],
    wanted: Float64[np.ndarray, " inner"],
    pinned: Bool[np.ndarray, " inner"],
    pins: Float64[np.ndarray, " inner"],
) -> tuple[Float64[np.ndarray, " inner"], Float64[np.ndarray, " inner"]]:
    """Slopes of the spline with some of them pinned, and how hard it pushes each."""
    side, middle = weight[1:-1], 2 * (weight[:-1] + weight[1:])
    bands = np.zeros((3, len(wanted)))
    bands[0, 1:] = np.where(pinned[:-1], 0, side)
    bands[1] = np.where(pinned, 1, middle)
    bands[2, :-1] = np.where(pinned[1:], 0, side)
    slopes = solve_banded((1, 1), bands, np.where(pinned, pins, wanted)) if len(wanted) else wanted
    held = middle * slopes
    held[:-1] += side * slopes[1:]
    held[1:] += side * slopes[:-1]
    return slopes, wanted - held


def _bezier(
    times: Float64[np.ndarray, " keys"],
    values: Float64[np.ndarray, " keys"],
    handles: Float64[np.ndarray, "keys 2 2"],
    k: Int[np.ndarray, " samples"],
    along: Float64[np.ndarray, " samples"],
) -> Float64[np.ndarray, " samples"]:
    """The Bezier segments that start at keys k, at the given fractions of their time."""
    step = times[k + 1] - times[k]
    t1, v1 = _shortened(handles[k, 1] - np.stack([times[k], values[k]], 1), step)
    t2, v2 = _shortened(np.stack([times[k + 1], values[k + 1]], 1) - handles[k + 1, 0], step)
    low, high = np.zeros_like(along), np.ones_like(along)
    for _ in range(_BISECTIONS):  # time along a segment only grows, so halving finds it
        u = (low + high) / 2
        early = 3 * u * (1 - u) ** 2 * t1 + 3 * u**2 * (1 - u) * (1 - t2) + u**3 < along
        low, high = np.where(early, u, low), np.where(early, high, u)
    u = (low + high) / 2
    points = (values[k], values[k] + v1, values[k + 1] - v2, values[k + 1])
    weights = ((1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3)
    return np.sum([w * p for w, p in zip(weights, points, strict=True)], axis=0)


def _shortened(
    handle: Float64[np.ndarray, "samples 2"], step: Float64[np.ndarray, " samples"]
) -> tuple[Float64[np.ndarray, " samples"], Float64[np.ndarray, " samples"]]:
    """Time (as a fraction of the segment) and value of handles that stay within their segment."""
    reach = handle[:, 0] / step
    kept = reach.clip(0, 1)
    factor = np.divide(kept, reach, out=np.ones_like(reach), where=np.abs(reach) > 1e-12)
    return kept, handle[:, 1] * factor
