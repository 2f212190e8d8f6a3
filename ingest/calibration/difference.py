"""Difference of two results of one mount, tested against their covariances."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.stats import chi2

from ingest.mount import Mount
from ingest.uncertainty import between, bounds_95

DISAGREE = 0.001
"""Two results that honest errors put so far apart in fewer cases than this disagree."""
FINEST = np.diag([1e-5**2] * 6)
"""rad^2 and m^2 that no result is better than: the covariance of a mount given by numbers may be 0."""


@dataclass(frozen=True)
class Difference:
    """How far two results of one mount are apart, and how probable that is."""

    mm: float
    """Between the two places of the object's origin."""
    deg: float
    p: float
    """Chance that errors of their covariances put them at least so far apart."""
    covariance: Float64[np.ndarray, "6 6"]
    """Of honest differences."""

    @property
    def disagrees(self) -> bool:
        """Whether at least one of the two must be wrong."""
        return self.p < DISAGREE

    def __str__(self) -> str:
        bounds = bounds_95(self.covariance)
        return (
            f"{self.mm:.1f} mm and {self.deg:.2f} deg apart, where 95 % of such pairs are within "
            f"{bounds.mm:.1f} mm and {bounds.deg:.2f} deg"
        )


def difference(
    first: Mount,
    second: Mount,
    covariances: tuple[Float64[np.ndarray, "6 6"], Float64[np.ndarray, "6 6"]],
) -> Difference:
    """Compare two results whose errors have nothing to do with each other.

    Args:
        first: one result.
        second: the other.
        covariances: of the two, which `Mount.covariance` may leave open.
    """
    step = between(first.T_phone_object, second.T_phone_object)
    covariance = covariances[0] + covariances[1] + FINEST
    distance = float(step @ np.linalg.solve(covariance, step))
    return Difference(
        mm=1e3 * float(np.linalg.norm(step[3:])),
        deg=float(np.degrees(np.linalg.norm(step[:3]))),
        p=float(chi2.sf(distance, 6)),
        covariance=covariance,
    )
