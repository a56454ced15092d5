"""The comparison of two run folders: a page, and lines for the terminal."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.campaign.results.read_run import episodes_of
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.comparisons.run_comparison import differences_of
from harness.reports.comparison_page import ComparedRow, compared_rows, render_comparison


def compare_runs(before: Path, after: Path) -> tuple[list[ComparedRow], str]:
    """The differences between the games of two run folders, and the page that shows them. Raises UsageError for a
    folder that is no run, one without games, and results that were changed."""
    folders = [RunFolder(run) for run in (before, after)]
    manifests = [folder.manifest() for folder in folders]
    games = [episodes_of(folder) for folder in folders]
    scenes = [_scene(manifest) for manifest in manifests]
    first, second = (manifest["seeds"][0] for manifest in manifests)  # starts are drawn from them
    same_starts = bool(scenes[0]) and scenes[0] == scenes[1] and first == second
    significance = manifests[1]["campaign"]["assessment"]["significance"]
    rows = compared_rows(differences_of(games[0], games[1], same_starts), significance)
    runs = list(zip((str(before), str(after)), manifests, strict=True))
    return rows, render_comparison(runs, rows, same_starts=same_starts, significance=significance)


def _scene(manifest: Mapping[str, Any]) -> dict[str, str]:
    scene = posixpath.basename(posixpath.normpath(manifest["campaign"]["scene"]))
    return {
        posixpath.basename(name): digest
        for name, digest in manifest["hashes"].items()
        if posixpath.basename(posixpath.dirname(name)) == scene
    }
