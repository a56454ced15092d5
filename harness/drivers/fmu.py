"""A digital twin as a driver: a co-simulation FMU, run by `harness.drivers.fmu_program` in a process of its own.

An FMU is native code. If it crashes or hangs, one game fails and the campaign continues, as with any program.

| variables of the FMU | connected to |
| --- | --- |
| inputs | entries of the observation, in the units that their names in `harness.game.observation.LAYOUT` end with |
| outputs | acceleration_mps2 (m/s2) and steering_rad (road wheel angle, left positive) |
"""

from __future__ import annotations

import difflib
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from harness.config.driver import OUTPUTS, Fmu
from harness.config.toml_reading import nearest
from harness.drivers.car import Car
from harness.drivers.fmu_variables import ENTRY_TYPES, REALS, Value, value_for
from harness.drivers.process import ProcessDriver
from harness.errors import Problem, UsageError
from harness.game.observation_layout import LAYOUT

ENTRY_OF = {name.replace("@", "_"): name for name in LAYOUT} | {name: name for name in LAYOUT}
"""Possible names of an FMU's inputs, and the entry of each. Most tools do not allow `@` in a name: `_` replaces it."""
_OUTPUT_TYPES = ("Real", "Float64")
_ALIKE = 0.8
"""Likeness of two names from which one is taken for a misspelling of the other, as difflib measures it."""
_MOST_PROBLEMS = 10
_UNITS = {"mps": {"m": 1, "s": -1}, "mps2": {"m": 1, "s": -2}, "m": {"m": 1}, "rad": {"rad": 1}}
_SI = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_CHECKOUT = Path(__file__).resolve().parents[2]


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
        _CHECKOUT,
        car,
        units="si",
        deadline_s=document.deadline_s,
        start_deadline_s=document.start_deadline_s,
        name=file.name,
    )


def wiring(document: Fmu, file: Path) -> Wiring:
    """The connections of an FMU. Raises UsageError with everything that is missing in the FMU or does not fit."""
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
    problems = []
    if not {fmpy.platform, fmpy.platform_tuple} & {*platforms}:
        message = f"has no binary for {fmpy.platform_tuple}, only for {', '.join(platforms) or 'nothing'}"
        problems.append(Problem(str(file), "", message, "export it for this platform"))
    variables = {each.name: each for each in description.modelVariables}
    entries, outputs = _inputs(document, variables), {name: document.outputs.get(name, name) for name in OUTPUTS}
    problems += [
        Problem(str(file), key, message, remedy)
        for key, message, remedy in (
            *_missing(document, variables, entries, outputs),
            *_unsuitable(document, variables, entries=entries, outputs=outputs, description=description),
        )
    ]
    if problems:
        more = len(problems) - _MOST_PROBLEMS
        shown = problems[:_MOST_PROBLEMS] if more > 1 else problems
        others = [Problem(str(file), "", f"{more} more problems of this kind", "correct these first")] * (more > 1)
        raise UsageError([*shown, *others])
    connected = {*entries, *document.start}
    return Wiring(
        [
            (variables[name].valueReference, LAYOUT.index(entry), variables[name].type)
            for name, entry in entries.items()
        ],
        [variables[name].valueReference for name in outputs.values()],
        [
            (variables[name].valueReference, value_for(variables[name], value), variables[name].type)
            for name, value in document.start.items()
        ],
        [name for name, each in variables.items() if each.causality == "input" and name not in connected],
    )


def unconnected_inputs(document: Fmu, file: Path) -> str:
    """The inputs of an FMU that keep their start values, in words; empty if there is none. Raises as `wiring`."""
    names = wiring(document, file).unconnected
    if not names:
        return ""
    more = f" and {len(names) - _MOST_PROBLEMS} more" if len(names) > _MOST_PROBLEMS else ""
    return f"inputs of the FMU that keep their start values: {', '.join(names[:_MOST_PROBLEMS])}{more}"


def _inputs(document: Fmu, variables: Mapping[str, Any]) -> dict[str, str]:
    """The entry of each input: by the document, else by the name of the input."""
    named = [name for name, each in variables.items() if each.causality == "input" and name in ENTRY_OF]
    return {name: ENTRY_OF[name] for name in named if name not in document.start} | document.inputs


