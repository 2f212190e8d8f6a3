"""Entry point of the `omocap` command: it handles Ctrl-C and SIGTERM before large modules are imported."""

import sys

from capture_app.cli.interrupts import INTERRUPTED, STOPPED, handle_signals


def main() -> None:
    """Run the command line; whatever ends it, what was half written is removed first."""
    try:
        handle_signals()
        from capture_app.cli.app import run_command

        code = run_command()
    except KeyboardInterrupt:
        sys.stderr.write(f"{STOPPED}\n")
        code = INTERRUPTED
    raise SystemExit(code)
