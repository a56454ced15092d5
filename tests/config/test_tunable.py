"""Tunable parameters of driver documents, and documents with other values of them."""

# ruff: noqa: E501

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.config.driver import DriverDocument, Process, Python, read_driver
from harness.config.toml_reading import tomllib
from harness.config.tunable import Adjustable, Tunable
from harness.errors import UsageError
from tests.support.external_drivers import document, find
from tests.support.repository import REPOSITORY

PYTHON = 'kind = "python"\nentry_point = "steady"\n[parameters]\nspeed_mps = 8\nname = "x"\nloud = true\n'
FMU = 'kind = "fmu"\nfile = "mine.toml"\n[start]\n"control.time_gap_s" = 1.5\n'
PROCESS = 'kind = "process"\ncommand = ["perl"]\n[parameters]\ntime_gap_s = 1.5\nroad = "wet"\n'
RULES = 'kind = "rules"\nname = "mine"\ndescription = "A rule-based driver."\n[cruise]\ntime_gap_s = 1.8\n'
FUZZY = RULES + "[fuzzy]\ncomfortable_mps2 = 4.0\nhardest_mps2 = 6.0\n"


def read(text: str, folder: Path) -> Adjustable:
    driver = read_driver(folder / document(folder, text))
    assert isinstance(driver, Adjustable)
    return driver


@pytest.mark.parametrize(
    ("text", "tunable", "values"),
    [
        (PYTHON, "speed_mps = [5, 12.5]", {"speed_mps": 8}),
        (FMU, '"control.time_gap_s" = [0.8, 2.5]', {"control.time_gap_s": 1.5}),
        (PROCESS, "time_gap_s = [0.8, 2.5]", {"time_gap_s": 1.5}),
        (RULES, '"cruise.time_gap_s" = [0.8, 2.5]', {"cruise.time_gap_s": 1.8}),
    ],
    ids=["python", "fmu", "process", "rules"],
)
def test_tunable__all_kinds_with_parameters_declare_them_the_same_way(
    text: str, tunable: str, values: dict[str, float], tmp_path: Path
) -> None:
    driver = read(f"{text}[tunable]\n{tunable}\n", tmp_path)
    ((key, low, high),) = driver.searched
    assert {key: driver.numbers[key]} == values
    assert low < values[key] < high
    tuned = driver.tuned({key: high})
    assert tuned.numbers == {**driver.numbers, key: high}
    assert tuned.tuned(values).model_dump() == driver.model_dump()  # nothing else has changed


@pytest.mark.parametrize("text", [PYTHON, FMU, PROCESS, FUZZY, RULES + "[tunable]\n"])
def test_tunable__undeclared_parameters_are_not_searched(text: str, tmp_path: Path) -> None:
    assert read(text, tmp_path).searched == ()
    with pytest.raises(KeyError):
        read(text, tmp_path).tuned({"cruise.time_gap_s": 1.0})


def test_tunable__rules_have_defaults_that_contain_the_values_of_the_document(tmp_path: Path) -> None:
    default = {each.key: each for each in read(RULES, tmp_path).searched}
    assert default["cruise.time_gap_s"] == Tunable("cruise.time_gap_s", 0.8, 2.5)
    wider = {each.key: each for each in read(RULES.replace("1.8", "3.9"), tmp_path).searched}
    assert wider["cruise.time_gap_s"] == Tunable("cruise.time_gap_s", 0.8, 3.9)


