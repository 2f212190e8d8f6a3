"""The `omocap` that a page's blocks call under test: the command as typed, with less to do.

Nothing is changed but how much is computed (samples, steps, sizes, counts), that no browser opens,
and that a server has no worker, takes a free port and is stopped once it has said where it is.
"""

import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import urlopen

from tests.docs.preloaded import CLIENT

REPO = Path(__file__).resolve().parents[2]
"""Found here, because every command of a page imports this file, which must import little."""
_QUICK = ("--samples", "1", "--steps", "2", "--no-video")
LESS: dict[str, tuple[str, ...]] = {
    "run": _QUICK,
    "batch": _QUICK,
    "resolve": ("--no-video",),
    "replay": ("--no-browser",),
    "compare": ("--size", "160x120"),
    "render": ("--size", "160x120"),
    "tables": ("--samples", "1", "--steps", "1", "--limit", "1"),
    "evaluate": ("--samples", "1", "--steps", "1"),
    "train": ("--steps", "1", "--batch", "2", "--synthetic", "2"),
    "data synthesise": ("--count", "1"),
    "data inspect": ("--clips", "1", "--videos", "0"),
    "study make": ("--raters", "1", "--pairs", "1", "--checks", "0", "--size", "96x72"),
    "scan": ("--draft", "--vertices", "1000", "--method", "depth"),
}
"""What is added to a command, by its words. The last of two options counts."""
_START = "from capture_app.cli.start import main; main()"


def hurried(words: list[str]) -> list[str]:
    """The words of a command, and what makes it quick.

    Cutting an object out of a mesh is quick already. The garden chair is scanned as its page says, because
    that page is run by the slow tests alone.
    """
    if words[:1] == ["scan"] and {"mesh", "garden_chair"} & set(words):
        return words
    for count in (2, 1):
        name = " ".join(words[:count])
        if name in LESS:
            return [*words, *LESS[name]]
    return words


def write_shim(path: Path, preloaded: Path | None = None) -> None:
    """Write the command into a folder that goes first on the PATH.

    Args:
        path: of the command.
        preloaded: the socket of a process whose children run the commands (`tests/docs/preloaded.py`);
            without it, each command is an interpreter of its own.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if preloaded is not None:
        path.write_text(CLIENT.format(python=sys.executable, address=str(preloaded)))
        path.chmod(0o755)
        return
    imports = [
        "import sys",
        f"sys.path.insert(0, {str(REPO)!r})",
        "from tests.docs.hurry import main",
    ]
    # Processes that a command starts import this file, and must not begin anew.
    guarded = ['if __name__ == "__main__":', "    main()", ""]
    path.write_text("\n".join([f"#!{sys.executable}", *imports, *guarded]))
    path.chmod(0o755)


def main() -> None:
    """What the shim does."""
    words = sys.argv[1:]
    if words[:1] == ["serve"]:
        raise SystemExit(_served([*words, "--no-browser", "--port", "8980"]))
    sys.argv = ["omocap", *hurried(words)]
    from capture_app.cli.start import main as start

    start()


def _served(words: list[str]) -> int:
    """Start a server, wait until it answers where it says it is, stop it as Ctrl-C does; exit code."""
    command = [sys.executable, "-u", "-c", _START, *words, "--workers", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        said = server.stdout.readline()
        print(said, end="", flush=True)
        if not said.startswith("Open: "):
            return server.wait(60) or 1
        _await(urlsplit(said.removeprefix("Open: ").strip()).port or 0)
        server.send_signal(signal.SIGINT)
        return server.wait(60)


def _await(port: int) -> None:
    """Until a server on this machine answers, in whatever words."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            urlopen(f"http://127.0.0.1:{port}/api/health", timeout=5).close()
        except HTTPError:
            return  # It asks for its token.
        except OSError:
            time.sleep(0.2)
        else:
            return
