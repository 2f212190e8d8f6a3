"""What a study found, as files: JSON for programs, a Markdown table and a figure for a paper."""

import json
from pathlib import Path

from capture_app.staging import staged_folder
from capture_app.study.analysis import Analysis, Preference
from capture_app.study.figure import write_figure
from capture_app.study.key import Key
from omomo_core.errors import InputError


def write_report(output: Path, key: Key, found: Analysis) -> None:
    """Write analysis.json, table.md, figure.svg and figure.png into a new folder.

    Raises:
        InputError: the folder exists, or cannot be written.
    """
    with staged_folder(output) as folder:
        try:
            text = json.dumps(document(key, found), indent=1, ensure_ascii=False) + "\n"
            (folder / "analysis.json").write_text(text, encoding="utf-8")
            (folder / "table.md").write_text(table(found), encoding="utf-8")
            write_figure(folder, found.preferences)
        except OSError as error:
            raise InputError(
                "output-not-writable",
                f"The analysis cannot be written: {error.strerror or error}.",
                where=str(output),
                fix="Give a folder with room in it with -o.",
            ) from error


def document(key: Key, found: Analysis) -> dict[str, object]:
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
            for p in found.preferences
        ],
        "raters_counted": found.kept,
        "raters_left_out": [{"votes": name, "why": why} for name, why in found.left_out],
        "share_left": found.left_share,
        "pages_without_votes": len(key.pages) - len(found.kept) - len(found.left_out),
    }


def table(found: Analysis) -> str:
    """A Markdown table, and below it who was counted."""
    rows = [
        "| preferred | to | votes for it | 95 % interval | votes | |",
        "|---|---|---:|---|---:|---|",
        *(_row(p) for p in found.preferences),
    ]
    out = [f"- {_cell(name)}: {why}" for name, why in found.left_out]
    counted = f"{len(found.kept)} raters counted, {len(out)} left out" + (":" if out else ".")
    side = f"{found.left_share:.0%} of the votes are for the film on the left."
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
