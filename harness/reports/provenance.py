"""The versions that the stages of a run were made with, and the warning for a run that mixes versions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

MIXED_VERSIONS = "This run mixes versions: its results may differ from those of a single version."
UNKNOWN_VERSION = "of no known version"


def mixed_versions(stages: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Sentences for a run whose finished stages were not all made with the same versions; none for any other run.

    `stages` are those of the manifest.
    """
    recorded = {name: _versions(stage) for name, stage in stages.items() if stage.get("status") == "done"}
    known = {name: versions for name, versions in recorded.items() if versions}
    programs_of_kind: dict[str, set[str]] = {}  # a search uses programs that an arm does not use
    for name, versions in known.items():
        programs_of_kind.setdefault(_kind(stages[name]), set()).update(program for each in versions for program in each)
    texts = {
        name: {program: _text(versions, program) for program in sorted(programs_of_kind[_kind(stages[name])])}
        for name, versions in known.items()
    }
    programs = sorted(set().union(*programs_of_kind.values()))
    different = {program: {each[program] for each in texts.values() if program in each} for program in programs}
    mixed = [program for program in programs if len(different[program]) > 1]
    mixed += [
        program for program in programs if program not in mixed and any("then" in each for each in different[program])
    ]
    if not mixed:
        return []
    groups: dict[str, list[str]] = {}
    for name, text in texts.items():
        group = ", ".join(f"{program} {text[program]}" for program in mixed if program in text)
        if group:
            groups.setdefault(group, []).append(name)
    return [MIXED_VERSIONS, *(f"  by {group}: {', '.join(names)}" for group, names in groups.items())]


def warn(sentences: Sequence[str], console: Console) -> None:
    """Print warnings."""
    for sentence in sentences:
        console.print(sentence, style="yellow", highlight=False, markup=False, soft_wrap=True)


def _kind(stage: Mapping[str, Any]) -> str:
    return "reconfiguration" if stage.get("kind") == "reconfiguration" else ""


def _versions(stage: Mapping[str, Any]) -> list[Mapping[str, str]]:
    versions = stage.get("versions")
    if not isinstance(versions, list) or not all(isinstance(each, Mapping) for each in versions):
        return []
    return versions


def _text(versions: list[Mapping[str, str]], program: str) -> str:
    """A program's versions, in the order in which a stage used them."""
    return ", then ".join(dict.fromkeys(str(each.get(program, UNKNOWN_VERSION)) for each in versions))
