"""listed: the verdicts of a report as HTML text."""

from collections.abc import Sequence
from html import escape

from ingest.report.take_checks import Check, Severity

WORDS: dict[Severity, str] = {"ok": "✓ good", "warn": "! look", "bad": "✕ bad"}


def listed(checks: Sequence[Check]) -> str:
    """The worst first and open, those that are well folded up below."""
    troubles = [_item(c) for kind in ("bad", "warn") for c in checks if c.severity == kind]
    well = [_item(check) for check in checks if check.severity == "ok"]
    shown = f'<ul class="checks">{"".join(troubles)}</ul>' if troubles else ""
    return (
        f"{shown}<details><summary>{WORDS['ok']}: {len(well)} checks</summary>"
        f'<ul class="checks">{"".join(well)}</ul></details>'
    )


def _item(check: Check) -> str:
    where = ""
    if check.frames is not None:
        first, last = check.frames[0], check.frames[1] - 1
        where = f' <span class="where">poses {first} to {last}</span>'
    fix = f'<span class="fix"><b>Do:</b> {escape(check.fix)}</span>' if check.fix else ""
    return (
        f'<li><span class="badge {check.severity}">{WORDS[check.severity]}</span>'
        f'<span class="name">{escape(check.name.capitalize())}</span>'
        f'<span class="what">{escape(check.message)}{where}{fix}</span></li>'
    )
