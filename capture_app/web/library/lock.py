"""One server for one library: two would write into the same uploads."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from omomo_core.errors import InputError


@contextmanager
def only_server(root: Path) -> Generator[Path]:
    """Hold the library while the block runs; gives the file to write the server's address into.

    Raises:
        InputError: "library-served": another server holds it.
    """
    path = root / "server"
    with path.open("a+", encoding="utf-8") as file:
        if not _hold(file.fileno()):
            address = path.read_text(encoding="utf-8").strip()
            raise InputError(
                "library-served",
                "Another server has this library open.",
                where=str(root),
                fix=f"Open {address} in a browser, or give another folder with ‹library›."
                if address
                else "Stop it, or give another folder with ‹library›.",
            )
        file.truncate(0)
        yield path


def _hold(handle: int) -> bool:
    """Lock an open file until it is closed; the system frees it when the process dies."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
