"""FMUs as drivers, built from C for FMI 2.0 and 3.0; an FMU that does not fit is an error before it runs.

The Reference-FMUs of the Modelica Association are in no package and are not part of this repository. Where
REFERENCE_FMUS names the folder of an unpacked release (https://github.com/modelica/Reference-FMUs/releases), they are
tested; elsewhere these tests are skipped.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from pythonfmu import FmuBuilder

from harness.config.driver import Fmu
from harness.drivers.car import Car
from harness.drivers.fmu import fmu_driver, unconnected_inputs, wiring
from harness.drivers.fmu_variables import INTEGERS
from harness.errors import DriverError, UsageError
from harness.game.observation_layout import LAYOUT, SIZE
from harness.road.scene.open_scene import OpenScene
from tests.support.external_drivers import fmu_example
from tests.support.rollouts import arm, play

GAMES = np.arange(3)


@pytest.fixture(scope="module")
def twins(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """The example, built for both versions of the standard."""
    folder = tmp_path_factory.mktemp("twins")
    return {fmi: fmu_example().build(folder / f"twin{fmi}.fmu", fmi) for fmi in (2, 3)}


def document(**keys: Any) -> Fmu:
    return Fmu.model_validate({"kind": "fmu", "file": "twin.fmu", **keys})


def changed(folder: Path, *replacements: tuple[str, str]) -> Path:
    """The example with another model description and an empty binary: nothing is run."""
    text = fmu_example().description(2)
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    with zipfile.ZipFile(folder / "changed.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.writestr(f"binaries/{fmpy.platform}/twin.so", b"")
    return folder / "changed.fmu"


def problems(document: Fmu, file: Path) -> str:
    with pytest.raises(UsageError) as caught:
        wiring(document, file)
    return str(caught.value)


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu__drives_to_the_goal(fmi: int, twins: dict[int, Path], merge: OpenScene, car: Car) -> None:
    games = play(arm(merge, fmu_driver(document(), twins[fmi], car), None))
    assert [(game.record["error"], game.record["ego_outcome"]) for game in games] == [("", "goal")] * 3


def expected(values: np.ndarray, before: np.ndarray, time_gap_s: float) -> tuple[np.ndarray, np.ndarray]:
    """The outputs of twin.c; its state is the acceleration of the step before."""
    at = {name: values[:, k] for k, name in enumerate(LAYOUT)}
    wanted = np.clip(-8.0 * at["speed_over_limit"], -3.0, 2.0)
    gap = at["other0_ahead_m"] - 4.6
    following = 0.3 * (gap - 2.0 - time_gap_s * at["speed_mps"]) + 0.9 * at["other0_ahead_mps"]
    in_the_way = (at["other0_seen"] > 0.5) & (at["other0_ahead_m"] > 0.0) & (np.abs(at["other0_left_m"]) < 2.2)
    wanted = np.maximum(np.where(in_the_way, np.minimum(wanted, following), wanted), -8.0)
    steering = 0.5 * at["path_turned_rad@5m"] + 0.5 * np.arctan2(at["path_left_m"], 4.0 + at["speed_mps"])
    return before + (wanted - before) / 3.0, steering


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu__has_si_units_and_a_state_per_game_which_reset_discards(
    fmi: int, twins: dict[int, Path], car: Car
) -> None:
    driver = fmu_driver(document(start={"time_gap_s": 1.8}), twins[fmi], car)
    random, before = np.random.default_rng(1), np.zeros(3)
    driver.reset(GAMES)
    for step in range(6):
        if step == 4:
            driver.reset(GAMES[1:2])
            before[1] = 0.0
        view = random.uniform(-0.9, 0.9, (3, SIZE)).astype(np.float32)
        view[:, LAYOUT.index("other0_seen")] = [0.0, 1.0, 1.0]
        before, steering = expected(car.physical(view), before, 1.8)
        actions = driver.decide(GAMES, view, np.zeros((3, 2)))
        np.testing.assert_allclose(actions, car.actions(before, steering, view), atol=1e-9)


def test_fmu__may_have_other_names_of_inputs_and_outputs(twins: dict[int, Path], tmp_path: Path, car: Car) -> None:
    names = ("path_left_m", "y_lane"), ("steering_rad", "delta")
    file = changed(tmp_path, *((f'name="{old}"', f'name="{new}"') for old, new in names))
    mine = document(inputs={"y_lane": "path_left_m"}, outputs={"steering_rad": "delta"})
    found, plain = wiring(mine, file), wiring(document(), twins[2])
    assert (sorted(found.inputs), found.outputs) == (sorted(plain.inputs), plain.outputs)


GAP = '"fixed"><Real unit="s" start="1.5"/>'
LEFT, STEERING = '"continuous"><Real unit="m" start="0.0"/>', '"continuous"><Real unit="rad"/>'
INTEGER, TEXT = '"fixed"><Integer start="1"/>', '"fixed"><String start="a"/>'
TUNED = {"start": {"time_gap_s": 2}, "tunable": {"time_gap_s": [1.0, 3.0]}}
MISFITS: list[tuple[str, str, dict[str, Any], str]] = [
    ('name="steering_rad"', 'name="delta"', {}, "steering_rad: the FMU has no output of this name"),
    ('name="steering_rad"', 'name="steer_rad"', {}, "did you mean 'steer_rad'?"),
    ('name="path_left_m"', 'name="path_lft_m"', {}, "did you mean 'path_left_m'?"),
    ("", "", {"inputs": {"y": "path_left_m"}}, "y: the FMU has no input of this name"),
    ("", "", {"start": {"time_gap": 2.0}}, "time_gap: the FMU has no parameter or input of this name"),
    ("", "", {"start": {"speed_mps": 2.0}, "inputs": {"speed_mps": "goal_m"}}, "leave out one of them"),
    ("", "", {"start": {"time_gap_s": "long"}}, "time_gap_s: the value 'long' under [start] is not possible (it takes"),
    ("", "", {"start": {"time_gap_s": True}}, "it takes a number, because it is of type Real"),
    (GAP, TEXT, {"start": {"time_gap_s": 1.0}}, "takes a text"),
    (GAP, INTEGER, {"start": {"time_gap_s": 1.5}}, "an integer"),
    (GAP, INTEGER, TUNED, "only Real variables can be tuned"),
    (LEFT, '"discrete"><String start="a"/>', {}, "give a text under [start]"),
    (STEERING, '"discrete"><Integer/>', {}, "steering_rad: is of type Integer"),
    ('m="1" s="-1"', 'm="1" s="-1" factor="0.2777"', {}, "speed_mps: its unit is m/s, which is not the unit of"),
    ('unit="m" start', 'unit="s" start', {}, "path_left_m: its unit is s, which is not the unit of path_left_m"),
    ('fmiVersion="2.0"', 'fmiVersion="1.9"', {}, "can't be read as an FMU"),
    ("<CoSimulation ", "<ModelExchange ", {}, "is an FMU of FMI 2.0 for modelExchange"),
]


@pytest.mark.parametrize(("old", "new", "keys", "message"), MISFITS)
def test_fmu__a_variable_that_is_missing_or_does_not_fit_is_an_error(
    old: str, new: str, keys: dict[str, Any], message: str, tmp_path: Path
) -> None:
    extra = (' canHandleVariableCommunicationStepSize="true"', "") if "Exchange" in new else ("", "")
    assert message in problems(document(**keys), changed(tmp_path, extra, (old, new)))


def test_fmu__an_input_without_an_entry_keeps_its_start_value(tmp_path: Path) -> None:
    file = changed(tmp_path, ('name="path_left_m"', 'name="y_lane"'))
    assert unconnected_inputs(document(), file) == "inputs of the FMU that keep their start values: y_lane"
    assert unconnected_inputs(document(start={"y_lane": 0.0}), file) == ""


def test_fmu__for_another_platform_or_none_is_refused(twins: dict[int, Path], tmp_path: Path) -> None:
    with zipfile.ZipFile(twins[2]) as whole, zipfile.ZipFile(tmp_path / "win.fmu", "w") as other:
        other.writestr("modelDescription.xml", whole.read("modelDescription.xml"))
        other.writestr("binaries/win64/twin.dll", b"")
    assert "has no binary for" in problems(document(), tmp_path / "win.fmu")
    (tmp_path / "no.fmu").write_bytes(b"PK\x03\x04")
    assert "can't be read as an FMU" in problems(document(), tmp_path / "no.fmu")


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("abort();", "was killed by SIGABRT"),
        ("*(volatile int *)0 = 1;", "was killed by SIGSEGV"),
        ("for (volatile int on = 1; on;) {}", "did not answer within 0.5 s"),
        ("twin->value[STEERING] = NAN;", "is not finite"),
    ],
)
def test_fmu__a_failure_of_native_code_is_an_error_and_the_next_game_is_played(
    fault: str, message: str, tmp_path: Path, car: Car
) -> None:
    build = fmu_example()
    end = "v[STEERING] = 0.5 * v[TURNED] + 0.5 * atan2(v[LEFT], 4.0 + v[SPEED]);"
    source = build.SOURCE.read_text()
    assert end in source
    file = build.build(
        tmp_path / "faulty.fmu", 3, source.replace(end, f"{end}\n    if (v[SPEED] > 10.0) {{ {fault} }}")
    )
    driver = fmu_driver(document(deadline_s=0.5), file, car)
    view = np.zeros((1, SIZE), dtype=np.float32)
    driver.reset(GAMES[:1])
    driver.decide(GAMES[:1], view, np.zeros((1, 2)))
    view[0, LAYOUT.index("speed_mps")] = 0.5
    with pytest.raises(DriverError, match=message):
        driver.decide(GAMES[:1], view, np.zeros((1, 2)))
    driver.reset(GAMES[:1])
    assert driver.decide(GAMES[:1], 0.0 * view, np.zeros((1, 2))).shape == (1, 2)


def test_fmu__a_single_instance_fmu_plays_one_game_at_a_time(tmp_path: Path, car: Car, twins: dict[int, Path]) -> None:
    with zipfile.ZipFile(twins[2]) as whole, zipfile.ZipFile(tmp_path / "single.fmu", "w") as single:
        for name in whole.namelist():
            content = whole.read(name)
            once = b'<CoSimulation canBeInstantiatedOnlyOncePerProcess="true" '
            single.writestr(name, content.replace(b"<CoSimulation ", once) if name.endswith(".xml") else content)
    driver = fmu_driver(document(), tmp_path / "single.fmu", car)
    for _ in range(2):  # one after the other works
        driver.reset(GAMES[:1])
        driver.decide(GAMES[:1], np.zeros((1, SIZE), dtype=np.float32), np.zeros((1, 2)))
    with pytest.raises(DriverError, match=r"one game at a time only: give the campaign training\.games = 1"):
        driver.reset(GAMES)


ENUMERATED = """<TypeDefinitions><SimpleType name="Mode"><Enumeration>
<Item name="eco" value="1"/><Item name="sport" value="3"/></Enumeration></SimpleType>
</TypeDefinitions><ModelVariables>"""


@pytest.mark.parametrize(("written", "value"), [("sport", 3), (1, 1)])
def test_fmu__an_enumeration_takes_the_name_or_number_of_an_item(
    written: str | int, value: int, tmp_path: Path
) -> None:
    changes = ("<ModelVariables>", ENUMERATED), (GAP, '"fixed"><Enumeration declaredType="Mode" start="1"/>')
    file = changed(tmp_path, *changes)
    assert wiring(document(start={"time_gap_s": written}), file).start[0][1:] == (value, "Enumeration")
    assert "takes one of 'eco' (1), 'sport' (3)" in problems(document(start={"time_gap_s": 2}), file)


MIXED = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.enums import Fmi2Status


class Mixed(Fmi2Slave):
    "An FMU with inputs and parameters of every type that pythonfmu has."

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.speed_mps, self.other0_seen, self.lanes, self.load_kg = 0.0, False, 0, 150.0
        self.gain, self.brisk, self.gear, self.weather = 1.0, False, 1, "dry"
        self.acceleration_mps2, self.steering_rad = 0.0, 0.0
        inputs = Fmi2Causality.input
        parameters = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("speed_mps", causality=inputs))
        self.register_variable(Boolean("other0_seen", causality=inputs, variability=Fmi2Variability.discrete))
        self.register_variable(Integer("lanes", causality=inputs, variability=Fmi2Variability.discrete))
        self.register_variable(Real("load_kg", causality=inputs))
        self.register_variable(Real("gain", **parameters))
        self.register_variable(Boolean("brisk", **parameters))
        self.register_variable(Integer("gear", **parameters))
        self.register_variable(String("weather", **parameters))
        self.register_variable(Real("acceleration_mps2", causality=Fmi2Causality.output))
        self.register_variable(Real("steering_rad", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if self.weather == "fog":
            self.log("the camera sees nothing", Fmi2Status.error)
            return False
        self.acceleration_mps2 = self.gain + self.gear + 0.1 * self.lanes + 0.01 * self.load_kg
        self.acceleration_mps2 += 0.5 * self.brisk - 4.0 * self.other0_seen + (0.25 if self.weather == "wet" else 0.0)
        return True
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU made by pythonfmu."""
    folder = tmp_path_factory.mktemp("mixed")
    (folder / "mixed.py").write_text(MIXED)
    return Path(FmuBuilder.build_FMU(folder / "mixed.py", dest=folder))


