"""What the page says before its first section: what the run is, and what is wrong with it."""

from __future__ import annotations

from typing import Any

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.unplayed_games import reasons_of, were_played
from harness.reports.learning import stopped
from harness.reports.provenance import QUICK, command_of, facts, made_by, mixed_versions
from harness.reports.run_tables import RunTables


def header(tables: RunTables) -> dict[str, Any]:
    """What the run is: its campaign, command and facts."""
    manifest = tables.manifest
    return {
        "command": command_of(manifest),
        "made_by": made_by(manifest),
        "name": manifest.get("name", "campaign"),
        "facts": facts(manifest, tables.seeds, len(tables.personas)),
        "quick": QUICK if manifest.get("quick") else "",
        "trained_before": tables.campaign.get("policies") or "",
        "several_seeds": tables.several_seeds,
        "change": tables.change,
    }


def troubles(tables: RunTables) -> dict[str, Any]:
    """The banners: what is unfinished, what could not be played, and what makes the numbers mean less."""
    errored = tables.episodes[~were_played(tables.episodes)]
    return {
        "from_tables": tables.is_from_tables,
        "unfinished": tables.unfinished,
        "not_learned": [
            (name, stopped(each)) for name, each in tables.stages.items() if each.get("stopped") == DID_NOT_LEARN
        ],
        "mixed": mixed_versions(tables.stages),
        "errored": errored.groupby(["arm", "seed"], sort=False).size().items(),
        "errors": len(errored),
        "varying": list(tables.manifest.get("varying_drivers", {}).items()),
        "learned_elsewhere": list(tables.manifest.get("learned_elsewhere", {}).items()),
        "error_reasons": reasons_of(errored["error"]),
        "ego_games": int(tables.episodes["ego_failed"].notna().sum()),
    }
