"""Running a program of SUMO in a process of its own, and the cache of what is made once for a net."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import platformdirs
import sumo


def run_program(
    name: str, options: Sequence[str], folder: str | Path, patience_s: float
) -> subprocess.CompletedProcess[str] | None:
    """Run a program of the installed SUMO in a folder to its end; None if it takes longer than `patience_s`."""
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    try:
        return subprocess.run(
            [str(Path(sumo.SUMO_HOME) / "bin" / name), *options],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=patience_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None


def cached_file(name: str, net_file: Path, key: object, write: Callable[[Path], None]) -> Path:
    """A file of the cache for the content of a net, a key and SUMO's version, which `write` makes if it is not there.

    `name` has the folder and the ending of the file: `tiles/.net.xml`.
    """
    version = importlib.metadata.version("eclipse-sumo")
    digest = hashlib.sha256(net_file.read_bytes() + repr((version, key)).encode()).hexdigest()[:24]
    folder, _, ending = name.partition("/")
    file = Path(platformdirs.user_cache_dir("harness")) / folder / f"{digest}{ending}"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as scratch:
            write(Path(scratch) / file.name)
            os.replace(Path(scratch) / file.name, file)
    return file
