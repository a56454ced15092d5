"""A virtual screen for SUMO-GUI: an Xvfb process that runs as long as the screen is needed."""

from __future__ import annotations

import contextlib
import os
import select
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from harness.errors import HarnessError
from harness.traffic.gui import end_process

_STARTS_WITHIN_S = 30.0


def find_xvfb() -> Path | None:
    """The path of Xvfb, the X server without a screen; None if it is not installed."""
    found = shutil.which("Xvfb")
    return Path(found) if found else None


@contextlib.contextmanager
def virtual_screen(program: Path, size_px: tuple[int, int]) -> Iterator[str]:
    """The name of a new screen, such as ":1". Raises HarnessError with Xvfb's message if it can't start."""
    read, write = os.pipe()
    screen = f"{size_px[0]}x{size_px[1]}x24"
    # Xvfb chooses a free number and writes it when it is ready
    command = [str(program), "-displayfd", str(write), "-screen", "0", screen, "-nolisten", "tcp", "+extension", "GLX"]
    with tempfile.TemporaryFile() as log:
        try:
            server = subprocess.Popen(command, pass_fds=(write,), stdout=log, stderr=log)
        finally:
            os.close(write)
        try:
            ready, _, _ = select.select([read], [], [], _STARTS_WITHIN_S)
            number = os.read(read, 16).decode().strip() if ready else ""
            if not number:
                log.seek(0)
                raise HarnessError(f"{program} can't start: {log.read().decode(errors='replace').strip()}")
            yield f":{number}"
        finally:
            os.close(read)
            end_process(server)
