"""The facts below the title of a report: what was run, and how to run it again."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from harness.reports.numbers import steps_text


def facts(manifest: Mapping[str, Any], seeds: Sequence[int], personas: int) -> list[tuple[str, str]]:
    """The facts below the page's title, as label and value. `personas` is their number."""
    campaign = manifest.get("campaign", {})
    assessment, training = campaign.get("assessment", {}), campaign.get("training", {})
    ego = str(campaign.get("ego", {}).get("driver", ""))
    found = [
        ("Scene", str(campaign.get("scene", "")).rstrip("/").rsplit("/", 1)[-1]),
        ("Ego", str((manifest.get("ego_driver") or {}).get("in_words") or ego)),
        ("Rounds", "" if ego in ("", "learned") else rounds(manifest.get("stages", {}).values())),
        ("Personas", str(personas)),
        ("Training seeds", ", ".join(map(str, manifest.get("seeds", seeds)))),
        ("Games per arm and seed", f"{assessment['episodes']:,}" if "episodes" in assessment else ""),
        ("Players", "trained before" if campaign.get("policies") else ""),
        ("Training budget", f"{steps_text(training['steps'])} steps" if "steps" in training else ""),
        ("Significance", f"{assessment['significance']:g}" if "significance" in assessment else ""),
    ]
    return [(label, value) for label, value in found if value]


def made_by(manifest: Mapping[str, Any]) -> list[str]:
    """How the run was made: the version of the harness and the date of the last stage, where they are known."""
    version = manifest.get("versions", {}).get("harness")
    dates = [each["finished_on"] for each in manifest.get("stages", {}).values() if each.get("finished_on")]
    return [*([f"harness {version}"] if version else []), *([f"finished on {max(dates)}"] if dates else [])]


def command_of(manifest: Mapping[str, Any]) -> str:
    """The command that makes the run."""
    file = manifest.get("file") or f"{manifest.get('name', 'campaign')}.toml"
    return f"harness campaign {shlex.quote(str(file))}" + (" --quick" if manifest.get("quick") else "")


def rounds(stages: Iterable[Mapping[str, Any]]) -> str:
    """The rounds of an ego that is not trained."""
    if any(stage.get("kind") == "reconfiguration" for stage in stages):
        return "0, 1 and 2: this ego is not trained, but its parameters are tuned"
    return "0 and 1: this ego has nothing to train or to tune"
