"""A new persona's file: valid at once, with every key there is, and never in the place of another file."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any, get_args

import pytest
from jsonschema import Draft202012Validator
from pydantic import BaseModel

from harness.campaign.preflight import open_campaign
from harness.cli.persona_template import create_persona, persona_template
from harness.config.json_schema import schema_of
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.payoff import FUZZY_QUANTITIES, TERMS
from harness.game.state import EGO
from harness.traffic.scene import OpenScene
from harness.training.ppo import TrainingSpec, train
from tests.support.repository import REPOSITORY
from tests.support.tiny import harness, settings, write_campaign

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def with_all_keys() -> dict[str, Any]:
    """The template with everything that is commented out put to use: a # without a space is taken away."""
    return tomllib.loads(re.sub(r"^#(?=[a-z_\[])", "", persona_template("anna"), flags=re.MULTILINE))


def keys_of(document: Any, at: str = "") -> set[str]:
    """Every key in a document by its path, lists passed through."""
    if isinstance(document, dict):
        return {f"{at}{key}" for key in document} | {
            found for key, each in document.items() for found in keys_of(each, f"{at}{key}.")
        }
    if isinstance(document, list):
        return {found for each in document for found in keys_of(each, at)}
    return set()


def keys_there_are(model: type[BaseModel], at: str = "") -> set[str]:
    """Every key of a persona by its path, from the models and the list of terms."""
    found: set[str] = set()
    for name, field in model.model_fields.items():
        here = f"{at}{name}"
        found.add(here)
        if name == "terms":
            for term, of in TERMS.items():
                if at == f"{of.group}.":
                    found |= {f"{here}.{term}"} | (
                        {f"{here}.{term}.weight", f"{here}.{term}.{of.parameter}"} if of.parameter else set()
                    )
        elif (inner := model_in(field.annotation)) is not None:
            found |= keys_there_are(inner, f"{here}.")
    return found


def model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for each in get_args(annotation) if (found := model_in(each))), None)


def test_template__is_a_persona_as_it_stands(tmp_path: Path) -> None:
    file = create_persona("anna", tmp_path / "anna.toml")
    persona = read_document(file, Persona)
    assert persona.name == "anna"
    careful = read_document(REPOSITORY / "personas" / "careful.toml", Persona)
    assert persona.human_factors == careful.human_factors
    assert {each.name for each in persona.payoff.terms} == {each.name for each in careful.payoff.terms}


def test_template__with_every_key_put_to_use_is_a_persona_too() -> None:
    document = with_all_keys()
    persona = Persona.model_validate(document, strict=False)
    assert persona.attention is not None
    assert persona.perception is not None
    assert {each.name for each in persona.payoff.terms} == set(TERMS)
    assert len(persona.human.fuzzy[0].sets) == 3
    assert Draft202012Validator(schema_of("persona")).is_valid(document)


def test_template__has_every_key_there_is_and_no_other() -> None:
    assert keys_of(with_all_keys()) == keys_there_are(Persona)


def test_template__teaches_what_keys_mean_with_units_and_bounds() -> None:
    text = " ".join(re.sub(r"^#? ?", "", line) for line in persona_template("anna").splitlines())
    for words in (
        "Mean time between lapses (exponential). Unit: s. Above 0.1, at most 3600.",
        "Share of the drives in which the person does not look into the mirrors and over the shoulder. 0 to 1.",
        'One of "mode", "sampled". Left out: "mode".',
        "Letters, digits and _, a letter first; 1 to 40 characters.",
        *FUZZY_QUANTITIES.values(),
        *(term.meaning for term in TERMS.values()),
    ):
        assert words in text


def test_template__names_its_schema_where_one_is_published_above(tmp_path: Path) -> None:
    (tmp_path / "docs" / "schemas").mkdir(parents=True)
    (tmp_path / "docs" / "schemas" / "persona.schema.json").write_text("{}")
    (tmp_path / "people" / "mine").mkdir(parents=True)
    file = create_persona("anna", tmp_path / "people" / "mine" / "anna.toml")
    first = file.read_text(encoding="utf-8").splitlines()[0]
    assert first == "#:schema ../../docs/schemas/persona.schema.json"
    assert (file.parent / first.removeprefix("#:schema ")).is_file()


def test_template__names_no_schema_that_is_not_there(tmp_path: Path) -> None:
    text = create_persona("anna", tmp_path / "anna.toml").read_text(encoding="utf-8")
    assert not text.startswith("#:schema")
    assert "harness schema persona --out schemas" in text


def test_new__goes_to_the_folder_of_personas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert create_persona("anna") == Path("personas/anna.toml")
    assert (tmp_path / "personas" / "anna.toml").is_file()


def test_new__overwrites_nothing(tmp_path: Path) -> None:
    file = tmp_path / "anna.toml"
    file.write_text("mine")
    with pytest.raises(UsageError, match=r"is there already \(nothing is overwritten"):
        create_persona("anna", file)
    assert file.read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("late-merger", "did you mean 'late_merger'?"),
        ("2fast", "did you mean 'fast'?"),
        ("../anna", "did you mean 'anna'?"),
        ("Ännä", "did you mean 'nn'?"),
        ("a" * 41, f"did you mean '{'a' * 40}'?"),
        ("", "for instance 'late_merger'"),
        ("naive", "stages and arms of every campaign are called so"),
        ("sumo", "stages and arms of every campaign are called so"),
    ],
)
def test_new__a_name_that_no_persona_can_have_is_explained(tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(UsageError, match="no persona can be called") as raised:
        create_persona(name, tmp_path / "anna.toml")
    assert said in str(raised.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("out", "said"), [("anna.tml", "has to end with .toml"), ("no/anna.toml", "there is no folder")]
)
def test_new__a_file_that_can_not_be_is_explained(tmp_path: Path, out: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        create_persona("anna", tmp_path / out)
    assert list(tmp_path.iterdir()) == []


def test_new__is_checked_in_a_campaign(tmp_path: Path) -> None:
    made = harness("persona", "new", "anna", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert f"harness persona show {Path('personas', 'anna.toml')}" in made.stdout
    opened = open_campaign(write_campaign(tmp_path, personas=["personas/anna.toml"]))
    assert [each.name for each in opened.personas] == ["anna"]


def test_new__is_trained(tmp_path: Path, merge: OpenScene) -> None:
    anna = read_document(create_persona("anna", tmp_path / "anna.toml"), Persona)
    spec = TrainingSpec(
        scene=merge,
        learner=EGO,
        personas=(anna, anna),
        opponent=None,
        alone_share=1.0,
        attentive_share=0.0,
        initial=None,
        settings=settings(steps=1024),
        parts=("training", 1, "anna"),
    )
    trained = train(spec, checkpoint=tmp_path / "checkpoint.safetensors", key="key", card={})
    assert trained.progress.steps >= 1024
