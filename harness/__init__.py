"""A co-simulation harness on Eclipse SUMO that tests an automated vehicle against selfish human drivers.

This module exports the public names of the library. Each is imported at its first use: `import harness` stays fast.
`gymnasium.make("harness:harness/Ego-v0")` imports it, which registers the environments: see `harness.environments`.
"""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

from harness.version import __version__ as __version__

if TYPE_CHECKING:
    from harness.config.persona import Persona as Persona
    from harness.config.toml_reading import read_document as read_document
    from harness.drivers.policy_file import LearnedDriver as LearnedDriver
    from harness.drivers.policy_file import Policy as Policy
    from harness.drivers.policy_file import read_policy as read_policy
    from harness.drivers.protocol import Driver as Driver
    from harness.drivers.sumo import SumoDriver as SumoDriver
    from harness.environments.arena import Arena as Arena
    from harness.environments.arena import Seat as Seat
    from harness.environments.arena import Step as Step
    from harness.environments.gymnasium_env import DrivingEnv as DrivingEnv
    from harness.environments.gymnasium_env import ParallelDrivingEnv as ParallelDrivingEnv
    from harness.environments.gymnasium_vector import VectorDrivingEnv as VectorDrivingEnv
    from harness.environments.gymnasium_vector import make_vec as make_vec
    from harness.environments.vector_env import ArenaVecEnv as ArenaVecEnv
    from harness.errors import HarnessError as HarnessError
    from harness.errors import SimulationError as SimulationError
    from harness.errors import UsageError as UsageError
    from harness.game.outcome import Outcome as Outcome
    from harness.library import Results as Results
    from harness.library import load as load
    from harness.library import run as run
    from harness.road.scene.open_scene import OpenScene as OpenScene
    from harness.road.scene.open_scene import open_scene as open_scene

_MODULES = {
    "config.persona": ("Persona",),
    "config.toml_reading": ("read_document",),
    "drivers.policy_file": ("LearnedDriver", "Policy", "read_policy"),
    "drivers.protocol": ("Driver",),
    "drivers.sumo": ("SumoDriver",),
    "environments.arena": ("Arena", "Seat", "Step"),
    "environments.gymnasium_env": ("DrivingEnv", "ParallelDrivingEnv"),
    "environments.gymnasium_vector": ("VectorDrivingEnv", "make_vec"),
    "environments.vector_env": ("ArenaVecEnv",),
    "errors": ("HarnessError", "SimulationError", "UsageError"),
    "game.outcome": ("Outcome",),
    "library": ("Results", "load", "run"),
    "road.scene.open_scene": ("OpenScene", "open_scene"),
}
__all__ = sorted(name for names in _MODULES.values() for name in names)


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(importlib.import_module(f"harness.{module}"), name)
    raise AttributeError(f"module 'harness' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if "gymnasium" in sys.modules:  # importing Gymnasium takes 0.15 s
    importlib.import_module("harness.environments")
