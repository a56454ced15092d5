"""The documents as JSON Schemas, for editors: made from the models, so that there is one description of each.

What a schema can't say (an interval's lower end comes first, a buffer is a multiple of the games, ...) is left to the
models; a schema refuses nothing that they accept. TOML has no null: a key that may be left out is one that isn't there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from harness.config.campaign import Campaign
from harness.config.driver import DriverDocument
from harness.config.persona import Persona
from harness.config.scene import Scene
from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.game.payoff import FUZZY_QUANTITIES, GROUPS, TERMS, Term

DOCUMENTS: Mapping[str, Any] = {"campaign": Campaign, "persona": Persona, "scene": Scene, "driver": DriverDocument}
"""Every kind of document that a person writes, with its type: what `harness schema` knows of."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"
UNITS = {"mps2": "m/s²", "mps": "m/s", "radps": "rad/s", "rad": "rad", "m": "m", "s": "s"}
"""Units by what a key's name ends with."""


def schema_of(document: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a kind of document. Raises KeyError when there is no such kind."""
    schema = TypeAdapter(DOCUMENTS[document]).json_schema(schema_generator=_OfToml)
    if document == "persona":
        _name_terms(schema)
    for name, described in _properties(schema):
        if "description" in described:
            described["description"] = " ".join(described["description"].split())
        if unit := unit_of(name):
            described["description"] = f"{described.get('description', '')} Unit: {unit}.".lstrip()
        if "prefixItems" in described:
            described["description"] = f"{described.get('description', '')} Two numbers, the lower first.".lstrip()
    for table in schema.get("$defs", {}).values():
        if "description" in table:
            table["description"] = " ".join(table["description"].split())
    return {"$schema": DIALECT, **schema}


def schema_text(document: str) -> str:
    """A schema as the text of its file. Raises UsageError when there is no such kind of document."""
    if document not in DOCUMENTS:
        raise UsageError.of(
            "harness schema", "", f"there is no kind of document {document!r}", nearest(document, DOCUMENTS)
        )
    return json.dumps(schema_of(document), indent=2, ensure_ascii=False) + "\n"


def file_of(document: str) -> str:
    """What a schema's file is called."""
    return f"{document}.schema.json"


def unit_of(key: str) -> str:
    """The unit in a key's name, e.g. "m/s" of speed_mps; empty: it has none."""
    if key.endswith("_per_s"):
        return "1/s"
    return UNITS.get(key.rpartition("_")[2], "") if "_" in key else ""


def term_in_words(term: Term) -> str:
    """What a unit of a term's weight is counted for."""
    if term.parameter:
        return f"{term.meaning}; per second at 0, nothing from {term.parameter} on"
    return term.meaning + (", per second" if term.per_second and "second" not in term.meaning else "")


class _OfToml(GenerateJsonSchema):
    """Schemas without titles made of keys, and without null."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> dict[str, Any]:
        made = super().default_schema(schema)
        if made.get("default") is None or isinstance(made["default"], dict):  # a table's keys have defaults themselves
            made.pop("default", None)
        return made


def _properties(node: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key that a schema knows, at any depth, with its schema."""
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
    """Give each group of equation 1 its own terms by name, where the model checks names after reading."""
    tables = schema["$defs"]
    for group in GROUPS:
        field = schema["properties"][group]
        title = group.capitalize()
        given = deepcopy(tables[field["$ref"].rpartition("/")[2]])
        given["title"] = title
        weight, limits = given["properties"]["weight"], tables["Parametrised"]["properties"]
        given["properties"]["terms"] = {
            "description": given["properties"]["terms"]["description"],
            "type": "object",
            "additionalProperties": False,
            "properties": {
                name: _term_schema(term, weight, limits) for name, term in TERMS.items() if term.group == group
            },
        }
        schema["properties"][group] = field | {"$ref": f"#/$defs/{title}"}
        tables[title] = given
    quantity = tables["FuzzyTerm"]["properties"]["quantity"]
    quantity["enum"] = list(FUZZY_QUANTITIES)
    known = "; ".join(f"{name}: {meaning}" for name, meaning in FUZZY_QUANTITIES.items())
    quantity["description"] += f" {known}."
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
