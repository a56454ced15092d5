"""The JSON Schemas of the documents, for editors, generated from the models.

Only the models check what a schema can't express (an interval has its lower end first, a buffer is a multiple of the
games, ...). A schema refuses nothing that the model accepts. TOML has no null: an optional key is left out.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from harness.config.campaign import Campaign
from harness.config.driver import DriverDocument
from harness.config.ego_perception import EgoPerception
from harness.config.persona import Persona
from harness.config.scene import Scene
from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.files import write_atomically
from harness.game.payoff_terms import FUZZY_QUANTITIES, GROUPS, TERMS, Form, Term

DOCUMENTS: Mapping[str, Any] = {
    "campaign": Campaign,
    "persona": Persona,
    "scene": Scene,
    "driver": DriverDocument,
    "perception": EgoPerception,
}
"""All kinds of documents that users write, with their types."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"
UNITS = {"mps2": "m/s²", "mps": "m/s", "radps": "rad/s", "rad": "rad", "deg": "°", "m": "m", "s": "s"}
"""Units by the ending of a key."""


def schema_of(document: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a kind of document. Raises KeyError when there is no such kind."""
    schema = TypeAdapter(DOCUMENTS[document]).json_schema(schema_generator=_TomlSchema)
    if document == "persona":
        _name_terms(schema)
    for name, node in _properties(schema):
        notes = [" ".join(node.get("description", "").split())]
        notes += [f"Unit: {unit}."] if (unit := unit_of(name)) else []
        notes += ["Two numbers, the lower first."] if "prefixItems" in node else []
        if description := " ".join(filter(None, notes)):
            node["description"] = description
    for table in schema.get("$defs", {}).values():
        if "description" in table:
            table["description"] = " ".join(table["description"].split())
    return {"$schema": DIALECT, **schema}


def schema_text(document: str) -> str:
    """The content of a schema file. Raises UsageError when there is no such kind of document."""
    if document not in DOCUMENTS:
        raise UsageError.of(
            "harness schema", "", f"there is no kind of document {document!r}", nearest(document, DOCUMENTS)
        )
    return json.dumps(schema_of(document), indent=2, ensure_ascii=False) + "\n"


def write_schemas(folder: Path, document: str | None = None) -> list[Path]:
    """Write one schema, or all, into a folder, and return the files. The folder is created if it does not exist.

    Raises UsageError if there is no such kind of document, or the path is not a folder.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError.of("--out", str(folder), "is not a folder", "name a folder")
    texts = {folder / file_of(each): schema_text(each) for each in ([document] if document is not None else DOCUMENTS)}
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        write_atomically(file, text.encode())
    return list(texts)


def file_of(document: str) -> str:
    return f"{document}.schema.json"


def unit_of(key: str) -> str:
    """The unit in the name of a key, such as "m/s" for speed_mps; empty if there is none."""
    if key.endswith("_per_s"):
        return "1/s"
    return UNITS.get(key.rpartition("_")[2], "") if "_" in key else ""


def term_in_words(term: Term) -> str:
    """The meaning of a term: what its weight is multiplied by."""
    match term.form:
        case Form.BELOW:
            return (
                f"{term.meaning}; {'per second' if term.per_second else 'in full'} at 0, and 0 from {term.parameter} on"
            )
        case Form.FROM:
            return f"{term.meaning}: in full from {term.parameter} on, and 0 below"
    return term.meaning + (", per second" if term.per_second and "second" not in term.meaning else "")


class _TomlSchema(GenerateJsonSchema):
    """Schemas without titles derived from keys, and without null."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> dict[str, Any]:
        node = super().default_schema(schema)
        if node.get("default") is None or isinstance(node["default"], dict):  # the keys of a table have defaults
            node.pop("default", None)
        return node


def _properties(node: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """All keys of a schema, at any depth, each with its schema."""
    if isinstance(node, dict):
        properties = node.get("properties")
        if isinstance(properties, dict):
            yield from properties.items()
        for each in node.values():
            yield from _properties(each)
    elif isinstance(node, list):
        for each in node:
            yield from _properties(each)


def _name_terms(schema: dict[str, Any]) -> None:
    """Add the names of the terms to each group of equation 1; the model checks these names after reading."""
    tables = schema["$defs"]
    for group in GROUPS:
        field = schema["properties"][group]
        title = group.capitalize()
        table = deepcopy(tables[field["$ref"].rpartition("/")[2]])
        table["title"] = title
        weight, limits = table["properties"]["weight"], tables["Parametrised"]["properties"]
        table["properties"]["terms"] = {
            "description": table["properties"]["terms"]["description"],
            "type": "object",
            "additionalProperties": False,
            "properties": {
                name: _term_schema(term, weight, limits) for name, term in TERMS.items() if term.group == group
            },
        }
        schema["properties"][group] = field | {"$ref": f"#/$defs/{title}"}
        tables[title] = table
    quantity = tables["FuzzyTerm"]["properties"]["quantity"]
    quantity["enum"] = list(FUZZY_QUANTITIES)
    meanings = "; ".join(f"{name}: {meaning}" for name, meaning in FUZZY_QUANTITIES.items())
    quantity["description"] += f" {meanings}."
    for unused in ("Group", "Parametrised"):
        if f'"#/$defs/{unused}"' not in json.dumps(schema):
            del tables[unused]


def _term_schema(term: Term, weight: Mapping[str, Any], limits: Mapping[str, Any]) -> dict[str, Any]:
    words = term_in_words(term)
    plain = {key: value for key, value in weight.items() if key not in ("default", "description")}
    if not term.parameter:
        return {"description": f"Weight of {words}.", **plain}
    return {
        "description": f"Weight and limit of {words}.",
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "weight": {"description": "The term's weight.", **plain},
            term.parameter: deepcopy(limits[term.parameter]),
        },
        "required": ["weight", term.parameter],
    }
