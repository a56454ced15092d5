"""CommonRoad's reactive planner, in the environment that the variable COMMONROAD names.

Tests of it have the mark `commonroad`; without the planner they are skipped, and with HARNESS_REQUIRE_COMMONROAD=1 they
fail.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest


def require_commonroad() -> str:
    """A PATH on which python3 is one that has the planner; skips the test where there is none."""
    environment = os.environ.get("COMMONROAD")
    first = [str(Path(environment, "bin").absolute())] if environment else []
    path = os.pathsep.join([*first, os.environ.get("PATH", os.defpath)])
    python = shutil.which("python3", path=path)
    if not python or subprocess.run([python, "-c", "import commonroad_rp"], stderr=subprocess.DEVNULL).returncode:
        what = "CommonRoad's reactive planner is not installed: name its environment by COMMONROAD=/path/to/venv"
        if os.environ.get("HARNESS_REQUIRE_COMMONROAD") == "1":
            pytest.fail(f"{what}, and HARNESS_REQUIRE_COMMONROAD=1 requires it")
        pytest.skip(what)
    return path
