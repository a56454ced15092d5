"""What the commands that write new documents share: the templates, and the names that documents can have."""

from __future__ import annotations

import json
from typing import Any, Literal

from jinja2 import Environment, PackageLoader, StrictUndefined
from pydantic import TypeAdapter, ValidationError

from harness.config.campaign import CampaignName
from harness.config.scene import Name
from harness.errors import UsageError


def check_name(name: str, kind: Literal["campaign", "persona", "scene"]) -> None:
    """Raise UsageError if a document of this kind can't have the name."""
    valid, signs = (CampaignName, "_ and -") if kind == "campaign" else (Name, "_")
    try:
        TypeAdapter(valid).validate_python(name)
    except ValidationError:
        remedy = f"use letters, digits, {signs}, a letter first, at most 40"
        raise UsageError.of("NAME", name, f"can't be the name of a {kind}", remedy) from None


def rendered(template: str, *, in_xml: bool = False, **values: object) -> str:
    """The text of a template of this room with values, which the filter `toml` writes in TOML."""
    environment = Environment(
        loader=PackageLoader("harness", "cli"),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        autoescape=in_xml,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["toml"] = toml
    return environment.get_template(template).render(values)


def toml(value: Any) -> str:
    """A value in TOML, which has the plain values and the lists of JSON; a table is inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
