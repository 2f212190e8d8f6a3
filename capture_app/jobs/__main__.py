"""One worker process, as `capture_app.jobs.fleet` starts it: `python -m capture_app.jobs`.

The database is in the environment, because its URL may hold a password and arguments are public.
Where its starter says so, it stops when standard input ends, because then the starter has died.
"""

import logging
import os
import signal
import sys
import threading

from capture_app.commands.spelling import in_options
from capture_app.jobs.fleet import DATABASE, FOLLOW, LOG, NO_ROOM
from capture_app.jobs.job_record import no_room
from capture_app.jobs.worker import warm_up, work
from omomo_core.errors import InputError


def main() -> int:
    """Returns 2 when the database cannot be used, and `NO_ROOM` when its disk is full."""
    # The log may be on the disk that is full: that is told by the exit code.
    logging.raiseExceptions = False
    log = os.environ.get(LOG)
    logging.basicConfig(
        level=logging.INFO,
        format="%(asctime)s %(process)d %(levelname)s %(message)s",
        handlers=[logging.FileHandler(log) if log else logging.StreamHandler()],
    )
    if FOLLOW in os.environ:
        threading.Thread(target=_follow_starter, daemon=True).start()
    try:
        work(os.environ[DATABASE], warm_up=warm_up)
    except InputError as error:
        print(f"Error: {in_options(str(error))}", file=sys.stderr)
        return NO_ROOM if no_room(error) else 2
    return 0


def _follow_starter() -> None:
    while os.read(0, 1):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
