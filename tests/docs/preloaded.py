"""A process that has loaded the program; each of its children runs one command, which then needs not load it.

Usage: python -m tests.docs.preloaded SOCKET

A child is what a fresh interpreter would be after its imports: its own process with the command's words,
folder, environment and files. What loading does to a command is tested with real interpreters
(`tests/capture_app/test_cli.py`, `test_interrupting.py`, and README's blocks).
"""

import array
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

_REPO = Path(__file__).resolve().parents[2]
CLIENT = """#!{python} -IS
import array, json, os, signal, socket, sys
with socket.socket(socket.AF_UNIX) as server:
    server.connect({address!r})
    asked = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
    files = array.array("i", [0, 1, 2]).tobytes()
    server.sendmsg([len(asked).to_bytes(8)], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, files)])
    server.sendall(asked)
    answer = server.makefile()
    child = int(answer.readline())
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: os.kill(child, number))
    sys.exit(int(answer.readline() or 1))
"""
"""The `omocap` of a shell: asks for a command, hands it its files and signals, and ends as it does."""


@contextmanager
def preloaded(folder: Path, environment: dict[str, str]) -> Iterator[Path]:
    """A running process of this kind; gives its socket."""
    address = folder / "socket"
    command = [sys.executable, "-m", __spec__.name, str(address)]
    with subprocess.Popen(command, cwd=_REPO, env=environment, stdin=subprocess.PIPE) as process:
        while not address.exists():
            assert process.poll() is None
            time.sleep(0.05)
        yield address
        process.kill()


def main() -> None:
    """Answer each connection with a child; a child returns from here to run its command."""
    for module in ("capture_app.cli.app", "capture_app.pipeline", "capture_app.posters"):
        import_module(module)

    with socket.socket(socket.AF_UNIX) as listening:
        part = f"{sys.argv[1]}.part"
        listening.bind(part)
        listening.listen(8)
        os.rename(part, sys.argv[1])
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        while True:
            client, _ = listening.accept()
            if os.fork() == 0:
                break
            client.close()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _command(client)


def _command(client: socket.socket) -> None:
    """Run the command in a child of this process, and tell the client how it ends."""
    size, sent, *_ = client.recvmsg(8, socket.CMSG_SPACE(3 * array.array("i").itemsize))
    files = array.array("i", sent[0][2])
    with client.makefile("rb") as reading:
        words, folder, environment = json.loads(reading.read(int.from_bytes(size)))
    child = os.fork()
    if child:
        for file in files:
            os.close(file)
        client.sendall(f"{child}\n".encode())
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        client.sendall(f"{code if code >= 0 else 128 - code}\n".encode())
        os._exit(0)
    client.close()
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["omocap", *words]
    from tests.docs.hurry import main as hurried

    hurried()


if __name__ == "__main__":
    main()
