"""Check and TakeReport: the verdicts on a take."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["ok", "warn", "bad"]


@dataclass(frozen=True)
class Check:
    """One verdict on a take."""

    name: str
    severity: Severity
    message: str
    frames: tuple[int, int] | None = None
    """(start, stop) of the logged poses it concerns, None for the whole take."""
    fix: str = ""


@dataclass(frozen=True)
class TakeReport:
    """All the verdicts, in the order a person wants to read them."""

    checks: tuple[Check, ...]

    @property
    def severity(self) -> Severity:
        """The worst of the checks."""
        found = {check.severity for check in self.checks}
        return "bad" if "bad" in found else "warn" if "warn" in found else "ok"


def grade(value: float, warn: float, bad: float) -> Severity:
    """Severity of a value that should be small."""
    return "bad" if value > bad else "warn" if value > warn else "ok"
