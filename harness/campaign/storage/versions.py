"""The versions of the programs that make a run's numbers."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

from harness.files import write_atomically
from harness.version import __version__

_PACKAGES = (
    *("eclipse-sumo", "libsumo", "sumolib", "numpy", "scipy", "numba", "pandas", "torch"),
    *("stable-baselines3", "gymnasium", "pyarrow", "safetensors"),
)
_OF_NUMBERS = ("python", "platform", "harness", "libsumo", "numpy", "numba", "torch", "stable-baselines3")


_SOURCES = {".py", ".jinja", ".css", ".js"}


@cache
def digest_of_sources(*parts: str) -> str:
    """A digest of this program, or of these files and folders of it: a version number does not tell one state of a
    working copy from another."""
    top, digest = Path(__file__).parents[2], hashlib.sha256()
    found = {
        file for part in parts or ("",) for file in (top / part, *(top / part).rglob("*")) if file.suffix in _SOURCES
    }
    for file in sorted(found):
        name, content = file.relative_to(top).as_posix().encode(), file.read_bytes()
        digest.update(b"%d %s %d " % (len(name), name, len(content)) + content)
    return digest.hexdigest()


@cache
def versions() -> dict[str, str]:
    """The version of every program that a run uses, and the system it runs on."""
    system = " ".join((platform.system(), platform.machine(), *platform.libc_ver())).strip()
    found = {"python": platform.python_version(), "platform": system, "harness": __version__}
    return found | {name: _version(name) for name in _PACKAGES}


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:  # of the extra `training`
        return "not installed"


def versions_of_numbers() -> dict[str, str]:
    """The versions that a stage's numbers depend on: with others the numbers may differ."""
    return {name: versions()[name] for name in _OF_NUMBERS}


def versions_since(checkpoint: Path, also: Mapping[str, str] = MappingProxyType({})) -> list[dict[str, str]]:
    """The versions that make a training or search: several, if it continues what other versions started. They are
    stored beside its checkpoint."""
    file, now = checkpoint.with_name("versions.json"), {**versions_of_numbers(), **also}
    try:
        before = json.loads(file.read_text(encoding="utf-8")) if checkpoint.is_file() else []
    except (OSError, ValueError):
        before = []
    versions = [*before, now] if isinstance(before, list) and now not in before else before or [now]
    write_atomically(file, json.dumps(versions).encode())
    return versions