def test_pythonfmu__variables_of_every_type_are_set(mixed: Path, car: Car) -> None:
    start = {"gain": 0.5, "brisk": True, "gear": 2, "weather": "wet"}
    driver = fmu_driver(document(inputs={"lanes": "goal_m"}, start=start), mixed, car)
    view = np.zeros((1, SIZE), dtype=np.float32)
    view[0, LAYOUT.index("goal_m")], view[0, LAYOUT.index("other0_seen")] = 0.0253, 1.0  # 5.06 m and a road user
    driver.reset(GAMES[:1])
    wanted = 0.5 + 2 + 0.1 * 5 + 0.01 * 150.0 + 0.5 - 4.0 + 0.25
    expected_actions = car.actions(np.array([wanted]), np.zeros(1), view)
    np.testing.assert_allclose(driver.decide(GAMES[:1], view, np.zeros((1, 2))), expected_actions, atol=1e-9)


def test_pythonfmu__its_own_log_is_in_the_error(mixed: Path, car: Car) -> None:
    driver = fmu_driver(document(start={"weather": "fog"}), mixed, car)
    driver.reset(GAMES[:1])
    with pytest.raises(DriverError, match=r"fmi2DoStep.*its log: .*the camera sees nothing"):
        driver.decide(GAMES[:1], np.zeros((1, SIZE), dtype=np.float32), np.zeros((1, 2)))


