"""One worker process, as `capture_app.jobs.fleet` starts it: `python -m capture_app.jobs`.

The database is in the environment, because its URL may hold a password and arguments are public.
Where its starter says so, it stops when standard input ends, because then the starter has died.
"""

import logging
import os
import signal
import sys
import threading

from capture_app.jobs.fleet import DATABASE, FOLLOW, LOG
from capture_app.jobs.worker import work
from omomo_core.errors import InputError


def main() -> int:
    """Returns 2 when the database cannot be used."""
    log = os.environ.get(LOG)
    logging.basicConfig(
        level=logging.INFO,
        format="%(asctime)s %(process)d %(levelname)s %(message)s",
        handlers=[logging.FileHandler(log) if log else logging.StreamHandler()],
    )
    if FOLLOW in os.environ:
        threading.Thread(target=_follow_starter, daemon=True).start()
    try:
        work(os.environ[DATABASE])
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    return 0


def _follow_starter() -> None:
    while os.read(0, 1):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
