"""Statistics over windows: averages, and the paired bootstrap between two methods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Row = dict[str, float]

_SCORES = ("contact_precision", "contact_recall", "contact_f1")
_SIDES = ("left_", "right_")

DRAWS = 10_000
FAR = 60.0
"""Centimetres from which a pelvis is on another side of the object."""
_SPREAD = ("hand_jpe_cm", "mpjpe_cm", "t_root_cm")


def mean_of(rows: Sequence[Mapping[str, float]]) -> Row:
    """Plain mean of every figure over the rows that have it."""
    keys = dict.fromkeys(key for row in rows for key in row)
    return {key: float(np.mean([row[key] for row in rows if key in row])) for key in keys}


def average(rows: Sequence[Mapping[str, float]]) -> Row:
    """Plain mean over windows, as published, and contact without the oddity of that mean.

    In the plain mean a window in which nobody ever touches counts as a failure, whatever is
    generated. ``contact_..._all_frames`` counts the frames of all windows together;
    ``contact_..._where_held`` leaves out windows in which nobody truly touches, and ``hand_contact_...``
    is the mean over hands that truly touch in their window.
    """
    mean = mean_of(rows)
    for who in ("", "must_hold_"):
        if f"{who}contact_hit_frames" in mean:
            mean |= _over_all_frames(mean, f"{who}contact")
    if "contact_hit_frames" in mean:
        for score in _SCORES:
            mean[f"{score}_where_held"] = _where_held(rows, score, ("",))
            mean[f"hand_{score}"] = _where_held(rows, score, _SIDES)
    return mean


def _over_all_frames(mean: Row, contact: str) -> Row:
    hit, found, true = (mean[f"{contact}_{name}_frames"] for name in ("hit", "found", "true"))
    return {
        f"{contact}_precision_all_frames": hit / max(found, 1e-9),
        f"{contact}_recall_all_frames": hit / max(true, 1e-9),
        f"{contact}_f1_all_frames": 2 * hit / max(found + true, 1e-9),
    }


def spread(rows: Sequence[Mapping[str, float]]) -> Row:
    """Medians over windows, the share of windows with a pelvis 60 cm off, and the median onset error.

    The last one is over all hands that touch, in truth and as generated.
    """
    out: Row = {}
    for key in _SPREAD:
        if values := [row[key] for row in rows if key in row]:
            out[f"{key}_median"] = float(np.median(values))
    if far := [row["t_root_cm"] > FAR for row in rows if "t_root_cm" in row]:
        out["t_root_over_60_cm_share"] = float(np.mean(far))
    hands = [row[f"{side}onset_error_s"] for side in _SIDES for row in rows
             if f"{side}onset_error_s" in row]  # fmt: skip
    if hands:
        out["onset_error_s_median"] = float(np.median(hands))
    return out


def _where_held(rows: Sequence[Mapping[str, float]], score: str, sides: Sequence[str]) -> float:
    """Mean over the windows (and hands) that truly touch; 0 if there are none."""
    kept = [
        row[f"{side}{score}"]
        for row in rows
        for side in sides
        if row[f"{side}contact_true_frames"] > 0
    ]
    return float(np.mean(kept)) if kept else 0.0


@dataclass(frozen=True)
class PairedDifference:
    """Difference between the means of two methods over the same windows."""

    mean: float
    low: float
    high: float
    """Of the interval that holds the middle 95 % of the draws."""


def paired_bootstrap(
    first: Sequence[float], second: Sequence[float], clips: Sequence[str], seed: int = 0
) -> PairedDifference:
    """How much greater `first` is than `second` on average.

    Whole clips are drawn with replacement, because windows of one clip overlap (paired bootstrap,
    Efron and Tibshirani 1993, of clusters).

    Args:
        first: a figure of one method in each window.
        second: of the other, in the same windows.
        clips: which clip each window is from.
        seed: of the draws.
    """
    _, clip = np.unique(np.asarray(clips), return_inverse=True)
    difference = np.asarray(first, float) - np.asarray(second, float)
    total, count = np.bincount(clip, difference), np.bincount(clip)
    times = np.random.default_rng(seed).multinomial(
        len(count), np.full(len(count), 1 / len(count)), size=DRAWS
    )
    means = (times @ total) / (times @ count)
    low, high = np.percentile(means, [2.5, 97.5])
    return PairedDifference(float(difference.mean()), float(low), float(high))
