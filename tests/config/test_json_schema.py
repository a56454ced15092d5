"""The published schemas: they are current, accept every shipped document, and refuse nothing that a model accepts."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from pydantic import TypeAdapter, ValidationError

from harness.config.json_schema import DIALECT, DOCUMENTS, UNITS, schema_of, schema_text, term_in_words, write_schemas
from harness.config.toml_reading import tomllib
from harness.errors import UsageError
from harness.game.payoff_terms import FUZZY_QUANTITIES, GROUPS, TERMS
from tests.support.repository import REPOSITORY

PUBLISHED = REPOSITORY / "docs" / "schemas"
SHIPPED = [
    *(("campaign", path) for path in sorted((REPOSITORY / "campaigns").glob("*.toml"))),
    *(("persona", path) for path in sorted((REPOSITORY / "personas").glob("*.toml"))),
    *(("scene", path) for path in sorted((REPOSITORY / "networks").glob("*/scene.toml"))),
    *(("perception", path) for path in sorted((REPOSITORY / "perception").glob("*.toml"))),
    *(("driver", path) for path in sorted((REPOSITORY / "egos").rglob("*.toml")) if path.name != "pyproject.toml"),
]
each_shipped = pytest.mark.parametrize(
    ("kind", "path"), SHIPPED, ids=[path.relative_to(REPOSITORY).as_posix() for _, path in SHIPPED]
)
TABLES_WITH_FREE_KEYS = {"start", "inputs", "parameters"}  # tables whose keys are names in an FMU or a program
each_kind = pytest.mark.parametrize("kind", DOCUMENTS)

Keys = tuple[str | int, ...]


def read(path: Path) -> Any:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def accepts(kind: str, document: Any) -> bool:
    """Whether the model of the kind accepts the document."""
    try:
        TypeAdapter(DOCUMENTS[kind]).validate_json(json.dumps(document))
    except ValidationError:
        return False
    return True


def nodes(node: Any, at: Keys = ()) -> Iterator[Keys]:
    """The path of every value in a document, at any depth."""
    for key, each in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield (*at, key)
        yield from nodes(each, (*at, key))


def with_changed(document: Any, at: Keys, change: Any) -> Any:
    """A copy after `change(table, key)`, where the table or list contains the key."""
    changed = copy.deepcopy(document)
    table = changed
    for key in at[:-1]:
        table = table[key]
    change(table, at[-1])
    return changed


def described(schema: Any) -> Iterator[tuple[str, Any]]:
    """Every key of a schema with its description, which can be that of its table."""
    candidates = (schema, *schema["$defs"].values())
    tables = [each for each in candidates if "properties" in each]  # a union of tables has no properties
    inner = [each for table in tables for key in table["properties"].values() if "properties" in (each := key)]
    inner += [each for table in inner for each in table["properties"].values() if "properties" in each]
    for table in (*tables, *inner):
        for name, node in table["properties"].items():
            yield name, {**schema["$defs"].get(node.get("$ref", "").rpartition("/")[2], {}), **node}


# --- published files ---


def test_published_schemas__are_what_the_command_writes(tmp_path: Path) -> None:
    written = write_schemas(tmp_path / "new" / "schemas")
    assert {each.name for each in written} == {each.name for each in PUBLISHED.iterdir()}, (
        "harness schema --out docs/schemas"
    )
    for each in written:
        assert each.read_text(encoding="utf-8") == (PUBLISHED / each.name).read_text(encoding="utf-8"), (
            f"{each.name} is out of date: harness schema --out docs/schemas"
        )


def test_write_schemas__writes_one_schema(tmp_path: Path) -> None:
    assert write_schemas(tmp_path, "persona") == [tmp_path / "persona.schema.json"]
    assert [each.name for each in tmp_path.iterdir()] == ["persona.schema.json"]


def test_write_schemas__unknown_kind_names_the_nearest_and_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no kind of document 'persna'.*did you mean 'persona'"):
        write_schemas(tmp_path / "new", "persna")
    assert not (tmp_path / "new").exists()


def test_write_schemas__refuses_a_file_as_folder(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(UsageError, match="is not a folder"):
        write_schemas(tmp_path / "notes")
    assert (tmp_path / "notes").read_text() == "mine"


# --- content ---


@each_kind
def test_schema__is_valid_in_its_dialect(kind: str) -> None:
    schema = json.loads(schema_text(kind))
    assert schema["$schema"] == DIALECT == Draft202012Validator.META_SCHEMA["$id"]
    Draft202012Validator.check_schema(schema)
    assert "null" not in schema_text(kind)


@each_kind
def test_schema__every_key_is_described_with_its_unit(kind: str) -> None:
    keys = list(described(schema_of(kind)))
    assert len(keys) > 10
    for name, node in keys:
        assert len(node.get("description", "")) > 10, f"{name} has no description: give its field a docstring"
        assert "\n" not in node["description"]
        ending = name.rpartition("_")[2]
        if "_" in name and ending in UNITS:
            unit = "1/s" if name.endswith("_per_s") else UNITS[ending]
            assert f"Unit: {unit}." in node["description"]


@each_kind
def test_schema__every_number_has_bounds(kind: str) -> None:
    for name, node in described(schema_of(kind)):
        if node.get("type") in ("number", "integer") and name != "position_m":  # an edge can have any length
            assert {"minimum", "exclusiveMinimum"} & set(node), name
            assert {"maximum", "exclusiveMaximum"} & set(node), name


def test_persona_schema__has_each_term_in_its_group() -> None:
    schema = schema_of("persona")
    for group in GROUPS:
        table = schema["$defs"][schema["properties"][group]["$ref"].rpartition("/")[2]]
        terms = table["properties"]["terms"]["properties"]
        assert list(terms) == [name for name, term in TERMS.items() if term.group == group]
        for name, node in terms.items():
            assert TERMS[name].meaning in node["description"]
            limited = {"weight", TERMS[name].parameter} if TERMS[name].parameter else set()
            assert set(node.get("required", ())) == limited
    assert schema["$defs"]["FuzzyTerm"]["properties"]["quantity"]["enum"] == list(FUZZY_QUANTITIES)


# --- documents against their schemas ---


@each_shipped
def test_shipped_document__is_valid(kind: str, path: Path) -> None:
    assert [each.message for each in Draft202012Validator(schema_of(kind)).iter_errors(read(path))] == []


@each_shipped
def test_shipped_document__with_a_misspelt_key_is_not_valid(kind: str, path: Path) -> None:
    document, validator = read(path), Draft202012Validator(schema_of(kind))
    keys = [at for at in nodes(document) if isinstance(at[-1], str) and not TABLES_WITH_FREE_KEYS & set(at[:-1])]
    assert keys
    for at in keys:
        misspelt = with_changed(document, at, lambda table, key: table.update({f"{key}x": table.pop(key)}))
        assert not validator.is_valid(misspelt), ".".join(map(str, at))


@each_shipped
def test_schema__refuses_nothing_that_the_model_accepts(kind: str, path: Path) -> None:
    document, validator = read(path), Draft202012Validator(schema_of(kind))
    refused = 0
    for at in nodes(document):
        for value in (-1, 0, 0.5, 1e9, True, "x", "", [], [1.0], [2.0, 1.0], {}, {"weight": 1.0}):
            changed = with_changed(document, at, lambda table, key, value=value: table.__setitem__(key, value))
            if not validator.is_valid(changed):
                refused += 1
                assert not accepts(kind, changed), f"{'.'.join(map(str, at))} = {value!r}"
        without = with_changed(document, at, lambda table, key: table.pop(key))
        if not validator.is_valid(without):
            assert not accepts(kind, without), f"{'.'.join(map(str, at))} left out"
    assert refused > 20


def test_term__in_words_says_where_it_counts_in_full() -> None:
    assert term_in_words(TERMS["stop_sign"]).endswith("once: in full from from_mps on, and 0 below")
    assert term_in_words(TERMS["yield"]).endswith("once; in full at 0, and 0 from within_s on")
    assert term_in_words(TERMS["clearance"]).endswith("; per second at 0, and 0 from within_m on")
