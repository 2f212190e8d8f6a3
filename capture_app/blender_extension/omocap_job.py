"""Calls of the user's own omocap in processes beside Blender, with progress, cancel and clear errors."""

import json
import os
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Generator
from functools import lru_cache
from pathlib import Path
from typing import IO

Steps = Generator[list[str], None, None]
"""Gives the arguments of one call of omocap after the other, and does its own part between them."""
_ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
_PROGRESS = re.compile(r"([A-Z][A-Za-z ]*?)\s+[^\w\s%][^\w%]*\s(\d+)%")
"""A line of the command line's bars: the stage, the bar, the percentage."""
_POLL = 0.05
"""Seconds."""


class ExtensionFailure(Exception):
    """What went wrong, in words for the user of Blender."""


class OmocapCall:
    """One process of omocap, which is read while it works."""

    def __init__(self, words: list[str]) -> None:
        """Start it; raises ExtensionFailure where there is no such program."""
        program = shutil.which(words[0])
        if program is None:
            raise ExtensionFailure(
                f"There is no program {words[0]!r}. Give the path of omocap (.venv/bin/omocap in its "
                "folder) in Preferences > Add-ons > omocap."
            )
        # As on a terminal: its bars tell how far it is.
        environment = {**os.environ, "FORCE_COLOR": "1", "COLUMNS": "100"}
        self._text = ""
        self._process = subprocess.Popen(
            [program, *words[1:]],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment,
        )
        self._reader = threading.Thread(target=self._read, args=(self._process.stdout,))
        self._reader.daemon = True
        self._reader.start()

    def _read(self, pipe: IO[bytes]) -> None:
        # Only the end is kept: the bars are drawn again ten times a second.
        with pipe:
            while piece := os.read(pipe.fileno(), 65536):
                self._text = (self._text + piece.decode("utf-8", "replace"))[-20000:]

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    @property
    def text(self) -> str:
        """What it said last, without colours."""
        return _ESCAPES.sub("", self._text)

    @property
    def progress(self) -> tuple[str, float]:
        """The stage that it is in, and the part of that which is done."""
        found = _PROGRESS.findall(self.text)
        return (found[-1][0], int(found[-1][1]) / 100) if found else ("Starting omocap", 0.0)

    def check(self) -> None:
        """Raise ExtensionFailure with omocap's own words where it failed."""
        self._reader.join(timeout=10)
        if self._process.returncode:
            said = self.text.replace("\r", "\n")
            lines = [line.strip() for line in said[said.rfind("Error:") :].splitlines()]
            raise ExtensionFailure(
                "\n".join(line for line in lines if line)[-600:] or "omocap failed."
            )

    def cancel(self) -> None:
        """Stop it; omocap removes what was half written."""
        self._process.terminate()
        self._process.wait(timeout=30)
        self._reader.join(timeout=10)


class OmocapJob:
    """Steps of which each is a call of omocap, followed without waiting for it."""

    def __init__(self, omocap: str, steps: Steps, notes: list[str]) -> None:
        """`omocap` is the program's path or name; what it notes is added to `notes`."""
        self._omocap, self._steps, self.notes = omocap, steps, notes
        self._call: OmocapCall | None = None

    @property
    def progress(self) -> tuple[str, float]:
        """The stage of the call that is running, and the part of it which is done."""
        return ("Starting omocap", 0.0) if self._call is None else self._call.progress

    def advance(self) -> bool:
        """Go on as far as is possible without waiting; False when all is done.

        Raises:
            ExtensionFailure: a call failed, or what was to be done between calls is not possible.
        """
        try:
            if self._call is not None:
                if self._call.is_running:
                    return True
                self._call.check()
                self.notes += re.findall(r"^Note: (.+)$", self._call.text, re.MULTILINE)
            words = next(self._steps, None)
            self._call = None if words is None else OmocapCall([self._omocap, *words])
        except BaseException:
            self._steps.close()
            raise
        return self._call is not None

    def run(self) -> None:
        """Do all and wait, where there is no window."""
        while self.advance():
            time.sleep(_POLL)

    def cancel(self) -> None:
        """Stop, and remove what the steps made on their way."""
        if self._call is not None:
            self._call.cancel()
        self._steps.close()


def samples_of(folder: str) -> tuple[int, int]:
    """How many samples a result folder holds, and the index of the best; (0, 0) if it is none."""
    path = Path(folder, "manifest.json")
    try:
        return _samples(path, path.stat().st_mtime_ns)
    except (OSError, ValueError, KeyError, TypeError):
        return 0, 0


@lru_cache(maxsize=8)
def _samples(path: Path, _changed: int) -> tuple[int, int]:
    manifest = json.loads(path.read_text(encoding="utf-8"))
    return len(manifest["scores"]), int(manifest["chosen"])


def free_folder(wanted: Path) -> Path:
    """The folder, or the first of its name with a number that is not there yet."""
    numbered = (wanted.with_name(f"{wanted.name}_{k}") for k in range(2, 10000))
    return next(path for path in (wanted, *numbered) if not path.exists())
