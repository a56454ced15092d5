"""A screen of our own that nobody sees, for SUMO-GUI to draw on: Xvfb, started for the purpose and ended after it."""

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
    """The X server without a screen."""
    found = shutil.which("Xvfb")
    return Path(found) if found else None


@contextlib.contextmanager
def virtual_screen(program: Path, size_px: tuple[int, int]) -> Iterator[str]:
    """The name of a new screen, such as ":1". Raises HarnessError, with what Xvfb said, if it can't start."""
    read, write = os.pipe()
    screen = f"{size_px[0]}x{size_px[1]}x24"
    # Xvfb looks for a free number itself, and tells it when it is ready
    command = [str(program), "-displayfd", str(write), "-screen", "0", screen, "-nolisten", "tcp", "+extension", "GLX"]
    with tempfile.TemporaryFile() as said:
        try:
            server = subprocess.Popen(command, pass_fds=(write,), stdout=said, stderr=said)
        finally:
            os.close(write)
        try:
            ready, _, _ = select.select([read], [], [], _STARTS_WITHIN_S)
            number = os.read(read, 16).decode().strip() if ready else ""
            if not number:
                said.seek(0)
                raise HarnessError(f"{program} can't start: {said.read().decode(errors='replace').strip()}")
            yield f":{number}"
        finally:
            os.close(read)
            end_process(server)
