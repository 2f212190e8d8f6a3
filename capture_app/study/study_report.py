"""What a study found: preference rates of every two methods, as JSON, a table and a figure.

The figure of a study: a bar for each two methods, divided as the votes were. SVG.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import combinations
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int
from scipy.special import stdtrit

from capture_app.staging import staged_folder
from capture_app.study.votes import Key, Rater
from omomo_core.errors import InputError


@dataclass(frozen=True)
class Rate:
    """A share and the interval it lies in with 95 % confidence, 0 to 1."""

    share: float
    low: float
    high: float
    votes: int


def preference(chosen: Sequence[bool], raters: Sequence[int], questions: Sequence[int]) -> Rate:
    """The share of votes for one of two methods.

    Args:
        chosen: for each vote, whether it is for that method.
        raters, questions: for each vote, an index of who voted on what.

    Returns:
        The rate; without a vote, 0.5 between 0 and 1.
    """
    votes = np.array(chosen, bool)
    n = len(votes)
    if n == 0:
        return Rate(0.5, 0.0, 1.0, 0)
    who, what = (
        np.unique(raters, return_inverse=True)[1],
        np.unique(questions, return_inverse=True)[1],
    )
    clusters = min(int(who.max()), int(what.max())) + 1
    share = float(votes.mean())
    alone = share * (1 - share) / n
    together = _variance(votes, who) + _variance(votes, what) - alone
    effective = n * min(1.0, alone / together) if alone > 0 and together > 0 else float(n)
    q = float(stdtrit(max(1, clusters - 1), 0.975))
    return Rate(share, *_wilson(share, max(effective, 1.0), q), n)


def _variance(votes: Bool[np.ndarray, " votes"], cluster: Int[np.ndarray, " votes"]) -> float:
    """Return the variance of the mean when votes of one cluster go together."""
    sums = np.bincount(cluster, votes - votes.mean())
    g = len(sums)
    if g < 2:
        return 0.0
    return float(g / (g - 1) * (sums**2).sum()) / len(votes) ** 2


def _wilson(share: float, n: float, q: float) -> tuple[float, float]:
    middle = share + q * q / (2 * n)
    reach = q * np.sqrt(share * (1 - share) / n + q * q / (4 * n * n))
    scale = 1 + q * q / n
    return max(0.0, float(middle - reach) / scale), min(1.0, float(middle + reach) / scale)


@dataclass(frozen=True)
class Preference:
    """The share of votes that prefer one method to another."""

    first: str
    second: str
    rate: Rate
    """Rate of votes for the first."""

    @property
    def decided(self) -> bool:
        """Whether the interval leaves out that both are equal."""
        return not self.rate.low <= 0.5 <= self.rate.high


@dataclass(frozen=True)
class Analysis:
    """The preferences that a study found, and who was counted."""

    preferences: tuple[Preference, ...]
    kept: tuple[str, ...]
    """Names of the raters whose votes count."""
    left_out: tuple[tuple[str, str], ...]
    """Names of the others, each with why."""
    left_share: float
    """Share of counted votes for the film on the left: about one half if sides do not matter."""


def analyse(key: Key, raters: Sequence[Rater], *, may_miss: int = 0) -> Analysis:
    """Count the votes.

    Args:
        key: of the study.
        raters: each with all votes of a page.
        may_miss: attention checks that a rater may miss and still counts.
    """
    kept = [r for r in raters if r.checks_missed <= may_miss]
    out = [r for r in raters if r.checks_missed > may_miss]
    counted = [v for r in kept for v in r.votes if v.item.intact is None]
    left = sum(v.choice == "left" for v in counted)
    return Analysis(
        preferences=tuple(_between(a, b, kept) for a, b in combinations(key.methods, 2)),
        kept=tuple(r.name for r in kept),
        left_out=tuple(
            (r.name, f"missed {r.checks_missed} of {r.checks} attention checks") for r in out
        ),
        left_share=left / len(counted) if counted else 0.5,
    )


def _between(first: str, second: str, raters: Sequence[Rater]) -> Preference:
    """The vote of each kept rater on each question about two methods."""
    votes = [
        (vote.preferred == first, k, vote.item.take)
        for k, rater in enumerate(raters)
        for vote in rater.votes
        if {vote.item.left, vote.item.right} == {first, second}
    ]
    takes = {take: k for k, take in enumerate(sorted({take for *_, take in votes}))}
    rate = preference(
        [chosen for chosen, *_ in votes],
        [who for _, who, _ in votes],
        [takes[take] for *_, take in votes],
    )
    return Preference(first, second, rate)


_WIDTH, _ROW, _BAR, _TOP, _FOOT = 760.0, 62.0, 30.0, 44.0, 40.0
_LEFT, _RIGHT = 30.0, 730.0
_FIRST, _SECOND = "#3f6fae", "#d9a35c"
_INK, _FAINT = "#33363a", "#85888c"


def figure(preferences: Sequence[Preference]) -> str:
    """Return a figure in SVG.

    Each bar is the share of votes for two methods; the bracket below it is the 95 % interval of the
    border, the line in the middle is where nobody prefers either.
    """
    foot = _TOP + _ROW * len(preferences)
    height = foot + _FOOT
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {height:g}" '
        f'width="{_WIDTH:g}" height="{height:g}" font-family="Helvetica, Arial, sans-serif">',
        _box(0.0, 0.0, _WIDTH, height, "#ffffff"),
        _words(_LEFT, 24.0, "Share of votes, with 95 % intervals", 15.0),
    ]
    for k, preference in enumerate(preferences):
        parts += _bar(preference, _TOP + _ROW * k)
    parts.append(_box(_at(0.5) - 0.75, _TOP - 6, 1.5, foot - _TOP + 6, "#55585c"))
    parts += [
        _words(_at(share), foot + 16, f"{share:.0%}", 12.0, _FAINT, "middle")
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    ]
    return "\n".join([*parts, "</svg>", ""])


def _bar(preference: Preference, top: float) -> list[str]:
    rate, border = preference.rate, _at(preference.rate.share)
    low, high, under = _at(rate.low), _at(rate.high), top + 19 + _BAR + 5
    return [
        _words(_LEFT, top + 9, f"{preference.first}: {rate.share:.0%}", 13.0),
        _words(_RIGHT, top + 9, f"{preference.second}: {1 - rate.share:.0%}", 13.0, _INK, "end"),
        _box(_LEFT, top + 19, border - _LEFT, _BAR, _FIRST),
        _box(border, top + 19, _RIGHT - border, _BAR, _SECOND),
        _box(low, under - 1, high - low, 2.0, _INK),
        *(_box(x - 1, under - 4, 2.0, 8.0, _INK) for x in (low, high)),
    ]


def _at(share: float) -> float:
    return _LEFT + share * (_RIGHT - _LEFT)


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}"/>'
    )


def _words(
    x: float, y: float, text: str, size: float, fill: str = _INK, anchor: str = "start"
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" fill="{fill}" '
        f'text-anchor="{anchor}" dominant-baseline="central">{escape(text)}</text>'
    )


def write_report(output: Path, key: Key, analysis: Analysis) -> None:
    """Write analysis.json, table.md and figure.svg into a new folder.

    Raises:
        InputError: the folder exists, or cannot be written.
    """
    with staged_folder(output) as folder:
        try:
            text = json.dumps(document(key, analysis), indent=1, ensure_ascii=False) + "\n"
            (folder / "analysis.json").write_text(text, encoding="utf-8")
            (folder / "table.md").write_text(table(analysis), encoding="utf-8")
            (folder / "figure.svg").write_text(figure(analysis.preferences), encoding="utf-8")
        except OSError as error:
            raise InputError(
                "output-not-writable",
                f"The analysis cannot be written: {error.strerror or error}.",
                where=str(output),
                fix="Give a folder with room in it with ‹output›.",
            ) from error


def document(key: Key, analysis: Analysis) -> dict[str, object]:
    """Everything, as JSON has it; shares from 0 to 1, intervals of 95 %."""
    return {
        "study": key.study,
        "methods": key.methods,
        "preferences": [
            {
                "first": p.first,
                "second": p.second,
                "share_first": p.rate.share,
                "low": p.rate.low,
                "high": p.rate.high,
                "votes": p.rate.votes,
                "decided": p.decided,
            }
            for p in analysis.preferences
        ],
        "raters_counted": analysis.kept,
        "raters_left_out": [{"votes": name, "why": why} for name, why in analysis.left_out],
        "share_left": analysis.left_share,
        "pages_without_votes": len(key.pages) - len(analysis.kept) - len(analysis.left_out),
    }


def table(analysis: Analysis) -> str:
    """A Markdown table, and below it who was counted."""
    rows = [
        "| preferred | to | votes for it | 95 % interval | votes | |",
        "|---|---|---:|---|---:|---|",
        *(_row(p) for p in analysis.preferences),
    ]
    out = [f"- {_cell(name)}: {why}" for name, why in analysis.left_out]
    counted = f"{len(analysis.kept)} raters counted, {len(out)} left out" + (":" if out else ".")
    side = f"{analysis.left_share:.0%} of the votes are for the film on the left."
    return "\n".join([*rows, "", counted, *out, "", side, ""])


def _row(p: Preference) -> str:
    verdict = "" if p.decided else "undecided"
    interval = f"{p.rate.low:.1%} to {p.rate.high:.1%}"
    return (
        f"| {_cell(p.first)} | {_cell(p.second)} | {p.rate.share:.1%} | {interval} "
        f"| {p.rate.votes} | {verdict} |"
    )


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
