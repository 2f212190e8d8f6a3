"""`omocap serve` as a process of its own."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx

_START = "from typer import Typer; from capture_app.cli.serve import serve; a = Typer(); "
_START += "a.command()(serve); a()"


class Server:
    """A server in the middle of its life."""

    def __init__(self, library: Path, *options: str) -> None:
        command = [sys.executable, "-c", _START, "--library", str(library), "--no-browser"]
        self.process = subprocess.Popen(
            [*command, "--workers", "0", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        assert self.process.stdout is not None
        said: list[str] = []
        for line in self.process.stdout:
            said.append(line)
            if line.startswith("Open: "):
                break
        self.said = "".join(said)
        found = re.search(r"http://\S+", self.said)
        self.address = found[0] if found else ""

    @property
    def url(self) -> str:
        """Without a token, for a client."""
        return self.address.partition("?")[0].rstrip("/")

    def wait(self, address: str = "") -> None:
        """Until it answers, at another address perhaps."""
        for _ in range(300):
            try:
                httpx.get(address or f"{self.url}/", timeout=5)
            except httpx.TransportError:
                time.sleep(0.1)
            else:
                return
        raise TimeoutError(self.said)

    def stop(self, how: signal.Signals = signal.SIGINT) -> int:
        """End it; returns its status."""
        self.process.send_signal(how)
        status = self.process.wait(30)
        assert self.process.stdout is not None
        self.said += self.process.stdout.read()
        self.process.stdout.close()
        return status
