"""Several mounts of the same clamping become one, and differences between mounts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.calibration.posterior import belief, joined, open_directions, posterior
from ingest.distributions import chi2_tail, normal_from_tail
from ingest.mount import Mount
from ingest.uncertainty import between, bounds_95
from omomo_core.errors import InputError

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
    """Covariance of honest differences."""

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
        p=chi2_tail(distance, 6),
        covariance=covariance,
    )


_SAME_SCALE = 1e-3
_ALIKE = {"object_id": "object", "phone": "phone"}
"""Fields that all results must agree on where they name them, and the words for them."""


class NamedMount(NamedTuple):
    """A mount, and the name that error messages call it by."""

    name: str
    mount: Mount


class _Pair(NamedTuple):
    first: int
    second: int
    apart: Difference


def combine(results: Sequence[NamedMount]) -> Mount:
    """The mean of several results of one mount on SE(3), weighted by what each knows.

    Their errors are taken to have nothing to do with each other: two results of one recording, or
    of one wrong measurement, are surer together than they should be. What one leaves open the others
    fill in; a turn that is open by more than some tens of degrees cannot be weighed so.

    Args:
        results: two or more, each with a covariance, of one clamping of one phone to one object.

    Raises:
        InputError: "mounts-few", "mount-without-covariance", "mounts-object", "mounts-phone",
            "mounts-scale", "mounts-disagree".
    """
    if len(results) < 2:
        raise InputError(
            "mounts-few",
            f"There is {len(results)} mount to combine.",
            fix="Name two or more mount files of one clamping.",
        )
    covariances = [_covariance(result) for result in results]
    _check_alike(results)
    pairs = [
        _Pair(
            i, j, difference(results[i].mount, results[j].mount, (covariances[i], covariances[j]))
        )
        for i, j in combinations(range(len(results)), 2)
    ]
    _check_agree(results, pairs)
    return _combined(results, covariances, min(pair.apart.p for pair in pairs))


def _covariance(result: NamedMount) -> Float64[np.ndarray, "6 6"]:
    if result.mount.covariance is None:
        raise InputError(
            "mount-without-covariance",
            "The mount does not say how sure it is, so it cannot be weighed against others.",
            where=result.name,
            fix="Leave it out, or let a calibration refine it first (omocap calibrate floor).",
        )
    return result.mount.covariance


def _check_alike(results: Sequence[NamedMount]) -> None:
    """Refuse results of several things, by name."""
    for field, word in _ALIKE.items():
        named = [(r, getattr(r.mount, field)) for r in results if getattr(r.mount, field)]
        for result, value in named[1:]:
            if value != named[0][1]:
                raise _two(word, named[0][0].name, named[0][1], result.name, value)
    first = results[0]
    for result in results[1:]:
        if abs(result.mount.object_scale / first.mount.object_scale - 1) > _SAME_SCALE:
            sizes = (f"{r.mount.object_scale:.6g}" for r in (first, result))
            raise _two("scale", first.name, next(sizes), result.name, next(sizes))


def _two(word: str, first: str, has: str, second: str, other: str) -> InputError:
    return InputError(
        f"mounts-{word}",
        f"The mounts are not of one {word}: {has} and {other}.",
        where=f"{first}, {second}",
        fix=f"Combine only results of one clamping, with the same {word}.",
    )


def _check_agree(results: Sequence[NamedMount], pairs: list[_Pair]) -> None:
    """Refuse results of which at least one is wrong, and say which if that can be told."""
    # Of many pairs one is far apart by chance more often.
    off = [pair for pair in pairs if pair.apart.p * len(pairs) < DISAGREE]
    if not off:
        return
    differences = "; ".join(
        f"{results[i].name} and {results[j].name} are {apart}" for i, j, apart in off
    )
    culprits = set.intersection(*({pair.first, pair.second} for pair in off))
    if len(results) > 2 and len(culprits) == 1:
        odd = results[culprits.pop()].name
        raise InputError(
            "mounts-disagree",
            f"{odd} disagrees with the others, which agree among themselves: {differences}.",
            where=odd,
            fix="Leave it out, or calibrate that way again; if it is of another day, the clamp may "
            "have moved in between.",
        )
    raise InputError(
        "mounts-disagree",
        f"The mounts disagree beyond what they claim to know: {differences}.",
        where=", ".join(result.name for result in results),
        fix="At least one is wrong, or the clamp moved between them: calibrate once more in a third "
        "way, and combine all to see which is the odd one.",
    )


def _combined(
    results: Sequence[NamedMount], covariances: list[Float64[np.ndarray, "6 6"]], p: float
) -> Mount:
    poses = [result.mount.T_phone_object for result in results]
    beliefs = [belief(T, C + FINEST) for T, C in zip(poses, covariances, strict=True)]
    surest = int(np.argmin([np.trace(covariance[:3, :3]) for covariance in covariances]))
    found = posterior(lambda T: joined(*(misfit(T) for misfit in beliefs)), poses[surest])
    mounts = [result.mount for result in results]
    differences = dict.fromkeys(mount.method for mount in mounts)
    return replace(
        mounts[0],
        T_phone_object=found.T,
        covariance=found.covariance,
        method=" and ".join(differences) + ", combined",
        residuals={"apart_sigma": normal_from_tail(p / 2)},
        free=tuple(direction.words for direction in open_directions(found.covariance)),
        note="Combined from " + ", ".join(result.name for result in results) + ".",
        date=max(mount.date for mount in mounts),
        picture="",
        **{name: next(filter(None, (getattr(m, name) for m in mounts)), "") for name in _ALIKE},
    )
