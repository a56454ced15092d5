"""A co-simulation harness on Eclipse SUMO that tests an automated vehicle against selfish human drivers.

What a library user needs is exported here; each name is imported when it is first asked for, so that importing
`harness` alone costs nothing. Gymnasium knows `harness/Ego-v0` and `harness/NonEgo-v0` once both are imported.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harness.arena import Arena, Seat, Step
    from harness.documents.persona import Persona
    from harness.documents.reading import read_document
    from harness.drivers.learned import LearnedDriver
    from harness.drivers.protocol import Driver
    from harness.drivers.sumo import SumoDriver
    from harness.environments import DrivingEnv, ParallelDrivingEnv
    from harness.errors import HarnessError, SimulationError, UsageError
    from harness.policy_file import Policy, read_policy
    from harness.traffic.opening import OpenScene, open_scene
    from harness.vector_environment import ArenaVecEnv

__version__ = "0.1.0"

__all__ = [
    "Arena",
    "ArenaVecEnv",
    "Driver",
    "DrivingEnv",
    "HarnessError",
    "LearnedDriver",
    "OpenScene",
    "ParallelDrivingEnv",
    "Persona",
    "Policy",
    "Seat",
    "SimulationError",
    "Step",
    "SumoDriver",
    "UsageError",
    "open_scene",
    "read_document",
    "read_policy",
]

_HOMES = {
    "arena": ("Arena", "Seat", "Step"),
    "documents.persona": ("Persona",),
    "documents.reading": ("read_document",),
    "drivers.learned": ("LearnedDriver",),
    "drivers.protocol": ("Driver",),
    "drivers.sumo": ("SumoDriver",),
    "environments": ("DrivingEnv", "ParallelDrivingEnv"),
    "errors": ("HarnessError", "SimulationError", "UsageError"),
    "policy_file": ("Policy", "read_policy"),
    "traffic.opening": ("OpenScene", "open_scene"),
    "vector_environment": ("ArenaVecEnv",),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"harness.{home}"), name)
    raise AttributeError(f"module 'harness' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


# --- Gymnasium --------------------------------------------------------------------------------------------------------


def _register() -> None:
    from gymnasium.envs.registration import register, registry

    for name, player in (("harness/Ego-v0", "ego"), ("harness/NonEgo-v0", "non_ego")):
        if name not in registry:
            register(name, entry_point="harness.environments:DrivingEnv", kwargs={"player": player})


class _OnImport:
    """Registers the environments when Gymnasium is imported after us: importing it here would cost everyone 0.1 s."""

    looking = False

    def find_spec(self, name: str, path: object = None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name != "gymnasium" or self.looking:
            return None
        self.looking = True
        try:
            spec = importlib.util.find_spec(name)
        finally:
            self.looking = False
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


if "gymnasium" in sys.modules:
    _register()
else:
    sys.meta_path.insert(0, _OnImport())
