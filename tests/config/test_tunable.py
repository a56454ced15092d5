"""What a driver document may declare as tunable, and documents with other values of it."""

# ruff: noqa: E501

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.config.driver import DriverDocument, Process, Python, read_driver
from harness.config.toml_reading import tomllib
from harness.config.toml_writing import toml_of
from harness.config.tunable import Adjustable, Tunable
from harness.errors import UsageError
from tests.support.external_drivers import document, find
from tests.support.repository import REPOSITORY

PYTHON = 'kind = "python"\nentry_point = "steady"\n[parameters]\nspeed_mps = 8\nname = "x"\nloud = true\n'
FMU = 'kind = "fmu"\nfile = "mine.toml"\n[start]\n"control.time_gap_s" = 1.5\n'
PROCESS = 'kind = "process"\ncommand = ["perl"]\n[parameters]\ntime_gap_s = 1.5\nroad = "wet"\n'
RULES = 'kind = "rules"\nname = "mine"\ndescription = "Somebody by rules."\n[cruise]\ntime_gap_s = 1.8\n'
FUZZY = RULES + "[fuzzy]\ncomfortable_mps2 = 4.0\nhardest_mps2 = 6.0\n"


def read(text: str, folder: Path) -> Adjustable:
    read = read_driver(folder / document(folder, text))
    assert isinstance(read, Adjustable)
    return read


@pytest.mark.parametrize(
    ("text", "tunable", "now"),
    [
        (PYTHON, "speed_mps = [5, 12.5]", {"speed_mps": 8}),
        (FMU, '"control.time_gap_s" = [0.8, 2.5]', {"control.time_gap_s": 1.5}),
        (PROCESS, "time_gap_s = [0.8, 2.5]", {"time_gap_s": 1.5}),
        (RULES, '"cruise.time_gap_s" = [0.8, 2.5]', {"cruise.time_gap_s": 1.8}),
    ],
    ids=["python", "fmu", "process", "rules"],
)
def test_tunable__every_kind_that_has_parameters_declares_them_alike(
    text: str, tunable: str, now: dict[str, float], tmp_path: Path
) -> None:
    read_one = read(f"{text}[tunable]\n{tunable}\n", tmp_path)
    ((key, low, high),) = read_one.searched
    assert {key: read_one.numbers[key]} == now
    assert low < now[key] < high
    tuned = read_one.tuned({key: high})
    assert tuned.numbers == {**read_one.numbers, key: high}
    assert tuned.tuned(now).model_dump() == read_one.model_dump()  # and nothing else has changed


@pytest.mark.parametrize("text", [PYTHON, FMU, PROCESS, FUZZY, RULES + "[tunable]\n"])
def test_tunable__what_is_not_declared_is_not_searched(text: str, tmp_path: Path) -> None:
    assert read(text, tmp_path).searched == ()
    with pytest.raises(KeyError):
        read(text, tmp_path).tuned({"cruise.time_gap_s": 1.0})


def test_tunable__of_rules_that_do_not_say_are_those_of_driver_assistance_around_the_documents_values(
    tmp_path: Path,
) -> None:
    usual = {each.key: each for each in read(RULES, tmp_path).searched}
    assert usual["cruise.time_gap_s"] == Tunable("cruise.time_gap_s", 0.8, 2.5)
    wider = {each.key: each for each in read(RULES.replace("1.8", "3.9"), tmp_path).searched}
    assert wider["cruise.time_gap_s"] == Tunable("cruise.time_gap_s", 0.8, 3.9)


