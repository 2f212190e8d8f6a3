"""One table of what became of all sessions of a batch."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from capture_app.jobs.record import JobRecord
from omomo_core.whole_file import write_whole

_FIRST = ("name", "state", "verdict", "seconds", "sample")
_LAST = ("code", "error", "where", "fix", "session", "output", "id")


def write_results(folder: Path, jobs: Sequence[JobRecord]) -> None:
    """Write results.csv and results.json, each whole or not at all.

    Raises:
        InputError: they cannot be written.
    """
    rows = [_row(job) for job in jobs]
    scores = sorted({name for row in rows for name in row["scores"]})
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*_FIRST, *scores, *_LAST])
    for row in rows:
        judged = [row["scores"].get(name) for name in scores]
        writer.writerow([*(row[n] for n in _FIRST), *judged, *(row[n] for n in _LAST)])
    write_whole(folder / "results.csv", text.getvalue())
    write_whole(folder / "results.json", json.dumps(rows, indent=1) + "\n")


def _row(job: JobRecord) -> dict[str, Any]:
    error, sessions = job.error, [item.path for item in job.inputs if item.role == "session"]
    return {
        "name": job.name,
        "state": job.state,
        "verdict": job.summary.get("verdict"),
        "seconds": round(sum(job.timings.values()), 1) if job.timings else None,
        "sample": job.summary.get("sample"),
        "scores": {k: round(v, 4) for k, v in job.summary.get("scores", {}).items()},
        "code": error and error.code,
        "error": error and error.what,
        "where": error and error.where,
        "fix": error and error.fix,
        "session": sessions[0] if sessions else None,
        "output": job.output,
        "id": job.id,
    }
