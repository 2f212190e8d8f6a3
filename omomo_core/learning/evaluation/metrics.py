"""The paper's measures in its units, their averages, and the paired bootstrap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

Joints = Float[np.ndarray, "frames 24 3"]
Touch = Bool[np.ndarray, "frames 2"]
ANKLES, TOES = (7, 8), (10, 11)
STILL = 0.005
"""Metres per frame: slower toes stand, for finding the floor."""
ANKLE_LOW, TOE_LOW = 0.08, 0.04
"""Metres above the floor under which ankles and toes should not slide."""
SWING_SPEED, SWING_WAY = 0.5, 0.1
"""Metres per second, and metres, from which a toe that travels is in the swing of a step."""
BACKWARDS = 0.15
"""Metres per second from which a pelvis goes backwards."""
SKIMMING = 0.03
"""Metres: a swing that stays lower skims the floor."""


def joint_errors(joints: Joints, true: Joints) -> dict[str, float]:
    """HandJPE (and of each hand) and T_root in the world, MPJPE from each one's own pelvis; all 24
    joints, cm.
    """
    return {
        "mpjpe_cm": _cm(joints - joints[:, :1] - true + true[:, :1]),
        "t_root_cm": _cm(joints[:, 0] - true[:, 0]),
        "hand_jpe_cm": _cm(joints[:, 22:] - true[:, 22:]),
        "left_hand_jpe_cm": _cm(joints[:, 22] - true[:, 22]),
        "right_hand_jpe_cm": _cm(joints[:, 23] - true[:, 23]),
    }


def vertex_error(
    vertices: Float[np.ndarray, "frames verts 3"],
    joints: Joints,
    true_vertices: Float[np.ndarray, "frames verts 3"],
    true: Joints,
) -> float:
    """MPVPE: the surface's vertices from each one's own pelvis joint, cm."""
    return _cm(vertices - true_vertices - (joints[:, :1] - true[:, :1]))


def root_orientation_errors(
    R: Float[np.ndarray, "frames 3 3"], true: Float[np.ndarray, "frames 3 3"]
) -> dict[str, float]:
    """O_root: mean Frobenius norm of I - R R_true^-1 of the pelvis' global rotation (no unit), and
    the mean angle between the two, degrees.
    """
    norm = np.linalg.norm(np.eye(3) - R @ true.swapaxes(-1, -2), axis=(-2, -1))
    angle = 2 * np.arcsin(np.clip(norm / np.sqrt(8), 0, 1))
    return {"o_root": float(norm.mean()), "o_root_deg": float(np.degrees(angle).mean())}


def contact_scores(found: Touch, true: Touch) -> dict[str, float]:
    """Precision, recall and F1 over frames of "some hand touches", and of each hand.

    Without a true or found contact a ratio is 0, as published. The counts of frames come with them,
    so that such clips can be left out (`omomo_core.learning.evaluation.metrics`).
    """
    pairs = {
        "": (found.any(axis=1), true.any(axis=1)),
        "left_": (found[:, 0], true[:, 0]),
        "right_": (found[:, 1], true[:, 1]),
    }
    scores: dict[str, float] = {}
    for side, (f, t) in pairs.items():
        hits = float((f & t).sum())
        frames = {"hit": hits, "found": float(f.sum()), "true": float(t.sum())}
        scores |= {f"{side}contact_{name}_frames": count for name, count in frames.items()}
        scores[f"{side}contact_precision"] = hits / max(1, int(f.sum()))
        scores[f"{side}contact_recall"] = hits / max(1, int(t.sum()))
        scores[f"{side}contact_f1"] = 2 * hits / max(1, int(f.sum() + t.sum()))
    return scores


def onset_errors(found: Touch, true: Touch) -> dict[str, float]:
    """Seconds between the first contact found and the first true one, for each hand that has both."""
    return {
        f"{side}_onset_error_s": abs(int(f.argmax()) - int(t.argmax())) / FPS
        for side, f, t in zip(("left", "right"), found.T, true.T, strict=True)
        if f.any() and t.any()
    }


def walking_measures(joints: Joints) -> dict[str, float]:
    """Share of the frames in which the pelvis goes backwards, and the head's height in the first, cm."""
    across = joints[1:, 1, :2] - joints[1:, 2, :2]
    ahead = np.stack([across[:, 1], -across[:, 0]], axis=-1)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True).clip(1e-6)
    speed = FPS * np.einsum("fx,fx->f", np.diff(joints[:, 0, :2], axis=0), ahead)
    return {
        "backwards_share": float((speed < -BACKWARDS).mean()) if len(speed) else 0.0,
        "first_head_cm": 100 * float(joints[0, joint("head"), 2]),
    }


