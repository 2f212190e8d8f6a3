"""Whether the orderings that the paper claims hold here, and how sure that is."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

from capture_app.tables.answers import WindowResult
from capture_app.tables.build import Group, PaperTable, grouped
from capture_app.tables.methods import METHODS
from omomo_core.learning.evaluation.metrics import PairedDifference, paired_bootstrap
from omomo_core.learning.evaluation.sources import clip_of

F1, MPJPE = "contact_f1", "mpjpe_cm"
ORDER = ("omomo", "no-constraints", "single-stage", "goal")
"""From the best contact F1 to the worst, says the paper (section 5.2)."""
Of = Literal["best", "mean"]
"""Of the sample with the least MPJPE, as published; or of all samples, which chance touches less."""


def with_verdicts(table: PaperTable, answers: Sequence[WindowResult]) -> PaperTable:
    """The table with a sentence for each claim of the paper that can be looked at."""
    verdicts: list[str] = []
    frames = sorted({section.first_frame for section in table.sections}, reverse=True)
    for unseen in {2: [False], 3: [True], 4: [False, True]}[table.number]:
        groups = {frame: grouped(answers, unseen=unseen, first_frame=frame) for frame in frames}
        # The paper's own protocol, or what comes nearest to it.
        group = groups[frames[0]]
        if table.number == 4:
            verdicts += _ablation(group, unseen)
            continue
        verdicts += _ordering(group, "best", "")
        for frame in frames:
            given = "given" if frame else "not given"
            where = f", in the mean of all samples, first frame {given}"
            verdicts += _ordering(groups[frame], "mean", where)
    return replace(table, verdicts=verdicts)


def _ordering(group: Group, of: Of, where: str) -> list[str]:
    there = [name for name in ORDER if name in group]
    pairs = list(pairwise(there))
    found = [_compared(group, a, b, F1, of) for a, b in pairs]
    if not found:
        return []
    claim = " > ".join(METHODS[name].title for name in there)
    wrong = sum(difference.mean <= 0 for difference in found)
    unsure = sum(difference.low <= 0 < difference.mean for difference in found)
    if wrong:
        outcome = f"does not hold: {wrong} of {len(found)} steps do not go this way"
    elif unsure:
        outcome = f"is what the means say, but {unsure} of {len(found)} steps may be chance"
    else:
        outcome = "holds in every step"
    if len(there) > 2:
        # Steps may each be small where the whole way is not.
        pairs.append((there[0], there[-1]))
        found.append(_compared(group, *pairs[-1], F1, of))
    details = [
        _told(a, b, "F1", difference, 2) for (a, b), difference in zip(pairs, found, strict=True)
    ]
    return [f"The paper's ordering by contact F1, {claim}{where}, {outcome}.", *details]


def _ablation(group: Group, unseen: bool) -> list[str]:
    if not {"omomo", "gt-hands"} <= group.keys():
        return []
    where = " on unseen objects" if unseen else ""
    better = _compared(group, "gt-hands", "omomo", F1, "best")
    nearer = _compared(group, "omomo", "gt-hands", MPJPE, "best")
    holds = "holds" if min(better.low, nearer.low) > 0 else "is not certain"
    if better.mean <= 0 or nearer.mean <= 0:
        holds = "does not hold"
    return [
        f"The paper's claim that true palms give better people{where} {holds}.",
        _told("gt-hands", "omomo", "F1", better, 2),
        _told("omomo", "gt-hands", "MPJPE", nearer, 1),
    ]


def _compared(group: Group, first: str, second: str, key: str, of: Of) -> PairedDifference:
    """By how much a figure of the best of K, or of all samples, is greater in one method than in another."""
    windows = list(group[first])

    def values(method: str) -> list[float]:
        return [getattr(group[method][window], of)[key] for window in windows]

    return paired_bootstrap(values(first), values(second), [clip_of(window) for window in windows])


def _told(first: str, second: str, figure: str, found: PairedDifference, digits: int) -> str:
    sign = "surely" if found.low > 0 or found.high < 0 else "perhaps by chance"
    return (
        f"{figure} of {METHODS[first].title} minus that of {METHODS[second].title}: "
        f"{found.mean:+.{digits}f} (95 % of the draws of whole clips from {found.low:+.{digits}f} "
        f"to {found.high:+.{digits}f}; {sign})."
    )
