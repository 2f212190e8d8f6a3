"""Motions of different files on one clock in one world, with the numbers under their pictures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from capture_app.comparison.compared_motions import Motion, moved, stretch
from omomo_core.errors import InputError
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.geometry.transforms import to_local
from omomo_core.learning.evaluation.metrics import contact_scores, foot_measures, joint_errors
from omomo_core.learning.evaluation.truth import Touching
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from render.comparison import Contender, Number
from render.lettering import Held
from render.third_person import object_corners

_SAME_SIZE = 0.05
"""Share by which the sides of one object's boxes may differ between two meshes of it."""
_SAME_PATH = 0.05
"""Metres (RMS over the box's corners) within which two paths of the object are the same."""
_UNMOVED = 0.01
"""Metres within which two worlds are the same already."""
_COMMON = 0.8
"""Least share of the shorter motion that both have in common."""


@dataclass(frozen=True)
class Placement:
    """The place and time at which another motion belongs."""

    begin: int
    """Frame of the first motion at which it begins; may be negative."""
    T: Float[np.ndarray, "4 4"]
    """Takes its world to the first one's: a turn about the vertical and a shift along the floor."""
    apart: float
    """RMS distance of the object's corners after that, metres."""
    same_take: bool
    """The object takes the same way in both."""


def same_object(a: ObjectMesh, b: ObjectMesh) -> bool:
    """Whether two meshes are as large along their sides, sorted by length."""
    sides = [np.sort(np.ptp(mesh.vertices, axis=0)) for mesh in (a, b)]
    return bool(np.allclose(*sides, rtol=_SAME_SIZE, atol=0.005))


def place(first: ObjectMotion, other: ObjectMotion) -> Placement:
    """Return the placement at which `other` fits `first` best.

    The clock is shifted to where the heights of the object's corners and its speed along the floor
    agree best: neither depends on where the axes of a world point. Then the world is turned about
    the vertical and shifted. Objects that go different ways begin together at one place instead.
    """
    a, b = object_corners(first), object_corners(other)
    expected = round((other.start_time - first.start_time) * FPS)
    begin = _lag(_features(a), _features(b), expected)
    ours, theirs = _common(a, b, begin)
    apart = _rms(ours - theirs)
    if apart < _UNMOVED:
        return Placement(begin, np.eye(4), apart, same_take=True)
    fitted = _planar(ours, theirs)
    apart = _rms(theirs @ fitted[:3, :3].T + fitted[:3, 3] - ours)
    if apart < _SAME_PATH:
        return Placement(begin, fitted, apart, same_take=True)
    together = np.eye(4)
    together[:2, 3] = (a[0] - b[0])[:, :2].mean(axis=0)
    return Placement(0, together, apart, same_take=False)


def _features(corners: Float[np.ndarray, "frames 8 3"]) -> Float[np.ndarray, "frames 9"]:
    """Heights, and metres along the floor in a tenth of a second."""
    middle = corners.mean(axis=1)[:, :2]
    step = np.gradient(middle, axis=0) if len(middle) > 1 else np.zeros_like(middle)
    speed = np.linalg.norm(step, axis=1, keepdims=True) * FPS / 10
    return np.concatenate([corners[..., 2], speed], axis=1)


def _lag(
    ours: Float[np.ndarray, "frames_a 9"], theirs: Float[np.ndarray, "frames_b 9"], expected: int
) -> int:
    """Frames that the other motion begins later, as expected where others are no better."""
    n, m = len(ours), len(theirs)
    least = max(1, int(np.ceil(_COMMON * min(n, m))))
    lags = np.arange(least - m, n - least + 1)
    cost = [np.abs(np.subtract(*_common(ours, theirs, int(lag)))).mean() for lag in lags]
    return int(lags[np.argmin(np.array(cost) + 1e-6 * np.abs(lags - expected))])


def _common(a: np.ndarray, b: np.ndarray, begin: int) -> tuple[np.ndarray, np.ndarray]:
    """The frames of both while both last; b begins at a's frame `begin`."""
    start, stop = max(0, begin), min(len(a), begin + len(b))
    return a[start:stop], b[start - begin : stop - begin]


def _planar(
    ours: Float[np.ndarray, "frames 8 3"], theirs: Float[np.ndarray, "frames 8 3"]
) -> Float[np.ndarray, "4 4"]:
    """The turn about the vertical and the shift along the floor of least squares."""
    p, q = theirs.reshape(-1, 3)[:, :2], ours.reshape(-1, 3)[:, :2]
    pc, qc = p - p.mean(axis=0), q - q.mean(axis=0)
    yaw = np.arctan2((pc[:, 0] * qc[:, 1] - pc[:, 1] * qc[:, 0]).sum(), (pc * qc).sum())
    c, s = np.cos(yaw), np.sin(yaw)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:2, 3] = q.mean(axis=0) - T[:2, :2] @ p.mean(axis=0)
    return T


