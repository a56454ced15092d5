"""The template of a persona, a valid document with every key and its description from the schema; and the check
whether the evidence of a persona is more than that of the template."""

from __future__ import annotations

import json
import os
import re
import sys
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from pydantic import TypeAdapter, ValidationError

from harness.campaign.plan.plan import plan
from harness.config.campaign import Campaign
from harness.config.json_schema import file_of, schema_of, term_in_words, unit_of
from harness.config.persona import Persona, Source
from harness.config.scene import Name
from harness.config.toml_reading import read_document
from harness.errors import Problem, UsageError
from harness.game.payoff_terms import FUZZY_QUANTITIES, TERMS

if sys.version_info >= (3, 11):
    import tomllib
else:  # pragma: no cover
    import tomli as tomllib

FOLDER = "personas"
"""The default folder of a new persona."""
SCHEMAS = "docs/schemas"
"""The path of the schemas, in a folder above the persona's file."""

_WEIGHT, _LIMIT = 1.0, 1.0  # of a term that is commented out
_WIDTH = 112
_PATTERNS = {r"^[A-Za-z][A-Za-z0-9_]*$": "Letters, digits and _, a letter first;"}
_NO_VALUE = object()
_NOT_WRITTEN = re.compile(r"\W*(todo|tbd|fixme|xxx+|placeholder|lorem ipsum|unknown|none|n/?a|example)\b|\W*$", re.I)


def create_persona(name: str, out: Path | None = None) -> Path:
    """Write the file of a new persona, `personas/NAME.toml` by default, and return its path. No file is overwritten.

    Raises UsageError if the name is not valid, or the file can't be written.
    """
    _check_name(name)
    path = out if out is not None else Path(FOLDER) / f"{name}.toml"
    if path.suffix != ".toml":
        raise UsageError.of(path, "", "is not the name of a TOML file", "the name must end with .toml")
    if out is None:
        path.parent.mkdir(exist_ok=True)
    elif not path.parent.is_dir():
        raise UsageError.of(path, "", f"there is no folder {path.parent}", "create it, or name another file")
    text = persona_template(name, _schema_from(path))
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError.of(
            path, "", "already exists", "no file is overwritten: name another file with --out"
        ) from None
    return path


def persona_template(name: str, schema: str | None = None) -> str:
    """The text of a persona's file. `schema` is the path from that file to the schema, if there is one."""
    document = schema_of("persona")

    def key(path: str, value: Any = _NO_VALUE, active: bool = True, describe: bool = True) -> str:
        node = _schema_at(document, path)
        line = f"{path.rpartition('.')[2]} = {_toml(node['default'] if value is _NO_VALUE else value)}"
        description = _comment(_description(node)) if describe else ""
        return description + (line if active and value is not _NO_VALUE else f"#{line}")

    def terms(group: str, active: Mapping[str, Any]) -> str:
        values = {**_examples(document, group), **active}
        lines = {name: f"{'' if name in active else '#'}{name} = {_toml(value)}" for name, value in values.items()}
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
        about=lambda path: _comment(_schema_at(document, path)["description"]).removeprefix("# ").rstrip("\n"),
        bounds=lambda path: _bounds(_schema_at(document, path)).rstrip("."),
        quantities=FUZZY_QUANTITIES,
        unit_of=unit_of,
    )


def check_persona(file: Path) -> Persona:
    """The persona in a file.

    Raises UsageError with every mistake, and with every source that is no evidence: the text of the template, or a
    word that stands for a text to come.
    """
    persona = read_document(file, Persona)
    template = Persona.model_validate(tomllib.loads(persona_template("any")))
    (placeholder,) = template.sources
    problems = []
    for number, source in enumerate(persona.sources):
        for key, message, remedy in _mistakes(source, placeholder):
            problems.append(Problem(str(file), f"sources[{number}].{key}", message, remedy))
    if persona.description == template.description:
        problems.append(Problem(str(file), "description", "is the text of the template", "describe this driver"))
    if problems:
        raise UsageError(problems)
    return persona


