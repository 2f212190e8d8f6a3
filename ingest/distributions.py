"""Quantiles and tail probabilities of the distributions that thresholds of ingest come from.

They are those of `scipy.stats`, from `scipy.special` alone: importing the former takes half a second
at the start of every command.
"""

from scipy import special


def chi2_quantile(p: float, freedom: int) -> float:
    """Value under which a chi-squared variable of that freedom lies with probability p."""
    return float(2 * special.gammaincinv(freedom / 2, p))


def chi2_tail(value: float, freedom: int) -> float:
    """Probability that a chi-squared variable of that freedom is greater than a value."""
    return float(special.chdtrc(freedom, value))


def f_quantile(p: float, freedom: int, freedom_below: int) -> float:
    """Value under which an F variable lies with probability p; freedoms of numerator and denominator."""
    return float(special.fdtri(freedom, freedom_below, p))


def normal_from_tail(p: float) -> float:
    """Value that a standard normal variable exceeds with probability p."""
    return float(-special.ndtri(p))
