"""What commands write anew: documents from templates, under names that documents can have, and whole projects."""

from __future__ import annotations

import json
import os
import re
import shutil
import textwrap
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from harness.campaign.plan.plan import plan
from harness.config.campaign import Campaign, CampaignName
from harness.config.json_schema import file_of, schema_of, term_in_words, unit_of
from harness.config.persona import Persona
from harness.config.scene import Name
from harness.config.toml_reading import parse_toml, read_document
from harness.errors import Problem, UsageError
from harness.files import check_new_file, new_folder, write_atomically
from harness.game.payoff_terms import FUZZY_QUANTITIES, TERMS
from harness.reports.page_template import environment_of
from harness.shipped_documents import shipped

PERSONA = "my_driver"
SCENE = "merge"
_TEMPLATES = {"campaign.toml": "project_campaign.toml.jinja", "README.md": "project_readme.md.jinja"}
_SCHEMA = Path("docs", "schemas", file_of("persona"))  # in a folder above the persona's file
_WIDTH = 112
_NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_]*$"
_RANGES = {
    ("minimum", "maximum"): "{:g} to {:g}",
    ("minLength", "maxLength"): "{} to {} characters",
    ("minItems", "maxItems"): "{} to {} entries",
}
_BOUNDS = {
    "minimum": "{:g} or more",
    "exclusiveMinimum": "above {:g}",
    "maximum": "at most {:g}",
    "exclusiveMaximum": "below {:g}",
}
_NOT_WRITTEN = re.compile(r"\W*(todo|tbd|fixme|xxx+|placeholder|lorem ipsum|unknown|none|n/?a|example)\b|\W*$", re.I)
_EVIDENCE = {
    "statistic": "say what was counted or measured of such drivers, with the figure",
    "citation": "name author, publication and year",
}


def check_name(name: str, kind: Literal["campaign", "persona", "scene"]) -> None:
    """Raise UsageError if a document of this kind can't have the name."""
    valid, signs = (CampaignName, "_ and -") if kind == "campaign" else (Name, "_")
    try:
        TypeAdapter(valid).validate_python(name)
    except ValidationError:
        remedy = f"use letters, digits, {signs}, a letter first, at most 40"
        raise UsageError.of("NAME", name, f"can't be the name of a {kind}", remedy) from None


def check_free(paths: Iterable[Path], remedy: str) -> None:
    """Raise UsageError for each of these paths that exists."""
    if taken := [path for path in paths if os.path.lexists(path)]:
        message = "is there already, and nothing is overwritten"
        raise UsageError(Problem(str(path), "", message, remedy) for path in taken)


def rendered(template: str, *, in_xml: bool = False, **values: object) -> str:
    """The text of a template of this room with values, which the filter `toml` writes in TOML."""
    environment = environment_of("cli", autoescape=in_xml)
    environment.filters["toml"] = toml
    return environment.get_template(template).render(values) + "\n"


