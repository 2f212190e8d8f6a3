"""What children are told to do in tests."""

import errno
import os
import time
from pathlib import Path
from typing import Any

from omomo_core.errors import InputError

MIB = 2**20


def well(number: int) -> dict[str, Any]:
    return {"twice": 2 * number, "pid": os.getpid()}


def refuses() -> dict[str, Any]:
    raise InputError("some-code", "It is wrong.", where="here", fix="Mend it.")


def breaks() -> dict[str, Any]:
    raise ZeroDivisionError("/secret/path")


def fills_the_disk() -> dict[str, Any]:
    raise OSError(errno.ENOSPC, "No space left on device", "/secret/path")


def dies() -> dict[str, Any]:
    os._exit(7)


def sleeps() -> dict[str, Any]:
    time.sleep(60)
    return {}


def spins() -> dict[str, Any]:
    while True:
        pass


def devours() -> dict[str, Any]:
    return {"length": len(bytes(900 * MIB))}


def fills(path: Path) -> dict[str, Any]:
    path.write_bytes(bytes(3 * MIB))
    return {}


def counts(path: Path) -> dict[str, Any]:
    with path.open("a") as file:
        file.write("x")
    time.sleep(0.5)
    return {}
