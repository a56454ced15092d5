"""The check of a persona: the document, and whether its evidence is more than a placeholder."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from harness.cli.persona_template import persona_template
from harness.config.persona import Persona, Source
from harness.config.toml_reading import read_document
from harness.errors import Problem, UsageError

if sys.version_info >= (3, 11):
    import tomllib
else:  # pragma: no cover
    import tomli as tomllib

_NOT_WRITTEN = re.compile(r"\W*(todo|tbd|fixme|xxx+|placeholder|lorem ipsum|unknown|none|n/?a|example)\b|\W*$", re.I)


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