def _rms(difference: Float[np.ndarray, "frames 8 3"]) -> float:
    return float(np.sqrt((difference**2).sum(axis=-1).mean()))


@dataclass(frozen=True)
class Measure:
    """How a figure is called and written."""

    name: str
    unit: str
    digits: int
    more_is_better: bool = False


MEASURES = {
    "held_percent": Measure("moving object held", "%", 0, more_is_better=True),
    "slip_cm_s": Measure("hands slip", "cm/s", 1),
    "penetration_cm": Measure("body without hands in object", "cm", 2),
    "hand_penetration_cm": Measure("hands in object", "cm", 2),
    "foot_sliding_cm": Measure("foot sliding", "cm", 2),
    "jerk_m_s3": Measure("jerk", "m/s3", 0),
    "mpjpe_cm": Measure("MPJPE", "cm", 1),
    "hand_jpe_cm": Measure("HandJPE", "cm", 1),
    "t_root_cm": Measure("T_root", "cm", 1),
    "contact_f1": Measure("contact F1", "", 2, more_is_better=True),
}
"""In the order in which they are shown; the last four need the truth."""

Figures = dict[str, float]


def own_figures(motion: Motion) -> Figures:
    """Return what can be measured of a motion alone, alike for results and recorded people.

    Held: share of the frames in which somebody must hold the object, with a palm within 5 cm of it;
    left out where nobody must. Slip: mean speed of holding palms over the object. Penetration and
    foot sliding: as `omocap evaluate` has them. Jerk: mean of all joints.
    """
    touching, thing = Touching(motion.object_motion), ObjectModel(motion.object_motion.mesh, 1.0)
    T, joints = motion.object_motion.T_world_object, motion.human.joints
    must = thing.clip(T).must_hold
    touched = touching.palms(joints[:, 22:].astype(np.float64))[must]
    deep = touching.penetration(motion.human, motion.body)
    held = {"held_percent": 100 * float(touched.any(axis=1).mean())} if len(touched) else {}
    return {
        **held,
        **_slip(motion),
        "penetration_cm": deep["penetration_cm"],
        "hand_penetration_cm": deep["hand_penetration_cm"],
        "foot_sliding_cm": foot_measures(joints)["foot_sliding_cm"],
        "jerk_m_s3": _jerk(joints),
    }


def figures_against(motion: Motion, truth: Motion) -> Figures:
    """Distances from the truth, over frames that both have (as many, and of one world)."""
    touching = Touching(truth.object_motion)
    found, true = (
        touching.palms(m.human.joints[:, 22:].astype(np.float64)) for m in (motion, truth)
    )
    return {
        **joint_errors(motion.human.joints, truth.human.joints),
        "contact_f1": contact_scores(found, true)["contact_f1"],
    }


def shown(figures: Sequence[Mapping[str, float]]) -> list[tuple[Number, ...]]:
    """The figures of several motions as they are written; the best of each is marked.

    None is marked where all are written alike.
    """
    written = [
        {k: f"{row[k]:.{m.digits}f} {m.unit}".strip() for k, m in MEASURES.items() if k in row}
        for row in figures
    ]
    best: dict[str, str] = {}
    for key, measure in MEASURES.items():
        values = {
            row[key]: text[key] for row, text in zip(figures, written, strict=True) if key in row
        }
        if len(set(values.values())) > 1:
            best[key] = values[(max if measure.more_is_better else min)(values)]
    return [
        tuple(Number(MEASURES[k].name, text, text == best.get(k)) for k, text in row.items())
        for row in written
    ]


def _slip(motion: Motion) -> Figures:
    """Nothing where no hand ever holds."""
    palms = to_local(motion.object_motion.T_world_object, motion.human.joints[:, 22:])
    speed = 100 * FPS * np.linalg.norm(np.diff(palms, axis=0), axis=-1)
    both = motion.contact[1:] & motion.contact[:-1]
    return {"slip_cm_s": float(speed[both].mean())} if both.any() else {}


def _jerk(joints: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(joints, n=3, axis=0), axis=-1).mean() * FPS**3)


_SHORTEST = 4
"""Frames in common that a distance from the truth needs."""


@dataclass(frozen=True)
class PlacedMotion:
    """A motion in the first one's world, and where it stands on the common clock."""

    motion: Motion
    placement: Placement


@dataclass(frozen=True)
class Comparison:
    """The motions that are drawn, and what is said about them."""

    contenders: tuple[Contender, ...]
    figures: tuple[Figures, ...]
    """Figures of each contender: see `capture_app.comparison.arrange.MEASURES`."""
    notes: tuple[str, ...]
    """How lengths, clocks and places were made to fit, in sentences."""


