"""The pages of the reference that are made from the code: commands, keys of the documents, public names of Python."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import typer

import harness
from harness.cli.app import app
from harness.config.json_schema import DOCUMENTS
from harness.shipped_documents import shipped, shipped_names

_EXAMPLE = re.compile(r"^>>> .*?(?=^\s*$|\Z)", re.DOTALL | re.MULTILINE)

_ORDER = {
    "Campaigns": ("run", "load", "Results"),
    "Environments": ("DrivingEnv", "ParallelDrivingEnv", "VectorDrivingEnv", "make_vec", "ArenaVecEnv", "Outcome"),
    "The arena": ("Arena", "Seat", "Step"),
    "Drivers and policies": ("Driver", "LearnedDriver", "SumoDriver", "Policy", "read_policy"),
    "Documents and scenes": ("Persona", "read_document", "OpenScene", "open_scene"),
    "Errors": ("HarnessError", "UsageError", "SimulationError"),
}


def pages(schemas: Path) -> dict[str, str]:
    """The pages by their names on the site."""
    made = {f"reference/{kind}.md": schema_page(kind, schemas) for kind in DOCUMENTS}
    return made | {
        "reference/api.md": api_page(),
        "reference/cli.md": cli_page(),
    }


def api_page() -> str:
    """Every public name with its documentation, by subject. Raises ValueError if one has no place."""
    if missing := set(harness.__all__) ^ {name for names in _ORDER.values() for name in names}:
        raise ValueError(f"give these names a place in the reference, or take them out: {', '.join(sorted(missing))}")
    lines = ["# Python", "", "`import harness` gives these names. A test runs the examples.", ""]
    for subject, names in _ORDER.items():
        lines += [f"## {subject}", ""]
        for name in names:
            thing = getattr(harness, name)
            lines += [f"### harness.{name}", "", *_described(thing, name)]
            for member, value in _members(thing):
                lines += [f"#### {name}.{member}", "", *_described(value, member)]
    return "\n".join(lines)


def _members(thing: Any) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class itself documents."""
    for name, value in vars(thing).items() if inspect.isclass(thing) else ():
        value = value.__func__ if isinstance(value, classmethod | staticmethod) else value
        documented = inspect.isfunction(value) or isinstance(value, property | cached_property)
        if documented and value.__doc__ and (not name.startswith("_") or name == "__init__"):
            yield name.replace("__init__", "new"), value


def _described(thing: Any, name: str) -> Iterator[str]:
    if inspect.isfunction(thing) or (inspect.isclass(thing) and thing.__init__ is not object.__init__):
        with suppress(ValueError):  # of classes of other languages
            signature = str(inspect.signature(thing)).replace("harness.", "")
            yield f"```python\n{name}{signature if len(signature) < 100 else _long(signature)}\n```\n"
    yield _EXAMPLE.sub(_fenced, inspect.cleandoc(thing.__doc__ or ""))
    yield ""


def _long(signature: str) -> str:
    """A signature with an argument on each line."""
    inside, _, result = signature[1:].rpartition(")")
    depth, lines = 0, [""]
    for character in inside:
        depth += (character in "[(") - (character in "])")
        lines[-1] += character
        if character == "," and depth == 0:
            lines.append("")
    return "(\n" + "\n".join(f"    {line.strip()}" for line in lines) + f"\n){result}"


def _fenced(example: re.Match[str]) -> str:
    return f"```pycon\n{example.group().rstrip()}\n```\n"


# --- commands ---------------------------------------------------------------------------------------------------------


def cli_page() -> str:
    """Every command with its arguments and options."""
    root = typer.main.get_command(app)
    lines = ["# Commands", "", _text(root.help), "", _text(str(app.info.epilog)), ""]
    for name, command in _commands(root, "harness"):
        lines += [f"## `{name}`", "", _text(command.help), "", *_usage(name, command), ""]
    return "\n".join(lines)


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    for each, inner in sorted(getattr(command, "commands", {}).items()):
        if getattr(inner, "commands", None):
            yield from _commands(inner, f"{name} {each}")
        else:
            yield f"{name} {each}", inner


