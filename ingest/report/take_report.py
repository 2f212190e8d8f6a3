"""The results of the checks of a take."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Severity = Literal["ok", "warn", "bad"]
_WORST_FIRST: tuple[Severity, ...] = ("bad", "warn", "ok")


@dataclass(frozen=True)
class Check:
    """One verdict on a take."""

    name: str
    severity: Severity
    """ok; warn: a motion can be made, but look here; bad: a motion made of it would be wrong."""
    message: str
    frames: tuple[int, int] | None = None
    """(start, stop) of the logged poses it concerns, None for the whole take."""
    fix: str = ""
    """The one thing to do about it, "" when there is nothing to do."""


@dataclass(frozen=True)
class TakeReport:
    """All the verdicts, in the order a person wants to read them."""

    checks: tuple[Check, ...]
    complete: bool = True
    """False where time or units make no sense, so that nothing else was looked at."""

    @property
    def severity(self) -> Severity:
        """The worst of the checks."""
        return worst([check.severity for check in self.checks])

    def of(self, severity: Severity) -> list[Check]:
        """The checks of one severity."""
        return [check for check in self.checks if check.severity == severity]


def folded(checks: Sequence[Check]) -> list[list[Check]]:
    """Group neighbouring checks with the same severity and fix that share their name or their message."""
    groups: list[list[Check]] = []
    for check in checks:
        last = groups[-1][-1] if groups else None
        if last is not None and _one_line(last, check):
            groups[-1].append(check)
        else:
            groups.append([check])
    return groups


def _one_line(one: Check, other: Check) -> bool:
    same = (one.severity, one.fix) == (other.severity, other.fix)
    return same and (one.name == other.name or one.message == other.message)


def worst(severities: Sequence[Severity]) -> Severity:
    """The worst of some severities, ok when there is none."""
    for severity in _WORST_FIRST:
        if severity in severities:
            return severity
    return "ok"


def grade(value: float, warn: float, bad: float) -> Severity:
    """Severity of a value that should be small."""
    return "bad" if value > bad else "warn" if value > warn else "ok"


def graded(
    name: str,
    severity: Severity,
    message: str,
    fix: str,
    frames: tuple[int, int] | None = None,
) -> Check:
    """A check whose place and fix are told only when it is not ok."""
    if severity == "ok":
        return Check(name, "ok", message)
    return Check(name, severity, message, frames, fix)
