"""The versions of the programs that make a run's numbers."""

from __future__ import annotations

import importlib.metadata
import platform
from functools import cache

from harness.version import __version__

_PACKAGES = (
    *("eclipse-sumo", "libsumo", "sumolib", "numpy", "scipy", "numba", "pandas", "torch"),
    *("stable-baselines3", "gymnasium", "pyarrow", "safetensors"),
)
_OF_NUMBERS = ("python", "platform", "harness", "libsumo", "numpy", "numba", "torch", "stable-baselines3")


@cache
def versions() -> dict[str, str]:
    """The version of every program that a run uses, and the system it runs on."""
    system = " ".join((platform.system(), platform.machine(), *platform.libc_ver())).strip()
    found = {"python": platform.python_version(), "platform": system, "harness": __version__}
    return found | {name: importlib.metadata.version(name) for name in _PACKAGES}


def versions_of_numbers() -> dict[str, str]:
    """The versions that a stage's numbers depend on: with others the numbers may differ."""
    return {name: versions()[name] for name in _OF_NUMBERS}
