"""Method scan: still pictures of the clamped phone, found again in the object's scan."""

from collections.abc import Callable, Sequence

import numpy as np

from ingest.calibration.average import average
from ingest.calibration.scan.landmarks import Landmarks
from ingest.calibration.scan.localise import Localised, localise
from ingest.calibration.scan.views import Views
from ingest.calibration.still import disagreeing
from ingest.mount import Mount
from ingest.uncertainty import between
from omomo_core.errors import InputError

SCALE_SD = 0.005
"""Standard deviation of a model's scale, as a part of it."""
_MODEL = np.diag([np.radians(0.03) ** 2] * 3 + [0.001**2] * 3)
"""Covariance (rad, m) of what a model is off by as a whole where the phone looks: all views share it."""


def scan_mount(
    landmarks: Landmarks,
    places: Sequence[Views],
    *,
    scale_sd: float = SCALE_SD,
    progress: Callable[[str, float], None] = lambda name, done: None,
) -> Mount:
    """Where the object is to the phone, by what the clamped phone sees of the object's scan.

    Views of one place that cannot be localised are left out, if there are others.

    Args:
        landmarks: the scan, in the object's frame.
        places: pictures of the clamped phone, the object always where it was scanned.
        scale_sd: standard deviation of the scan's scale, as a part of it.
        progress: called with how many views are done.

    Raises:
        InputError: those of `localise` when no view of a place is localised; "scan-slipped" when
            two places disagree about where the phone is on the object.
    """
    found: list[Localised] = []
    count = sum(len(place.views) for place in places)
    means: list[Localised] = []
    for place in places:
        here, problem = list[Localised](), None
        for view in place.views:
            try:
                here.append(localise(view, landmarks))
            except InputError as error:
                problem = problem or error
            progress("localise", (len(found) + len(here)) / count)
        if not here and problem is not None:
            raise problem
        found += here
        means.append(_mean(here))
    _check_agreement(places, means)
    mean = _mean(means)
    t = mean.T_phone_object[:3, 3]
    covariance = mean.covariance + _MODEL
    covariance[3:, 3:] += scale_sd**2 * np.outer(t, t)
    steps = between(mean.T_phone_object[None], np.array([x.T_phone_object for x in found]))
    missed = count - len(found)
    return Mount(
        mean.T_phone_object,
        "scan",
        covariance=covariance,
        residuals={
            "reprojection_px": mean.rms,
            "views_mm": 1e3 * float(np.sqrt((steps[:, 3:] ** 2).sum(axis=1).mean())),
            "views_deg": float(np.degrees(np.sqrt((steps[:, :3] ** 2).sum(axis=1).mean()))),
            "inliers": float(mean.inliers),
        },
        note=f"{missed} of {count} pictures could not be localised." if missed else "",
    )


def _mean(found: Sequence[Localised]) -> Localised:
    """Mean of several mounts; its covariance is that of one, because they share the errors of the scan."""
    T = np.array([one.T_phone_object for one in found])
    covariances = np.array([one.covariance for one in found])
    together = average(T, covariances)
    return Localised(
        together.T,
        together.covariance * int(together.kept.sum()),
        round(float(np.mean([one.inliers for one in found]))),
        float(np.mean([one.rms for one in found])),
    )


def _check_agreement(places: Sequence[Views], means: Sequence[Localised]) -> None:
    T = np.array([mean.T_phone_object for mean in means])
    pair = disagreeing(T, np.array([mean.covariance for mean in means]))
    if pair is None:
        return
    step = between(T[pair[0]], T[pair[1]])
    raise InputError(
        "scan-slipped",
        f"Between {places[pair[0]].name} and {places[pair[1]].name} the object moved by "
        f"{1e3 * np.linalg.norm(step[3:]):.0f} mm and {np.degrees(np.linalg.norm(step[:3])):.1f} "
        "deg in the phone's frame: the phone slipped on it, or it was not where it was scanned.",
        where=f"{places[pair[0]].views[0].name}; {places[pair[1]].views[0].name}",
        fix="Tighten the clamp and record again; or, if the object was only put down elsewhere, name "
        "the seconds in which it stood where it was scanned (--still).",
    )
