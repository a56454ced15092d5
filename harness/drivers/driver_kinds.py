"""What each kind of driver document is made into, and what it is called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.config.driver import DriverDocument, Fmu, Onnx, Process, Python, StableBaselines3, Sumo, TorchScript
from harness.config.rule_driver import Rules
from harness.drivers.car import Car
from harness.drivers.driver_files import resolve_in
from harness.drivers.entry_points import PackagedPlanner, entry_point, installed_driver
from harness.drivers.fmu import fmu_driver
from harness.drivers.network_driver import NetworkDriver
from harness.drivers.policy_file import LearnedDriver, read_policy
from harness.drivers.process import PlanningProcess, ProcessDriver
from harness.drivers.protocol import Driver
from harness.drivers.rules_driver import RulesDriver
from harness.drivers.sumo import SumoDriver


def driver_in_words(document: DriverDocument | None, written: str, package: Mapping[str, str]) -> str:
    """A description of a driver for reports; `document` is None for a policy's folder."""
    match document:
        case None:
            return f"the policy {written}"
        case Sumo(vehicle_type=name):
            return f"SUMO's own models of vehicle type {name} ({written})"
        case Rules(name=name):
            return f"the rules {name} ({written})"
        case Process(command=command):
            return f"the program {' '.join(command)} ({written})"
        case Fmu(file=file):
            return f"the FMU {file} ({written})"
        case StableBaselines3(file=file, algorithm=algorithm):
            return f"the {algorithm} policy {file} of Stable-Baselines3 ({written})"
        case Onnx(file=file):
            return f"the ONNX network {file} ({written})"
        case TorchScript(file=file):
            return f"the TorchScript module {file} ({written})"
        case Python(entry_point=name):
            return f"{name} of the package {package['package']} {package['version']}"


def make_driver(
    document: DriverDocument | None, place: Path, *, command: Sequence[str], car: Car, sampled: bool
) -> Driver:
    """Make a driver for a car. `place` is the folder that paths are relative to, or a policy's folder; `command` is a
    program's. Raises as `ExternalDriver.make` does."""
    match document:
        case None:
            return LearnedDriver(read_policy(place), sampled)
        case Sumo():
            return SumoDriver()
        case Rules():
            return RulesDriver(document, car)
        case Process(folder=folder, cartesian=cartesian):
            asked = {
                name: getattr(document, name) for name in ("units", "deadline_s", "start_deadline_s", "parameters")
            }
            arguments = (command, resolve_in(place, folder), car)
            if cartesian is None:
                return ProcessDriver(*arguments, **asked)
            return PlanningProcess(*arguments, **asked, history_s=cartesian.history_s)
        case Fmu(file=file):
            return fmu_driver(document, resolve_in(place, file), car)
        case StableBaselines3(file=file, normalize=normalize):
            from harness.drivers.sb3_policy import Sb3Driver  # torch is slow to import

            scaling = resolve_in(place, normalize) if normalize is not None else None
            return Sb3Driver(document, resolve_in(place, file), sampled, scaling)
        case Onnx(file=file) | TorchScript(file=file):
            return NetworkDriver(document, resolve_in(place, file), car)
        case Python(entry_point=name, parameters=parameters, cartesian=cartesian):
            point = entry_point(name, place, "entry_point")
            if cartesian is None:
                return installed_driver(point, car, parameters)
            return PackagedPlanner(installed_driver(point, car, parameters, plans=True), cartesian.history_s)
