"""Fixtures that take long to make: made once for all processes of a test run."""

import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from filelock import FileLock

T = TypeVar("T")


def once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], T]) -> T:
    """Return what `make` makes in a new folder; the first process makes it, and the others wait and read it.

    Args:
        factory: of temporary folders.
        name: of what is made, unique in the test run.
        make: is given the folder; what it returns is pickled.
    """
    root = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        root = root.parent
    made = root / f"{name}.pickle"
    with FileLock(root / f"{name}.lock"):
        if not made.exists():
            made.write_bytes(pickle.dumps(make(factory.mktemp(name))))
    return pickle.loads(made.read_bytes())
