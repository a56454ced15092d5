"""The entry point of the command, which heeds requests to end before it imports what takes time."""

from __future__ import annotations

import signal
import sys
from typing import NoReturn

INTERRUPTED = "Interrupted."
CONTINUES = f"{INTERRUPTED} Finished work is kept: run the same command again to continue."
_CONTINUED = (["campaign"], ["demo"])


def main() -> None:
    """The `harness` command. Ctrl-C, SIGTERM and SIGHUP end it with one message on standard error, and with 128 plus
    the number of the signal as its exit code. A signal that is ignored, as by nohup, stays ignored."""
    received: list[int] = []

    def interrupt(number: int, frame: object) -> NoReturn:
        received.append(number)
        raise KeyboardInterrupt

    try:
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, interrupt)
        from harness.cli.app import run

        run()
    except BaseException as error:
        if not (received and _ends_by_request(error)):
            raise
        print(CONTINUES if sys.argv[1:2] in _CONTINUED else INTERRUPTED, file=sys.stderr)
        sys.exit(128 + received[0])


def _ends_by_request(error: BaseException | None) -> bool:
    """Whether an error is a KeyboardInterrupt or was made of one. typer makes SystemExit of it, and a module that is
    loaded can make any error of it: Python 3.11 makes RuntimeError where a class is defined. An error that occurs while
    the command ends is no such error."""
    return error is not None and (
        isinstance(error, (KeyboardInterrupt, SystemExit)) or _ends_by_request(error.__cause__)
    )


if __name__ == "__main__":
    main()
