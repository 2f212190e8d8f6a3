"""StageCache: the folder that keeps finished stages, so that an interrupted scan resumes."""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

VERSION = "2"
"""Of what the stages write; raised when they write something else."""


@dataclass(frozen=True)
class StageCache:
    """A folder that keeps finished stages, each with the key of its inputs."""

    folder: Path

    def record(self, stage: str, key: str) -> dict[str, Any] | None:
        """The record of a finished stage; None if it is not finished or its inputs have changed."""
        try:
            stored = json.loads((self.folder / f"{stage}.json").read_bytes())
        except (OSError, ValueError):
            return None
        return stored["record"] if isinstance(stored, dict) and stored.get("key") == key else None

    def finish(self, stage: str, key: str, record: Mapping[str, Any]) -> None:
        """Record that a stage is finished, once all its other files are written."""
        text = json.dumps({"key": key, "record": record}, indent=1, default=_plain)
        temporary = self.folder / f".{stage}.{uuid4().hex[:8]}.part"
        with temporary.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(self.folder / f"{stage}.json")

    def begin(self, stage: str) -> None:
        """Remove the record of a finished stage."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / f"{stage}.json").unlink(missing_ok=True)


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def key_of(*parts: object) -> str:
    """Return a short digest of inputs and options."""
    text = json.dumps([VERSION, *parts], default=str, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def state_of(path: Path) -> list[tuple[str, int, int]]:
    """Names, sizes and times of a file, or of all files in a folder: what changes when it does."""
    files: Iterable[Path] = [path] if path.is_file() else path.rglob("*")
    states = [(file, file.stat()) for file in files if file.is_file()]
    return sorted((str(file), state.st_size, state.st_mtime_ns) for file, state in states)
