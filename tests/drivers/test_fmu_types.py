"""Variables of every type in FMUs of FMI 3.0, and the Reference-FMUs of the Modelica Association.

The Reference-FMUs are in no package and are not part of this repository. Where REFERENCE_FMUS names the folder of an
unpacked release (https://github.com/modelica/Reference-FMUs/releases), they are tested; elsewhere these tests are
skipped. The first tests build FMUs with the same types of variables from the example's source.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.config.driver import Fmu
from harness.drivers.car import Car
from harness.drivers.fmu import fmu_driver, unconnected_inputs, wiring
from harness.drivers.fmu_variables import INTEGERS
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT, SIZE
from harness.road.scene.open_scene import OpenScene
from tests.support.external_drivers import fmu_example
from tests.support.rollouts import arm, play

NUMBERS = ("Float32", *INTEGERS[1:], "Boolean")
SPEED, GAP = "speed_mps", "time_gap_s"
PLAIN = {
    SPEED: f'<Float64 name="{SPEED}" valueReference="0" causality="input" variability="continuous" unit="m/s" '
    'start="0.0"/>',
    GAP: f'<Float64 name="{GAP}" valueReference="10" causality="parameter" variability="fixed" unit="s" start="1.5"/>',
}
"""How the example declares the input and the parameter that these tests give other types."""
MODE = (
    '<TypeDefinitions><EnumerationType name="Mode"><Item name="short" value="1"/><Item name="long" value="3"/>'
    "</EnumerationType></TypeDefinitions><ModelVariables>"
)
SETTERS = """
#include <string.h>
#define TYPED(type, number) UNUSED(fmi3Get##type) \\
    EXPORT fmi3Status fmi3Set##type(fmi3Instance twin, const fmi3ValueReference refs[], size_t count, \\
                                    const fmi3##type values[], size_t value_count) { \\
        for (size_t k = 0; k < count; k++) ((Twin *)twin)->value[refs[k]] = number(values[k]); \\
        return fmi3OK; \\
    }
TYPED(Float32, ) TYPED(Int8, ) TYPED(UInt8, ) TYPED(Int16, ) TYPED(UInt16, ) TYPED(Int32, ) TYPED(UInt32, )
TYPED(Int64, ) TYPED(UInt64, ) TYPED(Boolean, ) TYPED(String, strlen) PAIR(Binary)
"""


@pytest.fixture(scope="module")
def typed_twin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example with functions that set variables of every type; of a text, they take its length."""
    source = fmu_example().SOURCE.read_text(encoding="utf-8")
    first, last = source.index("PAIR(Float32)"), source.index("PAIR(Clock)")
    folder = tmp_path_factory.mktemp("typed")
    return Path(fmu_example().build(folder / "typed.fmu", 3, source[:first] + SETTERS + source[last:]))


def declared(typed_twin: Path, folder: Path, types: Mapping[str, str], extra: str = "") -> Path:
    """The FMU with other types of variables in its description, and more variables."""
    with zipfile.ZipFile(typed_twin) as whole, zipfile.ZipFile(folder / "twin.fmu", "w") as written:
        for name in whole.namelist():
            content = whole.read(name)
            if name == "modelDescription.xml":
                text = content.decode().replace("<ModelVariables>", MODE)
                for variable, kind in types.items():
                    assert PLAIN[variable] in text
                    text = text.replace(PLAIN[variable], as_type(PLAIN[variable], kind))
                content = text.replace("</ModelVariables>", f"{extra}</ModelVariables>").encode()
            written.writestr(name, content)
    return folder / "twin.fmu"


def as_type(element: str, kind: str) -> str:
    """A variable's declaration with another type."""
    reference = ' declaredType="Mode"' if kind == "Enumeration" else ""
    start = {"Boolean": "false", "Enumeration": "1"}.get(kind, "0")
    head = element.split(" unit=")[0].replace("<Float64", f"<{kind}")
    if kind != "Float32":
        head = head.replace('variability="continuous"', 'variability="discrete"')
    return f'{head}><Start value=""/></String>' if kind == "String" else f'{head}{reference} start="{start}"/>'


def document(**keys: Any) -> Fmu:
    return Fmu.model_validate({"kind": "fmu", "file": "twin.fmu", **keys})


def behind_a_car(car: Car, speed_mps: float) -> np.ndarray:
    """An observation [1, D] of a car 30 m ahead that is as fast."""
    view = np.zeros((1, SIZE), dtype=np.float32)
    view[0, LAYOUT.index(SPEED)] = speed_mps / 30.0
    view[0, LAYOUT.index("speed_over_limit")] = -0.5
    view[0, LAYOUT.index("other0_seen")] = 1.0
    view[0, LAYOUT.index("other0_ahead_m")] = 30.0 / 50.0  # compressed: 30 / (30 + 20)
    assert car.physical(view)[0, LAYOUT.index("other0_ahead_m")] == pytest.approx(30.0, abs=1e-4)
    return view


