"""Heavy: pieces of slow work in bounded children, a few at a time, the same one never twice at once."""

import asyncio
import shutil
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from capture_app.web.sandbox.bounds import ProcessLimits
from capture_app.web.sandbox.child_process import Work, in_child

AT_ONCE = 2


class SandboxPool:
    """A queue of such work; waiting in it keeps nobody else from being served."""

    def __init__(
        self, scratch: Path, bounds: ProcessLimits | None = None, *, at_once: int = AT_ONCE
    ) -> None:
        self._scratch = scratch
        self._bounds = bounds or ProcessLimits()
        self._threads = ThreadPoolExecutor(at_once, thread_name_prefix="heavy")
        self._running: dict[tuple[Any, ...], asyncio.Future[dict[str, Any]]] = {}

    async def run(self, work: Work, *given: Any) -> dict[str, Any]:
        """Call a function in a child; who asks for the same meanwhile gets the same answer.

        Raises:
            InputError: as `in_child`.
        """
        key = (work, *given)
        running = self._running.get(key)
        if running is None:
            loop = asyncio.get_running_loop()
            running = loop.run_in_executor(self._threads, self._call, work, given)
            self._running[key] = running
            running.add_done_callback(lambda _: self._running.pop(key, None))
        # One who goes away does not take the answer from the others.
        return await asyncio.shield(running)

    def close(self) -> None:
        """Begin nothing more."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _call(self, work: Work, given: tuple[Any, ...]) -> dict[str, Any]:
        scratch = Path(tempfile.mkdtemp(dir=self._scratch))
        try:
            return in_child(work, *given, scratch=scratch, bounds=self._bounds)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
