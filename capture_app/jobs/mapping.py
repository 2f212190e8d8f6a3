"""From orders to rows of the table, and from rows to records."""

import time
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

import sqlalchemy as sa

from capture_app.commands.request import Request
from capture_app.jobs.record import JobRecord

_TIMES = ("created", "started", "ended")
_PLAIN = tuple(name for name in JobRecord.model_fields if name not in _TIMES)


def row_of(job_id: str, order: Request) -> dict[str, Any]:
    """A job that waits."""
    return {
        "id": job_id,
        "kind": order.KIND,
        "name": order.name,
        "order": order.model_dump(mode="json"),
        "inputs": [{"role": role, "path": str(path)} for role, path in order.inputs.items()],
        "options": order.options,
        "output": str(order.output),
        "workflow": new_workflow(job_id),
        "created": time.time(),
    }


def new_workflow(job_id: str) -> str:
    """A name for the DBOS workflow of a job that nothing had before."""
    return f"{job_id}-{uuid4().hex[:16]}"


def rows(c: sa.Connection, wanted: sa.Executable) -> list[dict[str, Any]]:
    """What a question or a change with RETURNING gives."""
    found = c.execute(wanted)
    columns = list(found.keys())
    return [dict(zip(columns, row, strict=True)) for row in found]


def record_of(row: Mapping[str, Any]) -> JobRecord:
    """What people and programs are told of it."""
    times = {name: _time(row[name]) for name in _TIMES}
    return JobRecord.model_validate({**{name: row[name] for name in _PLAIN}, **times})


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
