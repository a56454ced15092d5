"""The template of a persona: valid, with every key, and never written over another file; a source that is no evidence
is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from harness.campaign.preflight import open_campaign
from harness.cli.new_documents import check_persona, create_persona, persona_template
from harness.config.json_schema import schema_of
from harness.config.persona import AttentionLapses, Perception, Persona
from harness.config.toml_reading import read_document, tomllib
from harness.errors import UsageError
from harness.game.payoff_terms import FUZZY_QUANTITIES, TERMS
from tests.support.repository import REPOSITORY
from tests.support.tiny import harness, write_campaign


def with_all_keys() -> dict[str, Any]:
    """The template with all keys that are commented out: a # without a space is removed."""
    return tomllib.loads(re.sub(r"^#(?=[a-z_\[])", "", persona_template("anna"), flags=re.MULTILINE))


def keys_of(document: Any, at: str = "") -> set[str]:
    """Every key in a document by its path, through lists."""
    if isinstance(document, dict):
        return {f"{at}{key}" for key in document} | {
            path for key, each in document.items() for path in keys_of(each, f"{at}{key}.")
        }
    if isinstance(document, list):
        return {path for each in document for path in keys_of(each, at)}
    return set()


def keys_of_schema(node: Any, tables: dict[str, Any], at: str = "") -> set[str]:
    """Every key of a schema by its path, through lists."""
    node = tables.get(node.get("$ref", "").rpartition("/")[2], node)
    node = node.get("items", node)
    node = tables.get(node.get("$ref", "").rpartition("/")[2], node)
    inner = node.get("properties", {})
    return {f"{at}{key}" for key in inner} | {
        path for key, each in inner.items() for path in keys_of_schema(each, tables, f"{at}{key}.")
    }


def test_template__is_a_valid_persona(tmp_path: Path) -> None:
    file = create_persona("anna", tmp_path / "anna.toml")
    assert "harness schema persona --out schemas" in file.read_text(encoding="utf-8")  # no folder above has schemas
    persona = read_document(file, Persona)
    assert persona.name == "anna"
    careful = read_document(REPOSITORY / "personas" / "careful.toml", Persona)
    assert persona.human_factors == careful.human_factors
    assert set(persona.payoff.terms) == set(careful.payoff.terms)


def test_template__with_every_key_of_the_schema_is_a_valid_persona() -> None:
    document, schema = with_all_keys(), schema_of("persona")
    persona = Persona.model_validate(document, strict=False)
    assert {each.name for each in persona.payoff.terms} == set(TERMS)
    assert len(persona.human.fuzzy[0].sets) == 3
    assert Draft202012Validator(schema).is_valid(document)
    assert keys_of(document) == keys_of_schema(schema, schema["$defs"])


def test_template__describes_keys_with_units_and_bounds() -> None:
    text = " ".join(re.sub(r"^#? ?", "", line) for line in persona_template("anna").splitlines())
    for words in (
        f"{AttentionLapses.model_fields['mean_attentive_s'].description} Unit: s. Above 0.1, at most 3600.",
        " ".join(f"{Perception.model_fields['no_shoulder_glance_share'].description} 0 to 1.".split()),
        'One of "mode", "sampled". Default: "mode".',
        "Letters, digits and _, a letter first; 1 to 40 characters.",
        *FUZZY_QUANTITIES.values(),
        *(term.meaning for term in TERMS.values()),
    ):
        assert words in text


def test_template__names_the_schema_in_a_folder_above(tmp_path: Path) -> None:
    (tmp_path / "docs" / "schemas").mkdir(parents=True)
    (tmp_path / "docs" / "schemas" / "persona.schema.json").write_text("{}")
    (tmp_path / "people" / "mine").mkdir(parents=True)
    file = create_persona("anna", tmp_path / "people" / "mine" / "anna.toml")
    first = file.read_text(encoding="utf-8").splitlines()[0]
    assert first == "#:schema ../../docs/schemas/persona.schema.json"
    assert (file.parent / first.removeprefix("#:schema ")).is_file()


def test_new__writes_to_the_folder_of_personas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert create_persona("anna") == Path("personas/anna.toml")
    assert (tmp_path / "personas" / "anna.toml").is_file()


def test_new__overwrites_no_file(tmp_path: Path) -> None:
    file = tmp_path / "anna.toml"
    file.write_text("mine")
    with pytest.raises(UsageError, match="already exists"):
        create_persona("anna", file)
    assert file.read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "file", "words"),
    [
        ("../anna", "anna.toml", "can't be the name of a persona"),
        ("", "anna.toml", "can't be the name of a persona"),
        ("sumo", "anna.toml", "stages and arms of every campaign have this name"),
        ("anna", "anna.tml", "is not the name of a TOML file"),
        ("anna", "no/anna.toml", "there is no folder"),
    ],
)
def test_new__an_impossible_name_or_file_is_refused(name: str, file: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=re.escape(words)):
        create_persona(name, tmp_path / file)
    assert list(tmp_path.iterdir()) == []


def test_new__works_in_a_campaign(tmp_path: Path) -> None:
    done = harness("persona", "new", "anna", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "personas/anna.toml: a valid persona" in done.stdout
    opened = open_campaign(write_campaign(tmp_path, personas=["personas/anna.toml"]))
    assert [each.name for each in opened.personas] == ["anna"]


def refusal(file: Path) -> str:
    with pytest.raises(UsageError) as caught:
        check_persona(file)
    return str(caught.value)


@pytest.mark.parametrize("file", sorted((REPOSITORY / "personas").glob("*.toml")), ids=lambda file: file.stem)
def test_check__every_shipped_persona_has_evidence(file: Path) -> None:
    assert check_persona(file).name == file.stem


def test_check__the_template_is_refused_until_it_is_filled_in(tmp_path: Path) -> None:
    file = create_persona("late", tmp_path / "late.toml")
    assert [line.split(": ")[1:3] for line in sorted(refusal(file).splitlines())] == [
        ["description", "is the text of the template (describe this driver)"],
        ["sources[0].citation", "is a placeholder (name author, publication and year)"],
        [
            "sources[0].statistic",
            "is a placeholder (say what was counted or measured of such drivers, with the figure)",
        ],
    ]


def test_check__a_source_that_is_no_evidence_is_refused(tmp_path: Path) -> None:
    text = create_persona("late", tmp_path / "late.toml").read_text()
    source = tomllib.loads(text)["sources"][0]
    written = text.replace(source["statistic"], "TODO: find a figure").replace(source["citation"], "TBD ...")
    (tmp_path / "late.toml").write_text(written)
    found = refusal(tmp_path / "late.toml")
    assert "sources[0].statistic: is a placeholder" in found
    assert "sources[0].citation: is a placeholder" in found