def _mistakes(source: Source, placeholder: Source) -> Iterator[tuple[str, str, str]]:
    """Key, message and remedy of what makes a source no evidence."""
    if source.statistic == placeholder.statistic or _NOT_WRITTEN.match(source.statistic):
        yield "statistic", "is a placeholder", "say what was counted or measured of such drivers, with the figure"
    if source.citation == placeholder.citation or _NOT_WRITTEN.match(source.citation):
        yield "citation", "is a placeholder", "name author, publication and year"


def _check_name(name: str) -> None:
    """Raise UsageError if a persona can't have the name: names have a pattern, and some are names of stages."""
    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError:
        suggestion = re.sub(r"^[^A-Za-z]+", "", re.sub(r"[^A-Za-z0-9]+", "_", name)).strip("_")[:40]
        message = f"{name!r} can't be the name of a persona: use letters, digits and _, a letter first, at most 40"
        remedy = f"did you mean {suggestion!r}?" if suggestion else "for instance 'late_merger'"
        raise UsageError.of("harness persona new", "NAME", message, remedy) from None
    stages = [stage.id for stage in plan(Campaign(name="any", scene="any", personas=["any"]), [name])]
    if len(set(stages)) < len(stages):
        message = f"{name!r} can't be the name of a persona: stages and arms of every campaign have this name"
        raise UsageError.of("harness persona new", "NAME", message, f"for instance '{name}_driver'")


def _schema_from(path: Path) -> str | None:
    """The path from a file to the schema of personas, if a folder above the file has one."""
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
        "# Editors complete and check this file with a schema: run `harness schema persona --out schemas`, and\n"
        f"# replace this comment by the line  #:schema schemas/{file_of('persona')}"
    )


def _schema_at(document: Any, path: str) -> Any:
    """The schema of a key by its path; a key without a description has that of its table."""
    node = document
    for key in path.split("."):
        inner = _resolved(document, node)
        node = _resolved(document, inner.get("items", inner))["properties"][key]
    return {**_resolved(document, node), **node}


def _resolved(document: Any, node: Any) -> Any:
    """A schema, or the schema that it refers to."""
    return document["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _description(node: Any) -> str:
    """A key in words: its meaning, its bounds, and its default."""
    default = f"Default: {_toml(node['default'])}." if "default" in node else ""
    return " ".join(filter(None, (node.get("description", ""), _bounds(node), default)))


def _bounds(node: Any) -> str:
    """The bounds of a schema, in words."""
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
        words = f"{_PATTERNS.get(node.get('pattern', ''), '')} {text}{unit}.".lstrip()
        return words[0].upper() + words[1:]
    return ""


def _range(least: float | None, most: float | None, above: bool, below: bool) -> str:
    if least is not None and most is not None and not above and not below:
        return f"{least:g} to {most:g}"
    ends = [] if least is None else [f"above {least:g}" if above else f"{least:g} or more"]
    ends += [] if most is None else [f"below {most:g}" if below else f"at most {most:g}"]
    return ", ".join(ends)


def _examples(document: Any, group: str) -> dict[str, Any]:
    """Every term of a group with the weight 1, and with the limit 1 if the term has a limit."""
    terms = _schema_at(document, f"{group}.terms")["properties"]
    return {
        name: {"weight": _WEIGHT, TERMS[name].parameter: _LIMIT} if TERMS[name].parameter else _WEIGHT for name in terms
    }


def _comment(text: str) -> str:
    unbroken = text.replace("Unit: ", "Unit:\N{NO-BREAK SPACE}")
    lines = textwrap.wrap(unbroken, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return "".join(f"# {line}\n" for line in lines).replace("\N{NO-BREAK SPACE}", " ")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)  # TOML and JSON have the same plain values and lists
