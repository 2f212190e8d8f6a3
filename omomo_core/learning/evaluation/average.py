"""Many windows' figures become one row of a table."""

from collections.abc import Mapping, Sequence

import numpy as np

Row = dict[str, float]

_SCORES = ("contact_precision", "contact_recall", "contact_f1")
_SIDES = ("left_", "right_")


def average(rows: Sequence[Mapping[str, float]]) -> Row:
    """Plain mean over windows, as published, and contact without the oddity of that mean.

    In the plain mean a window in which nobody ever touches counts as a failure, whatever is
    generated. ``contact_..._all_frames`` counts the frames of all windows together;
    ``contact_..._where_held`` leaves out windows in which nobody truly touches, and ``hand_contact_...``
    is the mean over hands that truly touch in their window.
    """
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    if "contact_hit_frames" not in mean:
        return mean
    hit, found, true = (mean[f"contact_{name}_frames"] for name in ("hit", "found", "true"))
    mean["contact_precision_all_frames"] = hit / max(found, 1e-9)
    mean["contact_recall_all_frames"] = hit / max(true, 1e-9)
    mean["contact_f1_all_frames"] = 2 * hit / max(found + true, 1e-9)
    for score in _SCORES:
        mean[f"{score}_where_held"] = _where_held(rows, score, ("",))
        mean[f"hand_{score}"] = _where_held(rows, score, _SIDES)
    return mean


def _where_held(rows: Sequence[Mapping[str, float]], score: str, sides: Sequence[str]) -> float:
    """Mean over the windows (and hands) that truly touch; 0 if there are none."""
    kept = [
        row[f"{side}{score}"]
        for row in rows
        for side in sides
        if row[f"{side}contact_true_frames"] > 0
    ]
    return float(np.mean(kept)) if kept else 0.0
