"""The entry point of the command, which heeds requests to end before it imports what takes time."""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType

INTERRUPTED = "Interrupted."
CONTINUES = f"{INTERRUPTED} Finished work is kept: run the same command again to continue."
_CONTINUED = (["campaign"], ["demo"], ["league"])
_DELAYING = ("<frozen importlib", f"{os.sep}llvmlite{os.sep}")  # parts of file names: Python's import, the compiler
_AGAIN_S = 0.05


def main() -> None:
    """The `harness` command. Ctrl-C, SIGTERM and SIGHUP end it with one message on standard error, and with 128 plus
    the number of the signal as its exit code. A signal that is ignored, as by nohup, stays ignored.

    A signal that arrives during an import, or while a function is compiled, takes effect after it: modules make other
    errors of a KeyboardInterrupt, or ignore it.
    """
    received: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _delays(frame):
            again = threading.Timer(_AGAIN_S, os.kill, (os.getpid(), number))
            again.daemon = True
            again.start()
        else:
            received.append(number)
            raise KeyboardInterrupt

    try:
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, interrupt)
        from harness.cli.app import run

        run()
    except (KeyboardInterrupt, SystemExit):  # typer makes the one into the other
        if not received:
            raise
        print(CONTINUES if sys.argv[1:2] in _CONTINUED else INTERRUPTED, file=sys.stderr)
        sys.exit(128 + received[0])


def _delays(frame: FrameType | None) -> bool:
    """Whether a frame is that of an import or of the compiler, or of what one of them runs."""
    while frame is not None and not any(each in frame.f_code.co_filename for each in _DELAYING):
        frame = frame.f_back
    return frame is not None


if __name__ == "__main__":
    main()