def toml(value: Any) -> str:
    """A value in TOML, which has the plain values and the lists of JSON; a table is inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def create_project(folder: Path) -> list[Path]:
    """Write the files of a new project and return their paths. `folder` must not exist, or be empty; it gets all files
    or none.

    The campaign is named after the folder. Raises UsageError if the folder holds files, its name is not that of a
    campaign, or it can't be written.
    """
    name = folder.absolute().name
    check_name(name, "campaign")
    persona, scene = Path("personas", f"{PERSONA}.toml"), Path("networks", SCENE)
    with new_folder(folder) as made:
        (made / persona.parent).mkdir()
        shutil.copytree(shipped("networks") / SCENE, made / scene)
        create_persona(PERSONA, made / persona)
        for file, template in _TEMPLATES.items():
            text = rendered(template, folder=name, persona=PERSONA, scene=SCENE)
            write_atomically(made / file, text.encode())
    return [folder / each for each in ("campaign.toml", scene / "scene.toml", persona, "README.md")]


def create_persona(name: str, out: Path | None = None) -> Path:
    """Write the file of a new persona, `personas/NAME.toml` by default, and return its path. No file is overwritten.

    Raises UsageError if the name is not valid, or the file can't be written.
    """
    check_name(name, "persona")
    stages = [stage.id for stage in plan(Campaign(name="any", scene="any", personas=["any"]), [name])]
    if len(set(stages)) < len(stages):
        message = "can't be the name of a persona: stages and arms of every campaign have this name"
        raise UsageError.of("NAME", name, message, f"for instance '{name}_driver'")
    path = out if out is not None else Path("personas") / f"{name}.toml"
    if path.suffix != ".toml":
        raise UsageError.of(path, "", "is not the name of a TOML file", "the name must end with .toml")
    if out is None:
        path.parent.mkdir(exist_ok=True)
    else:
        check_new_file(path)
    folder = path.resolve().parent
    schemas = (above / _SCHEMA for above in (folder, *folder.parents))
    schema = next((Path(os.path.relpath(file, folder)).as_posix() for file in schemas if file.is_file()), None)
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(persona_template(name, schema))
    except FileExistsError:
        remedy = "no file is overwritten: name another file with --out"
        raise UsageError.of(path, "", "already exists", remedy) from None
    return path


def persona_template(name: str, schema: str | None = None) -> str:
    """The text of a persona's file. `schema` is the path from that file to the schema, if there is one."""
    document = schema_of("persona")

    def key(path: str, value: Any = None, active: bool = True, describe: bool = True) -> str:
        node = _schema_at(document, path)
        line = f"{path.rpartition('.')[2]} = {toml(node['default'] if value is None else value)}"
        default = f"Default: {toml(node['default'])}." if "default" in node else ""
        bounds = _bounds(node)
        words = (node.get("description", ""), f"{bounds[0].upper()}{bounds[1:]}." if bounds else "", default)
        description = _comment(" ".join(filter(None, words))) if describe else ""
        return description + (line if active and value is not None else f"#{line}")

    def terms(group: str, active: Mapping[str, Any]) -> str:
        lines = {}
        for name in _schema_at(document, f"{group}.terms")["properties"]:
            parameter = TERMS[name].parameter
            value = active.get(name, {"weight": 1.0, parameter: 1.0} if parameter else 1.0)
            lines[name] = f"{'' if name in active else '#'}{name} = {toml(value)}"
        width = max(map(len, lines.values()))
        return "\n".join(f"{line:<{width}}  # {term_in_words(TERMS[name])}" for name, line in lines.items())

    return rendered(
        "persona.toml.jinja",
        name=name,
        schema=schema,
        schema_file=file_of("persona"),
        key=key,
        terms=terms,
        about=lambda path: _comment(_schema_at(document, path)["description"]).removeprefix("# ").rstrip("\n"),
        bounds=lambda path: _bounds(_schema_at(document, path)),
        quantities=FUZZY_QUANTITIES,
        unit_of=unit_of,
    )


def check_persona(file: Path) -> Persona:
    """The persona in a file.

    Raises UsageError with every mistake, and with every source that is no evidence: the text of the template, or a
    word that stands for a text to come.
    """
    persona = read_document(file, Persona)
    template = Persona.model_validate(parse_toml(persona_template("any")))
    problems = []
    for number, source in enumerate(persona.sources):
        for key, remedy in _EVIDENCE.items():
            written = getattr(source, key)
            if written == getattr(template.sources[0], key) or _NOT_WRITTEN.match(written):
                problems.append(Problem(str(file), f"sources[{number}].{key}", "is a placeholder", remedy))
    if persona.description == template.description:
        problems.append(Problem(str(file), "description", "is the text of the template", "describe this driver"))
    if problems:
        raise UsageError(problems)
    return persona


def _schema_at(document: Any, path: str) -> Any:
    """The schema of a key by its path; a key without a description has that of its table."""
    node = document
    for key in path.split("."):
        inner = _resolved(document, node)
        node = _resolved(document, inner.get("items", inner))["properties"][key]
    return {**_resolved(document, node), **node}


def _resolved(document: Any, node: Any) -> Any:
    return document["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _bounds(node: Any) -> str:
    if "enum" in node:
        return f"one of {', '.join(map(toml, node['enum']))}"
    if "prefixItems" in node:  # an interval has two entries
        return ""
    ranges = [
        words.format(node[low], node[high]) for (low, high), words in _RANGES.items() if {low, high} <= node.keys()
    ]
    if ranges:
        named = "letters, digits and _, a letter first; " if node.get("pattern") == _NAME_PATTERN else ""
        return f"{named}{ranges[0]}"
    return ", ".join(words.format(node[bound]) for bound, words in _BOUNDS.items() if bound in node)


def _comment(text: str) -> str:
    unbroken = text.replace("Unit: ", "Unit:\N{NO-BREAK SPACE}")
    lines = textwrap.wrap(unbroken, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return "".join(f"# {line}\n" for line in lines).replace("\N{NO-BREAK SPACE}", " ")
