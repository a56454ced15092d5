"""The results on disk: every figure by its key, the machine, the versions, and the raw numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.figures import KEYS
from harness.files import write_atomically

RESULTS = Path(__file__).resolve().parent / "results.json"


def empty(machine: Mapping[str, Any], versions: Mapping[str, str], fast: bool) -> dict[str, Any]:
    """Results without any figure: a figure that was not measured is null."""
    return {
        "machine": dict(machine),
        "versions": dict(versions),
        **dict.fromkeys(KEYS),
        "details": {"fast": fast, "load_before": {}},
    }


def results_to_extend(
    file: Path, machine: Mapping[str, Any], versions: Mapping[str, str], fast: bool
) -> dict[str, Any]:
    """The results in the file if they are of the same machine, versions and budget, otherwise empty results."""
    fresh = empty(machine, versions, fast)
    try:
        found = read(file)
        same = all(found[key] == fresh[key] for key in ("machine", "versions")) and found["details"]["fast"] == fast
    except (OSError, ValueError, KeyError, TypeError):
        return fresh
    return {**fresh, **{key: found.get(key) for key in (*KEYS, "details")}} if same else fresh


def read(file: Path) -> dict[str, Any]:
    """Read results. Raises OSError if the file can't be read and ValueError if it holds no results."""
    found = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        raise ValueError("no results")
    return found


def write(file: Path, results: Mapping[str, Any]) -> None:
    """Replace the results."""
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, (json.dumps(results, indent=1) + "\n").encode())