def test_tunable__a_reference_driver_is_searched_if_its_document_declares_it(tmp_path: Path) -> None:
    declared = read(f'{FUZZY}[tunable]\n"fuzzy.margin_m" = [1.0, 4.0]\n', tmp_path)
    assert declared.tuned({"fuzzy.margin_m": 3.0}).fuzzy.margin_m == 3.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("text", "tunable", "message"),
    [
        (PYTHON, "sped_mps = [5, 12]", "tunable.sped_mps: the document has no number of this name (did you mean 'speed_mps'?)"),
        (PYTHON, "name = [5, 12]", "tunable.name: the document has no number of this name"),
        (PYTHON, "loud = [0, 1]", "tunable.loud: the document has no number of this name"),
        (PYTHON, "speed_mps = [12, 5]", "tunable.speed_mps: the range 12 to 5 is empty"),
        (PYTHON, "speed_mps = [9, 12]", "tunable.speed_mps: the value in the document, 8, is not within 9 to 12"),
        (PYTHON, "speed_mps = [5]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = [5, inf]", "tunable.speed_mps[1]: inf is not possible"),
        (PYTHON, "speed_mps = [5, 1e300]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = [false, true]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = 5", "tunable.speed_mps"),
        (PYTHON, '"" = [5, 12]', "tunable"),
        (PYTHON, '"a\\nb" = [5, 12]', "tunable"),
        (PYTHON, "\n".join(f"p{k} = [5, 12]" for k in range(101)), "tunable"),
        ('kind = "python"\nentry_point = "steady"\n', "speed_mps = [5, 12]", "the document has no parameters that are numbers"),
        (FMU, '"time_gap_s" = [0.8, 2.5]', "did you mean 'control.time_gap_s'?"),
        (FMU, "control.time_gap_s = [0.8, 2.5]", 'tunable: a name with a dot needs quotes, as in "control.time_gap_s"'),
        (RULES, "time_gap_s = [0.8, 2.5]", "did you mean 'cruise.time_gap_s'?"),
        (RULES, '"cruise.time_gap_s" = [0.5, 2.5]', "tunable.cruise.time_gap_s: the value 0.5 is not valid: Input should be greater than or equal to 0.8"),
        (RULES, '"rss.reaction_s" = [0.5, 1.0]', "tunable.rss.reaction_s: the document has no number"),
        (FUZZY, '"fuzzy.hardest_mps2" = [3.0, 8.0]', "the value 3 is not valid: Value error, hardest_mps2 must exceed comfortable_mps2"),
    ],
)  # fmt: skip
def test_tunable__mistakes_are_named(text: str, tunable: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        read(f"{text}[tunable]\n{tunable}\n", tmp_path)
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == len(caught.value.problems)


@pytest.mark.parametrize("kind", ['kind = "sumo"\nvehicle_type = "idm"\n', 'kind = "stable_baselines3"\nfile = "a"\n'])
def test_tunable__kinds_without_parameters_refuse_the_key(kind: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="tunable: unknown key"):
        read_driver(tmp_path / document(tmp_path, f"{kind}[tunable]\na = [1, 2]\n"))


# --- identity ---


def test_identity__does_not_contain_what_is_tunable(tmp_path: Path) -> None:
    program = find(document(tmp_path, PROCESS.split("[")[0] + '["perl"]'), tmp_path)
    assert {"tunable", "folder"}.isdisjoint(program.identity["document"])
    rules = find(document(tmp_path, RULES), tmp_path)
    assert "tunable" not in rules.identity["document"]
    declared = find(document(tmp_path, RULES + '[tunable]\n"cruise.time_gap_s" = [0.8, 2.5]\n'), tmp_path)
    assert declared.identity == rules.identity  # the bounds do not change the driver
    assert declared.tuned({"cruise.time_gap_s": 2.0}).identity != rules.identity


def test_document_in__names_the_same_files_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "egos").mkdir()
    (tmp_path / "egos" / "drive.pl").write_text("1;")
    (tmp_path / "egos" / "mine.toml").write_text('kind = "process"\ncommand = ["perl", "drive.pl"]\n')
    here, there = find("egos/mine.toml", tmp_path), tmp_path / "run" / "policies"
    there.mkdir(parents=True)
    (there / "driver.toml").write_text(here.document_in(there).toml())
    moved = find("run/policies/driver.toml", tmp_path)
    assert moved.files == here.files
    assert moved.identity == here.identity
    assert isinstance(moved.document, Process)
    assert moved.document.folder == "../../egos"


def test_find__a_missing_folder_of_a_program_is_named(tmp_path: Path) -> None:
    (tmp_path / "egos").mkdir()
    text = 'kind = "process"\ncommand = ["perl"]\nfolder = "ego"\n'
    with pytest.raises(UsageError, match=r"folder: 'ego': there is no such folder \(did you mean 'egos'\?\)"):
        find(document(tmp_path, text), tmp_path)


# --- as TOML ---

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
NUMBER = st.floats(allow_nan=False) | st.integers(-(2**53), 2**53)
ANY: Any = st.recursive(
    TEXT | NUMBER | st.booleans(),
    lambda each: st.lists(each, max_size=3) | st.dictionaries(TEXT, each, max_size=3),
    max_leaves=6,
)


@given(parameters=st.dictionaries(TEXT, ANY, max_size=4), comment=TEXT)
def test_toml__reads_back_as_an_equal_document(parameters: dict[str, Any], comment: str) -> None:
    written = Python(kind="python", entry_point="steady", parameters=parameters)
    text = written.toml(comment)
    assert tomllib.loads(text).get("parameters", {}) == parameters
    assert text.startswith("# ")


@pytest.mark.parametrize("name", ["adas", "rss", "fuzzy", "careful_and_competent"])
def test_toml__of_every_shipped_ego_reads_back(name: str, tmp_path: Path) -> None:
    shipped: DriverDocument = read_driver(REPOSITORY / "egos" / f"{name}.toml")
    assert read_driver(tmp_path / document(tmp_path, shipped.toml())) == shipped
