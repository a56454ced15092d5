"""Which versions the stages of a run were made by, and what to say where they are not the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def mixed_versions(stages: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Sentences for a run whose finished stages were not all made by the same versions; none for any other.

    `stages` are those of the manifest. What a stage was made by is not known of runs of before it was written down.
    """
    made_by = {name: _made_by(stage) for name, stage in stages.items() if stage.get("status") == "done"}
    known = {name: each for name, each in made_by.items() if each}
    groups: dict[str, list[str]] = {}
    of_kind: dict[str, set[str]] = {}  # a search is made by programs that have no part in an arm
    for name, each in known.items():
        of_kind.setdefault(_kind(stages[name]), set()).update(program for versions in each for program in versions)
    told = {
        name: {program: _told(each, program) for program in sorted(of_kind[_kind(stages[name])])}
        for name, each in known.items()
    }
    programs = sorted(set().union(*of_kind.values()))
    found = {program: {each[program] for each in told.values() if program in each} for program in programs}
    differ = [program for program in programs if len(found[program]) > 1]
    differ += [program for program in programs if program not in differ and any("then" in each for each in found[program])]
    if not differ:
        return []
    for name, versions in told.items():
        which = ", ".join(f"{program} {versions[program]}" for program in differ if program in versions)
        if which:
            groups.setdefault(which, []).append(name)
    return [
        "This run mixes versions: its numbers are not promised to be those of one version.",
        *(f"  by {which}: {', '.join(names)}" for which, names in groups.items()),
    ]


def _kind(stage: Mapping[str, Any]) -> str:
    return "reconfiguration" if stage.get("kind") == "reconfiguration" else ""


def _made_by(stage: Mapping[str, Any]) -> list[Mapping[str, str]]:
    versions = stage.get("versions")
    if not isinstance(versions, list) or not all(isinstance(each, Mapping) for each in versions):
        return []
    return versions


def _told(made_by: list[Mapping[str, str]], program: str) -> str:
    """A program's versions, in the order in which a stage met them."""
    return ", then ".join(dict.fromkeys(str(each.get(program, "of no known version")) for each in made_by))
