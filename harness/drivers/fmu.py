"""A digital twin as a driver: a co-simulation FMU, run by `harness.drivers.fmu_program` in a process of its own.

An FMU is native code. If it crashes or hangs, one game fails and the campaign continues, as with any program.

| variables of the FMU | connected to |
| --- | --- |
| inputs | entries of the observation, in the units of their names in `harness.game.observation_layout.LAYOUT` |
| outputs | acceleration_mps2 (m/s2) and steering_rad (road wheel angle, left positive) |
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from harness.config.driver import OUTPUTS, Fmu
from harness.config.toml_reading import nearest
from harness.drivers.car import Car
from harness.drivers.fmu_variables import ENTRY_TYPES, REALS, Value, value_for
from harness.drivers.process import ProcessDriver
from harness.errors import Problem, UsageError, name_like
from harness.game.observation_layout import LAYOUT
from harness.shipped_documents import PACKAGE

ENTRY_OF = {name.replace("@", "_"): name for name in LAYOUT} | {name: name for name in LAYOUT}
"""Possible names of an FMU's inputs, and the entry of each. Most tools do not allow `@` in a name: `_` replaces it."""
_NEEDED = {
    "input": (ENTRY_TYPES, "a number, a Boolean or an enumeration is needed; give a text under [start]"),
    "output": (("Real", "Float64"), "a single Real (FMI 2.0) or Float64 is needed"),
}
"""The types of inputs and outputs, and the remedy for another type."""
_MOST_SHOWN = 10  # problems, or names in a note
_UNITS = {"mps": {"m": 1, "s": -1}, "mps2": {"m": 1, "s": -2}, "m": {"m": 1}, "rad": {"rad": 1}}
_SI = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class Wiring(NamedTuple):
    """The connections of an FMU's variables, by value reference."""

    inputs: list[tuple[int, int, str]]
    """Value reference, the index of the entry in the observation, and the type."""
    outputs: list[int]
    start: list[tuple[int, Value, str]]
    """Value reference, value and type."""
    unconnected: list[str]
    """Inputs that keep the start value of the FMU."""


def fmu_driver(document: Fmu, file: Path, car: Car) -> ProcessDriver:
    """The driver of an FMU. Raises UsageError as `wiring` does."""
    spec = json.dumps({"file": str(file), "wiring": wiring(document, file), "step_s": car.step_s})
    return ProcessDriver(
        [sys.executable, "-m", "harness.drivers.fmu_program", spec],
        PACKAGE.parent,
        car,
        units="si",
        deadline_s=document.deadline_s,
        start_deadline_s=document.start_deadline_s,
        name=file.name,
    )


def wiring(document: Fmu, file: Path) -> Wiring:
    """The connections of an FMU. Raises UsageError with everything that is missing in the FMU or does not fit."""
    description = _description(file)
    variables = {each.name: each for each in description.modelVariables}
    inputs = [name for name, each in variables.items() if each.causality == "input"]
    entries = {name: ENTRY_OF[name] for name in inputs if name in ENTRY_OF and name not in document.start}
    entries |= document.inputs
    outputs = {document.outputs.get(name, name): name for name in OUTPUTS}
    problems = [
        Problem(str(file), *told)
        for told in (
            *_mistakes(variables, "input", entries, description),
            *_mistakes(variables, "output", outputs, description),
            *_mistakes_of_start(document, variables, [name for name in inputs if name not in entries]),
        )
    ]
    if not entries:
        remedy = "give it an input, such as speed_mps"
        problems.append(Problem(str(file), "inputs", "no input of the FMU is connected", remedy))
    if len(problems) > _MOST_SHOWN:
        more = f"{len(problems) - _MOST_SHOWN} more problems of this kind"
        problems[_MOST_SHOWN:] = [Problem(str(file), "", more, "correct these first")]
    if problems:
        raise UsageError(problems)
    return Wiring(
        [
            (variables[name].valueReference, LAYOUT.index(entry), variables[name].type)
            for name, entry in entries.items()
        ],
        [variables[document.outputs.get(name, name)].valueReference for name in OUTPUTS],
        [
            (variables[name].valueReference, value_for(variables[name], value), variables[name].type)
            for name, value in document.start.items()
        ],
        [name for name in inputs if name not in entries and name not in document.start],
    )


def unconnected_inputs(document: Fmu, file: Path) -> str:
    """The inputs of an FMU that keep their start values, in words; empty if there is none. Raises as `wiring`."""
    names = wiring(document, file).unconnected
    more = f" and {len(names) - _MOST_SHOWN} more" if len(names) > _MOST_SHOWN else ""
    return f"inputs of the FMU that keep their start values: {', '.join(names[:_MOST_SHOWN])}{more}" if names else ""