def swing_measures(joints: Joints) -> dict[str, float]:
    """How high toes rise in the swings of steps, cm, on average, and the share of swings that skim.

    Heights are those of the toe joint above its own lowest level. Without a swing there is neither.
    """
    tops: list[float] = []
    for foot in TOES:
        toe = joints[:, foot]
        height = toe[:, 2] - np.percentile(toe[:, 2], 5)
        way = np.linalg.norm(np.diff(toe[:, :2], axis=0), axis=-1)
        for first, last in runs(way > SWING_SPEED / FPS):
            if way[first:last].sum() > SWING_WAY:
                tops.append(float(height[first : last + 1].max()))
    if not tops:
        return {}
    skimming = float((np.array(tops) < SKIMMING).mean())
    return {"toe_swing_cm": 100 * float(np.mean(tops)), "toe_skimming_share": skimming}


def foot_measures(joints: Joints) -> dict[str, float]:
    """Foot sliding as published (cm per frame), and the speed of low toes (cm/s)."""
    z = joints[..., 2] - floor_height(joints)
    slid: list[float] = []
    for feet, low in ((ANKLES, ANKLE_LOW), (TOES, TOE_LOW)):
        for foot in feet:
            height = z[:-1, foot]
            way = np.linalg.norm(np.diff(joints[:, foot, :2], axis=0), axis=-1)
            weight = np.where(height < low, 2 - 2 ** np.clip(height / low, None, 1), 0.0)
            slid.append(float((way * weight).sum() / len(joints)))
    return {"foot_sliding_cm": 100 * float(np.mean(slid)), "toe_skating_cm_s": _skating(joints)}


def floor_height(joints: Joints) -> float:
    """Height of standing toes, metres: lowest median of their clusters, 0 if they never stand."""
    toes = joints[:, TOES]
    speed = np.linalg.norm(np.diff(toes, axis=0), axis=-1)
    still = np.concatenate([speed, speed[-1:]]) < STILL
    heights = np.sort(toes[..., 2][still])
    return min((float(np.median(c)) for c in clusters(heights)), default=0.0)


def clusters(
    values: Float[np.ndarray, " values"], near: float = 0.005, enough: int = 3
) -> list[Float[np.ndarray, " members"]]:
    """DBSCAN (Ester et al. 1996) of sorted numbers; what belongs to no cluster forms one more."""
    count = np.searchsorted(values, values + near, "right") - np.searchsorted(values, values - near)
    core = values[count >= enough]
    breaks = np.flatnonzero(np.diff(core) > near) + 1
    label = np.full(len(values), -1)
    for k, part in enumerate(np.split(core, breaks) if len(core) else []):
        label[(values >= part[0] - near) & (values <= part[-1] + near) & (label < 0)] = k
    return [values[label == k] for k in np.unique(label)]


def _skating(joints: Joints) -> float:
    """Horizontal speed of toes within 3 cm of their lowest level, cm/s."""
    toes = joints[:, TOES]
    low = toes[1:, :, 2] < np.percentile(toes[..., 2], 5) + 0.03
    speed = 100 * FPS * np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1)
    return float(speed[low].mean()) if low.any() else 0.0


def _cm(difference: Float[np.ndarray, "*rest 3"]) -> float:
    return 100 * float(np.sqrt(np.einsum("...i,...i", difference, difference)).mean())


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
    """Upper end of the interval that holds the middle 95 % of the draws."""


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