def _usage(name: str, command: Any) -> Iterator[str]:
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    options = [each for each in command.params if each.param_type_name == "option" and not each.hidden]
    words = [each.metavar if each.required else f"[{each.metavar}]" for each in arguments]
    yield "```sh\n" + " ".join([name, *words, "[OPTIONS]" if options else ""]).rstrip() + "\n```\n"
    if arguments:
        yield "| argument | meaning |\n| --- | --- |"
        yield from (f"| `{each.metavar}` | {_cell(each.help)} |" for each in arguments)
        yield ""
    if options:
        yield "| option | meaning |\n| --- | --- |"
        for each in options:
            names = ", ".join(f"`{name}`" for name in (*each.opts, *each.secondary_opts))
            value = "" if each.is_flag else f" `{each.metavar or str(each.type_descriptor).upper()}`"
            default = f" Default: {each.default}." if each.show_default and each.default not in (None, False) else ""
            yield f"| {names}{value} | {_cell(each.help)}{default} |"


# --- documents --------------------------------------------------------------------------------------------------------


def schema_page(kind: str, folder: Path) -> str:
    """The keys of a kind of document, from its published JSON Schema."""
    schema = json.loads((folder / f"{kind}.schema.json").read_text(encoding="utf-8"))
    lines = [f"# Keys of a {kind}", "", _text(schema.get("description", "")), ""]
    lines += [f"The same as JSON Schema, for editors: `harness schema {kind}`.", ""]
    if "properties" in schema:
        lines += ["## Top level", "", *_keys(schema)]
    for name, part in sorted(schema.get("$defs", {}).items()):
        if "properties" in part:
            lines += [f"## {name}", "", _text(part.get("description", "")), "", *_keys(part)]
    return "\n".join(lines)


def _keys(part: Mapping[str, Any]) -> Iterator[str]:
    required = set(part.get("required", ()))
    yield "| key | value | default | meaning |\n| --- | --- | --- | --- |"
    for key, value in part["properties"].items():
        default = "required" if key in required else f"`{json.dumps(value['default'])}`" if "default" in value else ""
        yield f"| `{key}` | {_cell(_type(value))} | {_cell(default)} | {_cell(value.get('description', ''))} |"
    yield ""


def _type(value: Mapping[str, Any]) -> str:
    """The values that a key takes, in words; another table as a link."""
    if "$ref" in value:
        name = value["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#{_anchor(name)})"
    for several in ("anyOf", "oneOf"):
        if several in value:
            return " or ".join(dict.fromkeys(_type(each) for each in value[several] if each.get("type") != "null"))
    if "const" in value:
        return f"`{json.dumps(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{json.dumps(each)}`" for each in value["enum"])
    kind = value.get("type", "any")
    if kind == "array":
        items: Mapping[str, Any] = value.get("items") or next(iter(value.get("prefixItems", ())), {})
        return f"list of {_type(items)}"
    if kind == "object" and isinstance(value.get("additionalProperties"), dict):
        return f"table of {_type(value['additionalProperties'])}"
    kind = " or ".join(kind) if isinstance(kind, list) else kind
    bounds = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
    return ", ".join([kind, *(f"{sign} {value[name]:g}" for name, sign in bounds if name in value)])


# --- publications -----------------------------------------------------------------------------------------------------


def sources_of_personas() -> str:
    """The end of the page of publications: what the shipped personas rest on."""
    lines = ["", "## Personas", ""]
    lines += ["Each persona names its statistics; this is what their documents say.", ""]
    lines += ["| persona | statistic | source |", "| --- | --- | --- |"]
    for name in shipped_names("personas"):
        persona = harness.read_document(shipped("personas") / f"{name}.toml", harness.Persona)
        lines += [f"| {name} | {_cell(each.statistic)} | {_cell(each.citation)} |" for each in persona.sources]
    return "\n".join(lines) + "\n"


# --- text -------------------------------------------------------------------------------------------------------------


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w-]+", "-", heading.lower()).strip("-")


def _text(text: str | None) -> str:
    return inspect.cleandoc(text or "").replace("\f", "").replace("<", "&lt;")


def _cell(text: str | None) -> str:
    return " ".join(_text(text).split()).replace("|", "\\|")