# --- variables of every type in FMUs of FMI 3.0 ----------------------------------------------------------------------

NUMBERS = ("Float32", *INTEGERS[1:], "Boolean")
SPEED, TIME_GAP = "speed_mps", "time_gap_s"
PLAIN = {
    SPEED: f'<Float64 name="{SPEED}" valueReference="0" causality="input" variability="continuous" unit="m/s" '
    'start="0.0"/>',
    TIME_GAP: f'<Float64 name="{TIME_GAP}" valueReference="10" causality="parameter" variability="fixed" unit="s" '
    'start="1.5"/>',
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


def behind(car: Car, view: np.ndarray, speed_mps: float, time_gap_s: float) -> np.ndarray:
    """The first action of twin.c 30 m behind a car: a third of the wanted acceleration."""
    ahead_m = car.physical(view)[0, LAYOUT.index("other0_ahead_m")]
    wanted = min(2.0, 0.3 * (ahead_m - 4.6 - 2.0 - time_gap_s * speed_mps))
    return car.actions(np.array([max(wanted, -8.0) / 3.0]), np.zeros(1), view)


@pytest.mark.parametrize("kind", NUMBERS)
def test_fmi3__inputs_and_parameters_may_be_of_this_type(kind: str, typed_twin: Path, tmp_path: Path, car: Car) -> None:
    file = declared(typed_twin, tmp_path, {SPEED: kind, TIME_GAP: kind})
    time_gap_s = True if kind == "Boolean" else 2
    view = behind_a_car(car, 12.6)
    seen_mps = {"Boolean": 1.0, "Float32": car.physical(view)[0, LAYOUT.index(SPEED)]}.get(kind, 13.0)
    action = first_action(fmu_driver(document(start={TIME_GAP: time_gap_s}), file, car), view)
    np.testing.assert_allclose(action, behind(car, view, seen_mps, float(time_gap_s)), atol=1e-6)


@pytest.mark.parametrize(("kind", "value", "time_gap_s"), [("Enumeration", "long", 3.0), ("String", "four", 4.0)])
def test_fmi3__parameters_may_be_texts_and_items(
    kind: str, value: str, time_gap_s: float, typed_twin: Path, tmp_path: Path, car: Car
) -> None:
    file = declared(typed_twin, tmp_path, {TIME_GAP: kind})
    view = behind_a_car(car, 12.0)
    action = first_action(fmu_driver(document(start={TIME_GAP: value}), file, car), view)
    np.testing.assert_allclose(action, behind(car, view, 12.0, time_gap_s), atol=1e-6)


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