def first_action(driver: Any, view: np.ndarray) -> np.ndarray:
    driver.reset(np.arange(1))
    return np.asarray(driver.decide(np.arange(1), view, np.zeros((1, 2))))


def expected(car: Car, view: np.ndarray, speed_mps: float, time_gap_s: float) -> np.ndarray:
    """The first action of twin.c 30 m behind a car: a third of the wanted acceleration."""
    ahead_m = car.physical(view)[0, LAYOUT.index("other0_ahead_m")]
    wanted = min(2.0, 0.3 * (ahead_m - 4.6 - 2.0 - time_gap_s * speed_mps))
    return car.actions(np.array([max(wanted, -8.0) / 3.0]), np.zeros(1), view)


@pytest.mark.parametrize("kind", NUMBERS)
def test_fmi3__inputs_and_parameters_may_be_of_this_type(kind: str, typed_twin: Path, tmp_path: Path, car: Car) -> None:
    file = declared(typed_twin, tmp_path, {SPEED: kind, GAP: kind})
    time_gap_s = True if kind == "Boolean" else 2
    view = behind_a_car(car, 12.6)
    seen_mps = {"Boolean": 1.0, "Float32": car.physical(view)[0, LAYOUT.index(SPEED)]}.get(kind, 13.0)
    action = first_action(fmu_driver(document(start={GAP: time_gap_s}), file, car), view)
    np.testing.assert_allclose(action, expected(car, view, seen_mps, float(time_gap_s)), atol=1e-6)


@pytest.mark.parametrize(("kind", "value", "time_gap_s"), [("Enumeration", "long", 3.0), ("String", "four", 4.0)])
def test_fmi3__parameters_may_be_texts_and_items(
    kind: str, value: str, time_gap_s: float, typed_twin: Path, tmp_path: Path, car: Car
) -> None:
    file = declared(typed_twin, tmp_path, {GAP: kind})
    view = behind_a_car(car, 12.0)
    action = first_action(fmu_driver(document(start={GAP: value}), file, car), view)
    np.testing.assert_allclose(action, expected(car, view, 12.0, time_gap_s), atol=1e-6)


def test_fmi3__an_input_of_binary_data_keeps_its_start_value(typed_twin: Path, tmp_path: Path) -> None:
    raw = '<Binary name="raw" valueReference="13" causality="input"><Start value="666f6f"/></Binary>'
    file = declared(typed_twin, tmp_path, {}, raw)
    assert unconnected_inputs(document(), file) == "inputs of the FMU that keep their start values: raw"
    with pytest.raises(UsageError, match="raw: is of type Binary"):
        wiring(document(inputs={"raw": "goal_m"}), file)


# --- the Reference-FMUs of the Modelica Association -------------------------------------------------------------------

REAL = {"Float64_continuous_input": "speed_over_limit", "Float64_discrete_input": "road_steering_rad"}
OTHERS = {"Int32_input": "goal_m", "Boolean_input": "other0_seen"}
OF_FMI_3 = {
    "Float32_continuous_input": "path_left_m",
    **{f"{sign}Int{bits}_input": SPEED for sign in ("", "U") for bits in (8, 16, 64)},
}
FEEDTHROUGH = {
    "outputs": {"acceleration_mps2": "Float64_continuous_output", "steering_rad": "Float64_discrete_output"},
    "start": {"String_input": "wet", "Enumeration_input": "Option 2", "Float64_fixed_parameter": 1.5},
}


def reference_fmu(version: str, name: str) -> Path:
    """A Reference-FMU; skips the test where REFERENCE_FMUS names no folder with it."""
    found = [*Path(os.environ.get("REFERENCE_FMUS", "/nonexistent")).glob(f"{version}*/{name}.fmu")]
    if not found:
        pytest.skip("the Reference-FMUs are not here: name the folder of a release by REFERENCE_FMUS")
    return found[0]


@pytest.mark.parametrize("version", ["2", "3"])
def test_reference_fmus__what_goes_in_comes_out(version: str, merge: OpenScene, car: Car) -> None:
    """Feedthrough has inputs of every type, and an output for each: here they hold the limit and follow the route."""
    file = reference_fmu(version, "Feedthrough")
    inputs = REAL | OTHERS | (OF_FMI_3 if version == "3" else {})
    driver = fmu_driver(document(inputs=inputs, **FEEDTHROUGH), file, car)
    view = behind_a_car(car, 12.0)
    wanted = car.physical(view)[:, LAYOUT.index("speed_over_limit")]
    np.testing.assert_allclose(first_action(driver, view), car.actions(wanted, np.zeros(1), view), atol=1e-6)
    games = play(arm(merge, driver, None))
    assert [(game.record["error"], game.record["ego_outcome"]) for game in games] == [("", "goal")] * 3


def test_reference_fmus__arrays_are_refused() -> None:
    outputs = {"acceleration_mps2": "y", "steering_rad": "y"}
    with pytest.raises(UsageError, match="u: is an array"):
        wiring(document(inputs={"u": SPEED}, outputs=outputs), reference_fmu("3", "StateSpace"))