def test_tunable__a_reference_driver_is_searched_where_its_document_says_so(tmp_path: Path) -> None:
    declared = read(f'{FUZZY}[tunable]\n"fuzzy.margin_m" = [1.0, 4.0]\n', tmp_path)
    assert declared.tuned({"fuzzy.margin_m": 3.0}).fuzzy.margin_m == 3.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("text", "tunable", "said"),
    [
        (PYTHON, "sped_mps = [5, 12]", "tunable.sped_mps: the document gives no parameter of this name a number (did you mean 'speed_mps'?)"),
        (PYTHON, "name = [5, 12]", "tunable.name: the document gives no parameter of this name a number"),
        (PYTHON, "loud = [0, 1]", "tunable.loud: the document gives no parameter of this name a number"),
        (PYTHON, "speed_mps = [12, 5]", "tunable.speed_mps: 12 to 5 is nothing to search in"),
        (PYTHON, "speed_mps = [8, 8]", "tunable.speed_mps: 8 to 8 is nothing to search in"),
        (PYTHON, "speed_mps = [9, 12]", "tunable.speed_mps: the document's own value, 8, is not from 9 to 12"),
        (PYTHON, "speed_mps = [5]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = [5, 8, 12]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = [5, inf]", "tunable.speed_mps[1]: inf is not possible"),
        (PYTHON, "speed_mps = [nan, 9]", "tunable.speed_mps[0]: nan is not possible"),
        (PYTHON, "speed_mps = [5, 1e300]", "tunable.speed_mps"),
        (PYTHON, 'speed_mps = ["5", "12"]', "tunable.speed_mps"),
        (PYTHON, "speed_mps = [false, true]", "tunable.speed_mps"),
        (PYTHON, "speed_mps = 5", "tunable.speed_mps"),
        (PYTHON, '"" = [5, 12]', "tunable"),
        (PYTHON, '"a\\nb" = [5, 12]', "tunable"),
        (PYTHON, "\n".join(f"p{k} = [5, 12]" for k in range(101)), "tunable"),
        ('kind = "python"\nentry_point = "steady"\n', "speed_mps = [5, 12]", "it has no parameters that are numbers"),
        (FMU, '"time_gap_s" = [0.8, 2.5]', "did you mean 'control.time_gap_s'?"),
        (FMU, "control.time_gap_s = [0.8, 2.5]", 'tunable: a name with a point in it needs quotes, as in "control.time_gap_s"'),
        (RULES, "time_gap_s = [0.8, 2.5]", "did you mean 'cruise.time_gap_s'?"),
        (RULES, '"cruise.time_gap_s" = [0.5, 2.5]', "tunable.cruise.time_gap_s: it can't be 0.5: Input should be greater than or equal to 0.8"),
        (RULES, '"rss.reaction_s" = [0.5, 1.0]', "tunable.rss.reaction_s: the document gives no parameter"),
        (FUZZY, '"fuzzy.hardest_mps2" = [3.0, 8.0]', "it can't be 3: Value error, hardest_mps2 must exceed comfortable_mps2"),
    ],
)  # fmt: skip
def test_tunable__what_is_wrong_with_it_is_named(text: str, tunable: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        read(f"{text}[tunable]\n{tunable}\n", tmp_path)
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) == len(caught.value.problems)


@pytest.mark.parametrize("kind", ['kind = "sumo"\nvehicle_type = "idm"\n', 'kind = "stable_baselines3"\nfile = "a"\n'])
def test_tunable__what_has_no_parameters_declares_none(kind: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="tunable: unknown key"):
        read_driver(tmp_path / document(tmp_path, f"{kind}[tunable]\na = [1, 2]\n"))


# --- told apart ---


def test_identity__is_what_it_was_before_anything_was_tunable(tmp_path: Path) -> None:
    found = find(document(tmp_path, PROCESS.split("[")[0] + '["perl"]'), tmp_path)
    assert set(found.identity["document"]) == {"kind", "command", "files", "units", "deadline_s", "start_deadline_s"}
    rules = find(document(tmp_path, RULES), tmp_path)
    assert "tunable" not in rules.identity["document"]
    declared = find(document(tmp_path, RULES + '[tunable]\n"cruise.time_gap_s" = [0.8, 2.5]\n'), tmp_path)
    assert declared.identity == rules.identity  # what may be is not what is
    assert declared.tuned({"cruise.time_gap_s": 2.0}).identity != rules.identity


def test_identity__of_a_program_changes_with_what_it_is_told(tmp_path: Path) -> None:
    told = [find(document(tmp_path, PROCESS.replace("1.5", gap)), tmp_path).identity for gap in ("1.5", "1.6")]
    assert told[0] != told[1]


def test_document_in__leads_to_the_same_files_from_another_folder(tmp_path: Path) -> None:
    (tmp_path / "egos").mkdir()
    (tmp_path / "egos" / "drive.pl").write_text("1;")
    (tmp_path / "egos" / "mine.toml").write_text('kind = "process"\ncommand = ["perl", "drive.pl"]\n')
    here, there = find("egos/mine.toml", tmp_path), tmp_path / "run" / "policies"
    there.mkdir(parents=True)
    (there / "driver.toml").write_text(toml_of(here.document_in(there)))
    moved = find("run/policies/driver.toml", tmp_path)
    assert moved.files == here.files
    assert moved.identity == here.identity
    assert isinstance(moved.document, Process)
    assert moved.document.folder == "../../egos"


def test_find__a_folder_for_a_program_that_is_not_there_is_named(tmp_path: Path) -> None:
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


@given(parameters=st.dictionaries(TEXT, ANY, max_size=4), said=TEXT)
def test_toml__reads_back_as_the_same_document(parameters: dict[str, Any], said: str) -> None:
    written = Python(kind="python", entry_point="steady", parameters=parameters)
    text = toml_of(written, [said])
    assert tomllib.loads(text).get("parameters", {}) == parameters
    assert text.startswith("# ")


@pytest.mark.parametrize("name", ["adas", "rss", "fuzzy", "careful_and_competent"])
def test_toml__of_every_shipped_ego_reads_back(name: str, tmp_path: Path) -> None:
    shipped: DriverDocument = read_driver(REPOSITORY / "egos" / f"{name}.toml")
    assert read_driver(tmp_path / document(tmp_path, toml_of(shipped))) == shipped
