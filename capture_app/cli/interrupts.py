"""Ctrl-C and SIGTERM: how they end a command, whatever it is doing."""

import _thread
import signal
import sys
import threading
from types import FrameType

INTERRUPTED = 130
"""Exit code after SIGINT, as shells have it."""
TERMINATED = 143
"""Exit code after SIGTERM, as shells have it."""
_RAISED_BY: dict[type[BaseException], signal.Signals] = {
    KeyboardInterrupt: signal.SIGINT,
    SystemExit: signal.SIGTERM,
}
"""The signal that raises an exception."""
STOPPED = "Interrupted; nothing unfinished was left under its name."


def handle_signals() -> None:
    """Let SIGINT and SIGTERM unwind the main thread as exceptions do: what tidies up runs."""
    signal.signal(signal.SIGTERM, _terminate)
    signal.signal(signal.SIGINT, _interrupt)
    sys.unraisablehook = _swallowed


def was_interrupted() -> bool:
    """Whether Ctrl-C was pressed; a library that is just being imported may turn it into another error."""
    return bool(_interrupts)


_interrupts: list[int] = []


def _interrupt(number: int, frame: FrameType | None) -> None:
    _interrupts.append(number)
    raise KeyboardInterrupt


def _swallowed(problem: "sys.UnraisableHookArgs") -> None:
    """Send the signal again whose exception Python ignored, as it does in callbacks of compiled code."""
    again = _RAISED_BY.get(problem.exc_type)
    if again is None:
        sys.__unraisablehook__(problem)
    else:
        # From another thread, because in this one the callback has not ended yet.
        threading.Timer(0.05, _signal_main_thread, [again]).start()


def _signal_main_thread(number: signal.Signals) -> None:
    """Send a signal to the main thread; where the system can, one that wakes it."""
    if sys.platform == "win32":
        _thread.interrupt_main(number)
    elif (main_thread := threading.main_thread().ident) is not None:
        signal.pthread_kill(main_thread, number)


def _terminate(number: int, frame: FrameType | None) -> None:
    """Unwind as an error does, so that every block that tidies up is run."""
    raise SystemExit(TERMINATED)
