"""Jobs: ordered, looked at, cancelled, forgotten."""

import asyncio
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Query
from pydantic import ConfigDict

from capture_app.jobs.job_record import JobRecord, State
from capture_app.web.file_response import ResultFile, listed
from capture_app.web.job_requests import to_order
from capture_app.web.page_words import all_in_page_words
from capture_app.web.problems import Refused
from capture_app.web.routes.orders import Ordered
from capture_app.web.shelves import Id, missing, new_id
from capture_app.web.site import Here, Site, ThingId
from omomo_core.errors import InputError

router = APIRouter(prefix="/api/jobs", tags=["jobs"])


class Job(JobRecord):
    """A job, and what the page links it to."""

    model_config = ConfigDict(frozen=True, extra="allow")

    result: str | None
    """Id of the result that it makes, or that its file belongs to."""
    waits: str | None
    """Why it has not begun, in a sentence; null unless it waits."""
    made: str | None
    """Address on the page of what it made, such as "mounts/ID"; null for a file or before it is done."""
    files: list[ResultFile]
    """What it made beside a result."""
    download: str | None
    """Address of the first of them."""


@router.post("", status_code=201)
async def order(
    site: Here,
    given: Annotated[Ordered, Body()],
    idempotency_key: Annotated[
        Id | None,
        Header(
            description="Becomes the job's id: a request with the same one starts no second job. A new "
            "one if not given."
        ),
    ] = None,
) -> Job:
    """Order a motion, a correction, an export, a video, a comparison, a calibration or a scan.

    With an Idempotency-Key of sixteen hex digits, which becomes the job's id, it is safe to ask again.
    """
    id_ = idempotency_key or new_id()
    record = await asyncio.to_thread(site.queue.get, id_)
    if record is None:
        ordered = await to_order(site, id_, given)
        record = await asyncio.to_thread(lambda: site.queue.submit(ordered, id=id_))
    return _job(site, record)


@router.get("")
def list_(
    site: Here,
    limit: Annotated[int, Query(ge=1, le=1000, description="How many at most.")] = 100,
    state: Annotated[
        State | None, Query(description="Only those in this state; all if not given.")
    ] = None,
) -> list[Job]:
    """The latest jobs, the newest first."""
    return [_job(site, record) for record in site.queue.list(limit=limit, state=state)]


@router.get("/{id}")
def get(site: Here, id: ThingId) -> Job:
    """How a job is going."""
    return _there(site, id, site.queue.get(id))


@router.post("/{id}/cancel")
def cancel(site: Here, id: ThingId) -> Job:
    """Stop a job; nothing of it is left behind."""
    return _there(site, id, site.queue.cancel(id))


@router.post("/{id}/again")
def again(site: Here, id: ThingId) -> Job:
    """Begin a failed or cancelled job once more."""
    return _there(site, id, site.queue.again(id))


@router.delete("/{id}", status_code=204)
def forget(site: Here, id: ThingId) -> None:
    """Take a job that is over off the list; what it made stays."""
    _there(site, id, site.queue.get(id))
    try:
        site.queue.delete(id)
        site.library.notes.forget(id)
    except InputError as error:
        raise Refused(409, error.code, error.what, where=error.where, fix=error.fix) from error


def _there(site: Site, id_: str, record: JobRecord | None) -> Job:
    if record is None:
        raise missing("job", id_)
    return _job(site, record)


def _job(site: Site, record: JobRecord) -> Job:
    made = _made(site, record)
    fields: dict[str, Any] = _shown(site, record.model_dump())
    if record.error is not None and record.error.code == "defect":
        # Its class says nothing to the owner of a job; the log of the worker has all of it.
        fields["error"]["what"] = (
            "Something went wrong in the program; what you brought is unharmed."
        )
    fields |= {key: all_in_page_words(fields[key], record.kind) for key in ("error", "log")}
    links = {
        "output": site.library.shown(record.output or "") or None,
        "result": _result(site, record),
        "waits": _waits(site) if record.state == "queued" else None,
        "made": site.library.item_of(Path(record.output)) if record.output else None,
        "files": made,
        "download": made[0].href if made else None,
    }
    return Job.model_validate({**fields, **links})


def _waits(site: Site) -> str:
    """Return what a job that has not begun waits for."""
    if site.library.free <= site.limits.spare:
        return (
            f"The disk is full: {site.library.free / 1e6:,.0f} MB are left. It begins when there is room; "
            "delete what is not needed any more."
        )
    if not site.queue.workers():
        return (
            "No worker is there yet. If none comes within half a minute, nobody has started one for this "
            "library: the command omocap worker does."
        )
    counts = site.queue.counts()
    busy = counts.get("running", 0) + counts.get("cancelling", 0)
    if not busy:
        return "It begins in a few seconds."
    return f"The workers are busy: {busy} running, {counts.get('queued', 0)} waiting with this one."


def _result(site: Site, record: JobRecord) -> str | None:
    return site.library.result_of(Path(record.output)) if record.output else None


def _made(site: Site, record: JobRecord) -> list[ResultFile]:
    """The files that begin as its output does, when they lie among the exports of a result."""
    result = _result(site, record)
    if result is None or record.output is None or record.state != "done":
        return []
    output = Path(record.output)
    if output.parent != site.library.results.exports(result):
        return []
    beside = listed(output.parent, f"/api/results/{result}/exports")
    return [file for file in beside if file.name.startswith(output.stem)]


def _shown(site: Site, value: Any) -> Any:
    """Return a record with the names that people gave in place of paths, in all its texts."""
    if isinstance(value, str):
        return site.library.shown(value)
    if isinstance(value, dict):
        return {key: _shown(site, part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_shown(site, part) for part in value]
    return value
