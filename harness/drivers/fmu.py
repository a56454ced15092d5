"""A digital twin as a driver: a co-simulation FMU, run by `harness.drivers.fmu_program` in a process of its own.

An FMU is native code: what crashes or hangs in it costs a game and not the campaign, as with any program.

| of the FMU | what the harness gives or takes |
| --- | --- |
| inputs | entries of the observation, in the units that their names in `harness.game.observation.LAYOUT` say |
| outputs | acceleration_mps2 (m/s2) and steering_rad (road wheel angle, left positive) |
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from harness.config.driver import OUTPUTS, Fmu
from harness.config.toml_reading import nearest
from harness.drivers.car import Car
from harness.drivers.process import ProcessDriver
from harness.errors import Problem, UsageError
from harness.game.observation import LAYOUT

ENTRY_OF = {name.replace("@", "_"): name for name in LAYOUT} | {name: name for name in LAYOUT}
"""What the inputs of an FMU may be called, with the entry each is given: `@` is no letter of most tools."""
_REALS = ("Real", "Float64")
_UNITS = {"mps": {"m": 1, "s": -1}, "mps2": {"m": 1, "s": -2}, "m": {"m": 1}, "rad": {"rad": 1}}
_SI = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_TOP = Path(__file__).resolve().parents[2]


class Wiring(NamedTuple):
    """Which of an FMU's variables is what, by value reference."""

    inputs: list[tuple[int, int]]
    """With the number of the observation's entry."""
    outputs: list[int]
    start: list[tuple[int, float]]


def fmu_driver(document: Fmu, file: Path, car: Car) -> ProcessDriver:
    """The driver of an FMU. Raises UsageError as `wiring` does."""
    given = json.dumps({"file": str(file), "wiring": wiring(document, file), "step_s": car.step_s})
    command = [sys.executable, "-m", "harness.drivers.fmu_program", given]
    deadlines = document.deadline_s, document.start_deadline_s
    return ProcessDriver(command, _TOP, car, "si", *deadlines, name=file.name)


def wiring(document: Fmu, file: Path) -> Wiring:
    """What is connected to what. Raises UsageError with everything that is missing of the FMU, or doesn't fit."""
    try:
        import fmpy
    except ImportError:
        message, remedy = "FMUs need FMPy, which is not installed", "pip install 'harness[fmi]'"
        raise UsageError.of(file, "", message, remedy) from None
    try:
        description = fmpy.read_model_description(str(file))
        platforms = fmpy.supported_platforms(str(file))
    except Exception as error:  # fmpy raises what zipfile, lxml and its own checks do
        what = " ".join(f"can't be read as an FMU: {error}".split())
        raise UsageError.of(file, "", what, "export it again") from None
    problems = []
    if description.coSimulation is None or not str(description.fmiVersion).startswith(("2.", "3.")):
        kinds = ("coSimulation", "modelExchange", "scheduledExecution")
        has = ", ".join(kind for kind in kinds if getattr(description, kind, None) is not None) or "nothing"
        message = f"is an FMU of FMI {description.fmiVersion} for {has}"
        problems.append(Problem(str(file), "", message, "export it for co-simulation, FMI 2.0 or 3.0"))
    elif not {fmpy.platform, fmpy.platform_tuple} & {*platforms}:
        message = f"has no binary for {fmpy.platform_tuple}, only for {', '.join(platforms) or 'nothing'}"
        problems.append(Problem(str(file), "", message, "export it for this platform"))
    variables = {each.name: each for each in description.modelVariables}
    entries, asked = _inputs(document, variables), {name: document.outputs.get(name, name) for name in OUTPUTS}
    problems += _problems(document, file, variables, entries, asked, description)
    if problems:
        raise UsageError(problems)
    return Wiring(
        [(variables[name].valueReference, LAYOUT.index(entry)) for name, entry in entries.items()],
        [variables[name].valueReference for name in asked.values()],
        [(variables[name].valueReference, value) for name, value in document.start.items()],
    )


def _inputs(document: Fmu, variables: Mapping[str, Any]) -> dict[str, str]:
    """The entry that each input is given: as the document says, or as it is called."""
    named = [name for name, each in variables.items() if each.causality == "input" and name in ENTRY_OF]
    return {name: ENTRY_OF[name] for name in named if name not in document.start} | document.inputs


def _problems(
    document: Fmu,
    file: Path,
    variables: Mapping[str, Any],
    entries: Mapping[str, str],
    asked: Mapping[str, str],
    description: Any,
) -> list[Problem]:
    of = {kind: [name for name, each in variables.items() if each.causality == kind] for kind in ("input", "output")}
    found: list[tuple[str, str, str]] = []
    for kind, names in (("input", list(entries)), ("output", list(asked.values()))):
        for name in names:
            if name not in of[kind]:
                known = nearest(name, of[kind]) if of[kind] else f"it has no {kind}s"
                found.append((name, f"the FMU has no {kind} of this name", known))
    for name in of["input"]:
        if name not in entries and name not in document.start:
            close = nearest(name, ENTRY_OF) if ENTRY_OF else ""
            remedy = f"say under [inputs] what it is given, or under [start] what it is; as an entry {close}"
            found.append((name, "this input of the FMU is called like nothing that a driver sees", remedy))
    for name in document.start:
        if name not in variables or variables[name].causality not in ("parameter", "input"):
            tunable = [n for n, each in variables.items() if each.causality in ("parameter", "input")]
            found.append((name, "the FMU has no parameter or input of this name", nearest(name, tunable or ["(none)"])))
        elif name in document.inputs:
            found.append((name, "is under [start] and under [inputs]", "leave out one of them"))
    quantities = {**entries, **{name: output for output, name in asked.items()}}
    for name in {*quantities, *document.start} & variables.keys():
        if variables[name].type not in _REALS or variables[name].dimensions:
            found.append((name, f"is of type {variables[name].type}", "a single Real (FMI 2.0) or Float64 is needed"))
    for name, quantity in quantities.items():
        if name in variables and (wrong := _wrong_unit(variables[name], quantity, description)):
            found.append((name, wrong, "convert it in the FMU: the harness gives and takes SI units"))
    if not entries:
        found.append(("inputs", "the FMU would see nothing", "give it an input, such as speed_mps"))
    return [Problem(str(file), key, message, remedy) for key, message, remedy in found]


def _wrong_unit(variable: Any, quantity: str, description: Any) -> str:
    """What is wrong with a variable's unit, where it says what its unit is in SI units; empty: nothing."""
    declared = variable.unit or getattr(variable.declaredType, "unit", None)
    units = {each.name: each.baseUnit for each in description.unitDefinitions}
    known, expected = units.get(declared), _UNITS.get(quantity.split("@")[0].rsplit("_", 1)[-1])
    if known is None or expected is None:
        return ""
    exponents = {name: getattr(known, name) for name in _SI if getattr(known, name)}
    plain = exponents == expected or exponents == {k: v for k, v in expected.items() if k != "rad"}
    if plain and float(known.factor or 1.0) == 1.0 and not float(known.offset or 0.0):
        return ""
    return f"is in {declared}, and {quantity} is not"