def placed_motions(motions: Sequence[Motion], *, any_object: bool = False) -> list[PlacedMotion]:
    """Each motion moved into the world of the first.

    Args:
        motions: two or more.
        any_object: allow other objects than the first one's.

    Raises:
        InputError: fewer than two, or another object.
    """
    if len(motions) < 2:
        raise InputError(
            "one-motion",
            "There is nothing to compare this motion with.",
            where=motions[0].label if motions else "",
            fix="Name a second one, or add ‹samples› or ‹rule› paper.",
        )
    first = motions[0]
    for other in motions[1:]:
        ours, theirs = first.object_motion.mesh, other.object_motion.mesh
        if not any_object and not same_object(ours, theirs):
            raise InputError(
                "objects-differ",
                f"{other.label} moves another object ({theirs.name}) than {first.label} "
                f"({ours.name}).",
                where=other.label,
                fix="Compare motions of one object, or add ‹any_object›.",
            )
    alone = PlacedMotion(first, Placement(0, np.eye(4), 0.0, same_take=True))
    return [alone, *(_placed(first, other) for other in motions[1:])]


def compared(
    motions: Sequence[Motion],
    *,
    any_object: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> Comparison:
    """Motions placed, measured and described; the first truth is what the others are measured by.

    Raises:
        InputError: see `placed_motions`.
    """
    placed = placed_motions(motions, any_object=any_object)
    truth = next((p for p in placed if p.motion.truth), None)
    figures: list[Figures] = []
    for k, one in enumerate(placed):
        figures.append({**own_figures(one.motion), **_against(one, truth)})
        progress((k + 1) / len(placed))
    start = min(p.placement.begin for p in placed)
    contenders = tuple(
        Contender(
            p.motion.label,
            p.motion.human,
            p.motion.object_motion,
            p.motion.body,
            p.motion.contact,
            p.placement.begin - start,
            p.motion.truth,
            _reference(p, truth, start),
            numbers,
        )
        for p, numbers in zip(placed, shown(figures), strict=True)
    )
    notes = tuple(note for p in placed[1:] for note in _notes(placed[0], p))
    return Comparison(contenders, tuple(figures), notes)


def _placed(first: Motion, other: Motion) -> PlacedMotion:
    placement = place(first.object_motion, other.object_motion)
    return PlacedMotion(moved(other, placement.T), placement)


def _comparable(one: PlacedMotion, truth: PlacedMotion) -> bool:
    """Whether a motion is of the truth's take, and another one."""
    return one is not truth and one.placement.same_take and truth.placement.same_take


def _reference(one: PlacedMotion, truth: PlacedMotion | None, start: int) -> Held | None:
    if truth is None or not _comparable(one, truth):
        return None
    return Held(truth.motion.contact, truth.placement.begin - start)


def _against(one: PlacedMotion, truth: PlacedMotion | None) -> Figures:
    """Nothing where there is no truth, or too little of it."""
    if truth is None or not _comparable(one, truth):
        return {}
    start = max(p.placement.begin for p in (one, truth))
    stop = min(p.placement.begin + len(p.motion.human.root) for p in (one, truth))
    if stop - start < _SHORTEST:
        return {}
    ours, theirs = (
        stretch(p.motion, start - p.placement.begin, stop - p.placement.begin) for p in (one, truth)
    )
    return figures_against(ours, theirs)


def _notes(first: PlacedMotion, other: PlacedMotion) -> list[str]:
    a, b, at = first.motion.label, other.motion.label, other.placement
    if not at.same_take:
        return [
            f"{b}: the object goes another way than in {a}. Both begin together, where the object "
            f"stands in {a}; distances between them mean little.",
            *_ends(first, other),
        ]
    notes: list[str] = []
    if not np.array_equal(at.T, np.eye(4)):
        turn = np.rad2deg(np.arctan2(at.T[1, 0], at.T[0, 0]))
        notes.append(
            f"{b}: its world was turned by {turn:.1f} degrees and shifted by "
            f"{np.linalg.norm(at.T[:2, 3]):.2f} m, so that the object goes as in {a} "
            f"(within {100 * at.apart:.1f} cm)."
        )
    return [*notes, *_ends(first, other)]


def _ends(first: PlacedMotion, other: PlacedMotion) -> list[str]:
    """Return notes on motions that do not begin or end together."""
    a, b = first.motion.label, other.motion.label
    begin = other.placement.begin
    notes: list[str] = []
    if begin:
        late = "after" if begin > 0 else "before"
        notes.append(f"{b} begins {abs(begin) / FPS:.2f} s {late} {a}.")
    end = begin + len(other.motion.human.root) - len(first.motion.human.root)
    if end:
        late = "after" if end > 0 else "before"
        notes.append(
            f"{b} ends {abs(end) / FPS:.2f} s {late} {a}; who has ended stands still, faded."
        )
    return notes
