"""How a run was made: the facts below the title, the command, and the versions of its stages."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from harness.reports.numbers import percent, steps_text

if TYPE_CHECKING:
    from rich.console import Console

QUICK = "Quick run: trainings are shortened; not for conclusions."
MIXED_VERSIONS = "This run mixes versions: its results may differ from those of a single version."
THEN = ", then "


def facts(manifest: Mapping[str, Any], seeds: Sequence[int], personas: int) -> list[tuple[str, str]]:
    """The facts below the page's title, as label and value. `personas` is their number."""
    campaign = manifest.get("campaign", {})
    assessment, training = campaign.get("assessment", {}), campaign.get("training", {})
    ego = str(campaign.get("ego", {}).get("driver", ""))
    found = [
        ("Scene", scene_of(manifest)),
        ("Ego", ego_of(manifest)),
        ("Perception of the ego", perception_of(campaign)),
        ("Rounds", "" if ego in ("", "learned") else rounds(manifest.get("stages", {}).values())),
        ("Personas", str(personas)),
        ("Training seeds", ", ".join(map(str, manifest.get("seeds", seeds)))),
        ("Games per arm and seed", f"{assessment['episodes']:,}" if "episodes" in assessment else ""),
        ("Players", "trained before" if campaign.get("policies") else ""),
        ("Training budget", f"{steps_text(training['steps'])} steps" if "steps" in training else ""),
        ("Significance", f"{assessment['significance']:g}" if "significance" in assessment else ""),
    ]
    return [(label, value) for label, value in found if value]


def scene_of(manifest: Mapping[str, Any]) -> str:
    return str(manifest.get("campaign", {}).get("scene", "")).rstrip("/").rsplit("/", 1)[-1]


def ego_of(manifest: Mapping[str, Any]) -> str:
    ego = str(manifest.get("campaign", {}).get("ego", {}).get("driver", ""))
    return str((manifest.get("ego_driver") or {}).get("in_words") or ego)


def perception_of(campaign: Mapping[str, Any]) -> str:
    """The perception errors of the ego; empty if it has none."""
    document = campaign.get("ego", {}).get("perception") or {}
    return f"{document['name']}, with errors" if "name" in document else ""


def finished_on(manifest: Mapping[str, Any]) -> str:
    """The date on which the last stage of a run ended; empty before the first."""
    dates = [each["finished_on"] for each in manifest.get("stages", {}).values() if each.get("finished_on")]
    return max(dates, default="")


def made_by(manifest: Mapping[str, Any]) -> list[str]:
    """How the run was made: the version of the harness and the date of the last stage, where they are known."""
    version = manifest.get("versions", {}).get("harness")
    date = finished_on(manifest)
    return [*([f"harness {version}"] if version else []), *([f"finished on {date}"] if date else [])]


def command_of(manifest: Mapping[str, Any]) -> str:
    file = manifest.get("file") or f"{manifest.get('name', 'campaign')}.toml"
    return f"harness campaign {shlex.quote(str(file))}" + (" --quick" if manifest.get("quick") else "")


def rounds(stages: Iterable[Mapping[str, Any]]) -> str:
    if any(stage.get("kind") == "reconfiguration" for stage in stages):
        return "0, 1 and 2: this ego is not trained, but its parameters are tuned"
    return "0 and 1: this ego has nothing to train or to tune"


def asked_alone(manifest: Mapping[str, Any]) -> str:
    """What the campaign asks of players alone; empty if nothing."""
    asked = manifest.get("campaign", {}).get("competence", {})
    names = {"ego_goal_share": "an ego", "non_ego_goal_share": "a non-ego"}
    bounds = [f"{percent(asked[key])} of {player}" for key, player in names.items() if asked.get(key)]
    if not bounds:
        return ""
    return (
        f"A question is answered only if its players reach their goals alone in a share of games: {', '.join(bounds)}. "
        "A naive ego that learned beside an ordinary road user has to do so there, too."
    )


def mixed_versions(stages: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Sentences for a run whose finished stages were not all made with the same versions; none for any other run.

    `stages` are those of the manifest. A program is compared among the stages that used it.
    """
    done = {name: stage.get("versions") for name, stage in stages.items() if stage.get("status") == "done"}
    texts = {
        name: {program: _text(versions, program) for program in sorted(set().union(*versions))}
        for name, versions in done.items()
        if isinstance(versions, list)
    }
    found: dict[str, set[str]] = {}
    for by_program in texts.values():
        for program, version in by_program.items():
            found.setdefault(program, set()).add(version)
    mixed = [program for program, each in sorted(found.items()) if len(each) > 1 or THEN in next(iter(each))]
    groups: dict[str, list[str]] = {}
    for name, text in texts.items():
        if group := ", ".join(f"{program} {text[program]}" for program in mixed if program in text):
            groups.setdefault(group, []).append(name)
    lines = [f"  by {group}: {', '.join(names)}" for group, names in groups.items()]
    return [MIXED_VERSIONS, *lines] if mixed else []


def _text(versions: Sequence[Mapping[str, str]], program: str) -> str:
    """A program's versions, in the order in which a stage used them."""
    return THEN.join(dict.fromkeys(str(each[program]) for each in versions if program in each))


def warn(sentences: Sequence[str], console: Console) -> None:
    for sentence in sentences:
        console.print(sentence, style="yellow", highlight=False, markup=False, soft_wrap=True)