def _missing(
    document: Fmu, variables: Mapping[str, Any], entries: Mapping[str, str], outputs: Mapping[str, str]
) -> list[tuple[str, str, str]]:
    """Key, message and remedy of each variable that the FMU lacks, and of each input without a source."""
    names_of = {
        kind: [name for name, each in variables.items() if each.causality == kind] for kind in ("input", "output")
    }
    found: list[tuple[str, str, str]] = []
    for kind, names in (("input", list(entries)), ("output", list(outputs.values()))):
        for name in names:
            if name not in names_of[kind]:
                known = nearest(name, names_of[kind]) if names_of[kind] else f"it has no {kind}s"
                found.append((name, f"the FMU has no {kind} of this name", known))
    for name in names_of["input"]:
        if name not in entries and name not in document.start:
            likely = difflib.get_close_matches(name, ENTRY_OF, n=1, cutoff=_ALIKE)
            if variables[name].start is None or likely:
                told = f"; did you mean {likely[0]!r}?" if likely else ""
                remedy = f"connect it under [inputs], or give it a value under [start]{told}"
                found.append((name, "this input of the FMU has no entry of the observation and no value", remedy))
    for name in document.start:
        if name not in variables or variables[name].causality not in ("parameter", "input"):
            settable = [key for key, each in variables.items() if each.causality in ("parameter", "input")]
            found.append(
                (name, "the FMU has no parameter or input of this name", nearest(name, settable or ["(none)"]))
            )
        elif name in document.inputs:
            found.append((name, "is under [start] and under [inputs]", "leave out one of them"))
    if not entries:
        found.append(("inputs", "no input of the FMU is connected", "give it an input, such as speed_mps"))
    return found


def _unsuitable(
    document: Fmu,
    variables: Mapping[str, Any],
    *,
    entries: Mapping[str, str],
    outputs: Mapping[str, str],
    description: Any,
) -> list[tuple[str, str, str]]:
    """Key, message and remedy of each variable with another type or unit than its quantity."""
    found: list[tuple[str, str, str]] = []
    for names, types, needed in (
        (entries, ENTRY_TYPES, "a number, a Boolean or an enumeration is needed; give a text under [start]"),
        (list(outputs.values()), _OUTPUT_TYPES, "a single Real (FMI 2.0) or Float64 is needed"),
    ):
        for name in names:
            if name in variables and variables[name].dimensions:
                found.append((name, "is an array", "connect variables with a single value"))
            elif name in variables and variables[name].type not in types:
                found.append((name, f"is of type {variables[name].type}", needed))
    for name in document.start.keys() & variables.keys():
        found += [(name, *mistake) for mistake in _mistakes_of_start(document, name, variables[name])]
    quantities = {**entries, **{name: output for output, name in outputs.items()}}
    for name, quantity in quantities.items():
        if name in variables and (message := _unit_problem(variables[name], quantity, description)):
            found.append((name, message, "convert it in the FMU: the harness uses SI units"))
    return found


def _mistakes_of_start(document: Fmu, name: str, variable: Any) -> Iterator[tuple[str, str]]:
    """Message and remedy of what is wrong with a value under [start]."""
    if variable.dimensions:
        yield "is an array", "only single values can be set"
        return
    try:
        value_for(variable, document.start[name])
    except ValueError as error:
        yield f"the value {document.start[name]!r} under [start] is not possible", f"it {error}"
    if name in (document.tunable or {}) and variable.type not in REALS:
        yield f"is of type {variable.type}", "only Real variables can be tuned: leave it out under [tunable]"


def _unit_problem(variable: Any, quantity: str, description: Any) -> str:
    """The difference between the unit of a variable and that of its quantity; empty if there is none, or if the FMU
    does not define the unit by SI units."""
    declared = variable.unit or getattr(variable.declaredType, "unit", None)
    units = {each.name: each.baseUnit for each in description.unitDefinitions}
    known, expected = units.get(declared), _UNITS.get(quantity.split("@")[0].rsplit("_", 1)[-1])
    if known is None or expected is None:
        return ""
    exponents = {name: getattr(known, name) for name in _SI if getattr(known, name)}
    matches = exponents == expected or exponents == {k: v for k, v in expected.items() if k != "rad"}
    if matches and float(known.factor or 1.0) == 1.0 and not float(known.offset or 0.0):
        return ""
    return f"its unit is {declared}, which is not the unit of {quantity}"