def _description(file: Path) -> Any:
    """The model description of a co-simulation FMU for this platform. Raises UsageError if it is not one."""
    try:
        import fmpy
    except ImportError:
        message, remedy = "FMUs need FMPy, which is not installed", "pip install 'safedriverl-harness[fmi]'"
        raise UsageError.of(file, "", message, remedy) from None
    try:
        description = fmpy.read_model_description(str(file))
        platforms = fmpy.supported_platforms(str(file))
    except Exception as error:  # fmpy raises the exceptions of zipfile, lxml and its own checks
        message = " ".join(f"can't be read as an FMU: {error}".split())
        raise UsageError.of(file, "", message, "export it again") from None
    if description.coSimulation is None or not str(description.fmiVersion).startswith(("2.", "3.")):
        kinds = ("coSimulation", "modelExchange", "scheduledExecution")
        has = ", ".join(kind for kind in kinds if getattr(description, kind, None) is not None) or "nothing"
        message = f"is an FMU of FMI {description.fmiVersion} for {has}"
        raise UsageError.of(file, "", message, "export it for co-simulation, FMI 2.0 or 3.0")
    if not {fmpy.platform, fmpy.platform_tuple} & {*platforms}:
        message = f"has no binary for {fmpy.platform_tuple}, only for {', '.join(platforms) or 'nothing'}"
        raise UsageError.of(file, "", message, "export it for this platform")
    return description


def _mistakes(
    variables: Mapping[str, Any], kind: str, quantities: Mapping[str, str], description: Any
) -> Iterator[tuple[str, str, str]]:
    """Key, message and remedy of each input or output in `quantities` that the FMU lacks or that does not fit its
    quantity."""
    of_kind = [name for name, each in variables.items() if each.causality == kind]
    types, needed = _NEEDED[kind]
    for name, quantity in quantities.items():
        if name not in of_kind:
            remedy = nearest(name, of_kind) if of_kind else f"it has no {kind}s"
            yield name, f"the FMU has no {kind} of this name", remedy
        elif variables[name].dimensions:
            yield name, "is an array", "connect variables with a single value"
        elif variables[name].type not in types:
            yield name, f"is of type {variables[name].type}", needed
        elif message := _unit_problem(variables[name], quantity, description):
            yield name, message, "convert it in the FMU: the harness uses SI units"


def _mistakes_of_start(
    document: Fmu, variables: Mapping[str, Any], without_entry: Sequence[str]
) -> Iterator[tuple[str, str, str]]:
    """Key, message and remedy of each value under [start] that is wrong, and of each input that needs one."""
    for name in without_entry:
        likely = name_like(name, ENTRY_OF)
        if name not in document.start and (variables[name].start is None or likely):
            told = f"; did you mean {likely!r}?" if likely else ""
            remedy = f"connect it under [inputs], or give it a value under [start]{told}"
            yield name, "this input of the FMU has no entry of the observation and no value", remedy
    settable = {name: each for name, each in variables.items() if each.causality in ("parameter", "input")}
    for name, written in document.start.items():
        if name not in settable:
            remedy = nearest(name, settable or ["(none)"])
            yield name, "the FMU has no parameter or input of this name", remedy
        elif name in document.inputs:
            yield name, "is under [start] and under [inputs]", "leave out one of them"
        elif settable[name].dimensions:
            yield name, "is an array", "only single values can be set"
        elif name in (document.tunable or {}) and settable[name].type not in REALS:
            yield name, f"is of type {settable[name].type}", "only Real variables can be tuned: see [tunable]"
        else:
            try:
                value_for(settable[name], written)
            except ValueError as error:
                yield name, f"the value {written!r} under [start] is not possible", f"it {error}"


def _unit_problem(variable: Any, quantity: str, description: Any) -> str:
    """The difference between the unit of a variable and that of its quantity; empty if there is none, or if the FMU
    does not define the unit by SI units."""
    declared = variable.unit or getattr(variable.declaredType, "unit", None)
    known = next((each.baseUnit for each in description.unitDefinitions if each.name == declared), None)
    expected = _UNITS.get(quantity.split("@")[0].rsplit("_", 1)[-1])
    if known is None or expected is None:
        return ""
    exponents = {name: getattr(known, name) for name in _SI if getattr(known, name)}
    matches = exponents == expected or (not exponents and "rad" in expected)
    if matches and float(known.factor or 1.0) == 1.0 and not float(known.offset or 0.0):
        return ""
    return f"its unit is {declared}, which is not the unit of {quantity}"
