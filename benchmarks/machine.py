"""The machine that the figures were measured on, and the versions of the packages."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from pathlib import Path
from typing import Any

from harness.campaign.execution.worker_pool import cores

_PACKAGES = {
    "harness": "harness",
    "sumo": "eclipse-sumo",
    "libsumo": "libsumo",
    "numpy": "numpy",
    "numba": "numba",
    "torch": "torch",
    "sb3": "stable-baselines3",
    "gymnasium": "gymnasium",
    "highway-env": "highway-env",
}


def machine() -> dict[str, Any]:
    """CPU model, cores, memory, operating system."""
    return {"cpu": _cpu(), "cores": cores(), "ram_gb": _ram_gb(), "os": _system()}


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that the figures depend on."""
    found = {"python": platform.python_version()}
    for name, package in _PACKAGES.items():
        try:
            found[name] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _cpu() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _ram_gb() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1)
    except (ValueError, OSError, AttributeError):
        return None


def _system() -> str:
    try:
        release = platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError, AttributeError):
        release = ""
    kernel = f"{platform.system()} {platform.machine()}"
    return f"{release} ({kernel})" if release else f"{kernel} {platform.release()}"
