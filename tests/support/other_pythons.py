"""Pythons that have what the harness's own has not: CommonRoad's reactive planner, or ROS 2.

The variables COMMONROAD and ROS2 name their environments; without them it is the python3 on PATH. Tests of them have
the marks `commonroad` and `ros2`; where it is not installed they are skipped, and with HARNESS_REQUIRE_COMMONROAD=1 or
HARNESS_REQUIRE_ROS2=1 they fail.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest


def require_commonroad() -> str:
    """A PATH on which python3 is one that has the planner; skips the test where there is none."""
    return _require("CommonRoad's reactive planner", "COMMONROAD", "import commonroad_rp")


def require_ros2() -> str:
    """A PATH on which python3 is one that has ROS 2 and its messages; skips the test where there is none."""
    return _require("ROS 2", "ROS2", "import rclpy, rosgraph_msgs.msg, nav_msgs.msg, visualization_msgs.msg")


def _require(name: str, variable: str, program: str) -> str:
    environment = os.environ.get(variable)
    first = [str(Path(environment, "bin").absolute())] if environment else []
    path = os.pathsep.join([*first, os.environ.get("PATH", os.defpath)])
    python = shutil.which("python3", path=path)
    if not python or subprocess.run([python, "-c", program], stderr=subprocess.DEVNULL).returncode:
        what = f"{name} is not installed: name its environment by {variable}=/path/to/venv"
        if os.environ.get(f"HARNESS_REQUIRE_{variable}") == "1":
            pytest.fail(f"{what}, and HARNESS_REQUIRE_{variable}=1 requires it")
        pytest.skip(what)
    return path
