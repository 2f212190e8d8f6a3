"""`omocap serve`: the page, on this machine.

print_qr: an address that a phone's camera reads off the terminal.
"""

import sys
from pathlib import Path
from typing import Annotated

import segno
import typer

from capture_app.cli.console import say

_Library = Annotated[
    Path, typer.Option("--library", help="Folder that keeps everything; made if it is not there.")
]
_Host = Annotated[
    str,
    typer.Option(
        help="Address to listen on. Beyond 127.0.0.1 others can reach the server, and it asks for a "
        "token.",
    ),
]
_Port = Annotated[
    int, typer.Option(min=1, max=65535, help="The next free one is taken when it is not free.")
]
_Token = Annotated[
    str | None,
    typer.Option(help="Token to ask for; made if not given where one is needed."),
]
_AllowHost = Annotated[
    list[str] | None,
    typer.Option(
        "--allow-host", help="Name under which a proxy shows the server. Repeat it.", metavar="NAME"
    ),
]
_NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")]
_Workers = Annotated[
    int, typer.Option(min=0, max=64, help="Jobs done at once; 0 leaves them to `omocap worker`.")
]


def serve(
    library: _Library = Path("~/omocap"),
    host: _Host = "127.0.0.1",
    port: _Port = 8765,
    token: _Token = None,
    allow_host: _AllowHost = None,
    no_browser: _NoBrowser = False,
    workers: _Workers = 1,
) -> None:
    """Open the page: drop a session, look at its report, get the motion.

    Nothing leaves this machine. Ctrl-C stops it; a job in the middle goes on at the next start.
    """
    from capture_app.web.guards import is_loopback
    from capture_app.web.server import ServerConfig, open_browser
    from capture_app.web.server import serve as run

    def started(address: str) -> None:
        say("Open", address, "bold green")
        say("Library", str(library.expanduser()), "bold")
        if not is_loopback(host):
            say(
                "Phone",
                "open the address on the same network, or scan this with its camera",
                "bold",
            )
            print_qr(address)
        if not no_browser:
            open_browser(address)

    config = ServerConfig(library.expanduser(), host, port, token, tuple(allow_host or ()), workers)
    run(config, started, lambda sentence: say("Note", sentence, "bold yellow"))


def print_qr(address: str) -> None:
    """Print a QR code of an address, where the output can show its blocks."""
    try:
        segno.make(address, error="l", micro=False).terminal(sys.stdout, compact=True, border=2)
    except UnicodeEncodeError:
        # The terminal knows no block characters; the address stands above.
        return
