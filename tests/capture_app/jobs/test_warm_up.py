"""What a worker does before its first job."""

import os
import subprocess
import sys
import threading
from pathlib import Path

from stand_in import StandInOrder
from waiting import check_done, finished, until

from capture_app.jobs.fleet import Fleet
from capture_app.jobs.queue import JobQueue

HERE = Path(__file__).parent
_COLD = """
import logging, os, sys, time
sys.path.insert(0, {here!r})
from stand_in import KIND
from capture_app.jobs.worker import work

logging.basicConfig(filename={log!r}, level="INFO")

def warm_up():
    while not os.path.exists({go!r}):
        time.sleep(0.02)
    raise RuntimeError("cold")

work({url!r}, kinds={{"stand-in": KIND}}, warm_up=warm_up)
"""


def test_the_first_job_waits_until_the_worker_is_warm_and_is_done_by_a_cold_one(
    queue: JobQueue, tmp_path: Path
) -> None:
    made = queue.submit(StandInOrder(output=tmp_path / "out" / "a"))
    log, go = tmp_path / "log", tmp_path / "go"
    code = _COLD.format(here=str(HERE), log=str(log), go=str(go), url=queue.database_url)
    fleet = Fleet(queue.database_url, 1, command=[sys.executable, "-c", code])
    fleet.start()
    try:
        until(lambda: log.exists() and "is ready" in log.read_text())
        threading.Event().wait(0.5)
        record = queue.get(made.id)
        assert record is not None
        assert record.state == "queued"
        assert queue.workers() == 1
        go.touch()
        check_done(finished(queue, [made.id])[0])
    finally:
        fleet.stop()
    assert "could not warm up" in log.read_text()


def test_warming_up_loads_what_a_motion_needs_and_writes_nothing(tmp_path: Path) -> None:
    code = (
        "import sys; from capture_app.jobs.worker import warm_up; warm_up(); "
        "missing = {'torch', 'capture_app.pipeline', 'capture_app.posters'} - set(sys.modules); "
        "sys.exit(len(missing))"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
    assert not any(tmp_path.iterdir())
