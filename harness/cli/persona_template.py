"""A new persona's file: valid at once, with every key there is, described as its schema describes it."""

from __future__ import annotations

import json
import os
import re
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from pydantic import TypeAdapter, ValidationError

from harness.campaign.plan.plan import plan
from harness.config.campaign import Campaign
from harness.config.json_schema import file_of, schema_of, term_in_words, unit_of
from harness.config.scene import Name
from harness.errors import UsageError
from harness.game.payoff import FUZZY_QUANTITIES, TERMS

FOLDER = "personas"
"""Where a persona's file is written if no other place is named."""
SCHEMAS = "docs/schemas"
"""Where a file finds its schema: in a folder above it."""

_WEIGHT, _LIMIT = 1.0, 1.0  # of a term that is left out
_WIDTH = 112
_IN_WORDS = {r"^[A-Za-z][A-Za-z0-9_]*$": "Letters, digits and _, a letter first;"}  # patterns
_LEFT_OUT = object()


def create_persona(name: str, out: Path | None = None) -> Path:
    """Write a new persona's file, `personas/NAME.toml` if no other is named; nothing is ever overwritten.

    Raises UsageError when no persona can be called so, or no file be written there.
    """
    _check_name(name)
    path = out if out is not None else Path(FOLDER) / f"{name}.toml"
    if path.suffix != ".toml":
        raise UsageError.of(path, "", "is not the name of a TOML file", "it has to end with .toml")
    if out is None:
        path.parent.mkdir(exist_ok=True)
    elif not path.parent.is_dir():
        raise UsageError.of(path, "", f"there is no folder {path.parent}", "make it, or name another file")
    text = persona_template(name, _schema_from(path))
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError.of(path, "", "is there already", "nothing is overwritten: name another with --out") from None
    return path


def persona_template(name: str, schema: str | None = None) -> str:
    """The text of a persona's file. `schema`: the path from that file to the persona's schema, where there is one."""
    document = schema_of("persona")

    def key(path: str, value: Any = _LEFT_OUT, counts: bool = True, words: bool = True) -> str:
        node = _at(document, path)
        given = node["default"] if value is _LEFT_OUT else value
        line = f"{path.rpartition('.')[2]} = {_toml(given)}"
        return _comment(_words(node) if words else "") + (line if counts and value is not _LEFT_OUT else f"#{line}")

    def terms(group: str, counting: Mapping[str, Any]) -> str:
        given = {**_examples(document, group), **counting}
        lines = {name: f"{'' if name in counting else '#'}{name} = {_toml(value)}" for name, value in given.items()}
        width = max(map(len, lines.values()))
        return "\n".join(f"{line:<{width}}  # {term_in_words(TERMS[name])}" for name, line in lines.items())

    environment = Environment(
        loader=PackageLoader("harness", "cli"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("persona.toml.jinja").render(
        name=name,
        editors=_editors(schema),
        key=key,
        terms=terms,
        about=lambda path: _comment(_at(document, path)["description"]).removeprefix("# ").rstrip("\n"),
        bounds=lambda path: _bounds(_at(document, path)).rstrip("."),
        quantities=FUZZY_QUANTITIES,
        unit_of=unit_of,
    )


def _check_name(name: str) -> None:
    """Whether a persona can be called so: by the pattern of names, and beside the stages of any campaign."""
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        mended = re.sub(r"^[^A-Za-z]+", "", re.sub(r"[^A-Za-z0-9]+", "_", name)).strip("_")[:40]
        remedy = f"did you mean {mended!r}?" if mended else "for instance 'late_merger'"
        message = f"no persona can be called {name!r}: letters, digits and _, a letter first, 40 at most"
        raise UsageError.of("harness persona new", "NAME", message, remedy) from None
    stages = [stage.id for stage in plan(Campaign(name="any", scene="any", personas=["any"]), [name])]
    if len(set(stages)) < len(stages):
        message = f"no persona can be called {name!r}: stages and arms of every campaign are called so"
        raise UsageError.of("harness persona new", "NAME", message, f"for instance '{name}_driver'")


def _schema_from(path: Path) -> str | None:
    """The way from a file to the persona's schema, if one is published in a folder above it."""
    folder = path.resolve().parent
    for above in (folder, *folder.parents):
        schema = above / SCHEMAS / file_of("persona")
        if schema.is_file():
            return Path(os.path.relpath(schema, folder)).as_posix()
    return None


def _editors(schema: str | None) -> str:
    if schema is not None:
        return f"#:schema {schema}"
    return (
        "# Editors complete and check this by a schema: `harness schema persona --out schemas` writes it. Then make\n"
        f"# this the first line:  #:schema schemas/{file_of('persona')}"
    )


def _at(document: Any, path: str) -> Any:
    """The schema of a key by its path, with the description of the table it is where it has none itself."""
    node = document
    for key in path.split("."):
        inner = _found(document, node)
        node = _found(document, inner.get("items", inner))["properties"][key]
    return {**_found(document, node), **node}


def _found(document: Any, node: Any) -> Any:
    """A schema, or the one it refers to."""
    return document["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _words(node: Any) -> str:
    """A key in words: what it is, what it may be, and what it is if it is left out."""
    left_out = f"Left out: {_toml(node['default'])}." if "default" in node else ""
    return " ".join(filter(None, (node.get("description", ""), _bounds(node), left_out)))


def _bounds(node: Any) -> str:
    """What a schema allows, in words."""
    if "enum" in node:
        return f"One of {', '.join(map(_toml, node['enum']))}."
    for unit, low, high in (
        ("", "minimum", "maximum"),
        (" characters", "minLength", "maxLength"),
        (" entries", "minItems", "maxItems"),
    ):
        lowest = node.get(low, node.get("exclusiveMinimum")) if not unit else node.get(low)
        highest = node.get(high, node.get("exclusiveMaximum")) if not unit else node.get(high)
        if "prefixItems" in node or (lowest is None and highest is None):
            continue
        text = _range(lowest, highest, "exclusiveMinimum" in node, "exclusiveMaximum" in node)
        words = f"{_IN_WORDS.get(node.get('pattern', ''), '')} {text}{unit}.".lstrip()
        return words[0].upper() + words[1:]
    return ""


def _range(least: float | None, most: float | None, above: bool, below: bool) -> str:
    if least is not None and most is not None and not above and not below:
        return f"{least:g} to {most:g}"
    ends = [] if least is None else [f"above {least:g}" if above else f"{least:g} or more"]
    ends += [] if most is None else [f"below {most:g}" if below else f"at most {most:g}"]
    return ", ".join(ends)


def _examples(document: Any, group: str) -> dict[str, Any]:
    """Every term of a group, with a weight of one and a limit of one where it takes a limit."""
    terms = _at(document, f"{group}.terms")["properties"]
    return {
        name: {"weight": _WEIGHT, TERMS[name].parameter: _LIMIT} if TERMS[name].parameter else _WEIGHT for name in terms
    }


def _comment(words: str) -> str:
    held = words.replace("Unit: ", "Unit:\N{NO-BREAK SPACE}")
    lines = textwrap.wrap(held, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return "".join(f"# {line}\n" for line in lines).replace("\N{NO-BREAK SPACE}", " ")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)  # plain values and lists of them are written alike in TOML
