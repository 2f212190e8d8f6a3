"""DBOS, which runs the jobs' stages as durable steps: how we set it up, and its silence.

It talks to nobody but the database: its telemetry is off unless asked for, and its Conductor, a
hosted service, needs a key that we do not give.
"""

import logging
from collections.abc import Callable, Collection

from dbos import DBOS, DBOSClient, DBOSConfig, DBOSPortableJSONSerializer, StepOptions

from capture_app.jobs.database import Database

APPLICATION = "omocap"
QUEUE = "omocap"
WORKFLOW = "omocap_job"
SERIALIZER = DBOSPortableJSONSerializer()
"""The default one is pickle: whoever may write to the database could run code here."""
_VERSION = "1"
"""Version of the steps: workers only take up jobs of their own version."""
_LOOK = 0.1
"""Seconds between looks into an empty queue."""
_FIRST_IN_QUEUE = 100
"""Jobs that are looked at for one that somebody waits for."""


def launch(database: Database, worker: str, perform: Callable[[str, str], None]) -> None:
    """Begin to take jobs from the queue, one at a time.

    Args:
        database: of the jobs.
        worker: name of this process.
        perform: given the id of a job and of its workflow, does it, in a thread of DBOS.
    """

    def job(job_id: str) -> None:
        perform(job_id, DBOS.workflow_id or "")

    # Without a handler of ours it prints to the console.
    logging.getLogger("dbos").addHandler(logging.NullHandler())
    logging.getLogger("dbos").propagate = True
    config: DBOSConfig = {
        "name": APPLICATION,
        "system_database_engine": database.engine,
        "application_version": _VERSION,
        "executor_id": worker,
        "log_level": "WARNING",
        "serializer": SERIALIZER,
    }
    client = client_of(database)
    client.register_queue(
        QUEUE, worker_concurrency=1, polling_interval_sec=_LOOK, on_conflict="always_update"
    )
    client.destroy()
    DBOS(config=config)
    DBOS.workflow(name=WORKFLOW, max_recovery_attempts=None)(job)
    DBOS.listen_queues([QUEUE])
    DBOS.launch()


def client_of(database: Database) -> DBOSClient:
    """Return a client that orders jobs, and does none."""
    return DBOSClient(
        system_database_engine=database.engine,
        serializer=SERIALIZER,
        application_name=APPLICATION,
        retry_connection_errors=False,
    )


def durable(name: str, step: Callable[[], bool]) -> bool:
    """Run a step, or tell what it returned when an earlier attempt ran it to its end."""
    return DBOS.run_step(StepOptions(name=name), step)


def running() -> dict[str, str]:
    """Return the workers of all workflows that have begun and not ended, by the workflow's id."""
    pending = DBOS.list_workflows(status="PENDING", name=WORKFLOW, load_input=False)
    return {flow.workflow_id: flow.executor_id or "" for flow in pending}


def waited_for(workflow: str) -> bool:
    """Whether somebody waits for this job."""
    status = DBOS.get_workflow_status(workflow)
    return status is None or not status.priority


def others_waited_for() -> bool:
    """Whether somebody waits for a job that has not begun."""
    queued = DBOS.list_queued_workflows(
        queue_name=QUEUE, status="ENQUEUED", load_input=False, limit=_FIRST_IN_QUEUE
    )
    return any(not other.priority for other in queued)


def release(workers: Collection[str]) -> None:
    """Put what these workers were at back into the queue; they must be dead."""
    # A public way to do this on condition that the worker is still the same there is not: the
    # documented ones are a request to DBOS' own server and resume_workflow, which asks nothing.
    DBOS._recover_pending_workflows(list(workers))  # pyright: ignore[reportPrivateUsage]
