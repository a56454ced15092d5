"""The comparison of run folders in their order: a page, and what the terminal shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path, PurePath
from typing import Any

from harness.campaign.plan.stages import arms_of
from harness.campaign.results.read_run import episodes_of
from harness.campaign.storage.manifest import digests_read, planned
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.comparisons.run_comparison import changed_games, differences_of, failure_rates
from harness.reports.comparison_page import ComparedRun, Comparison, Transition, compared_rows
from harness.reports.history_figures import histories


def compare_runs(folders: Sequence[Path], addresses: Sequence[str]) -> Comparison:
    """The comparison of run folders, each with the one before it. `addresses` are those of their reports, empty for a
    run without one.

    Raises UsageError for fewer than two folders, a folder that is no run, one without games, and results that were
    changed.
    """
    if len(folders) < 2:
        raise UsageError.of("compare", str(folders[0]), "is the only run", "name at least two, in their order")
    runs = [RunFolder(each) for each in folders]
    manifests = [each.manifest() for each in runs]
    games = [episodes_of(each) for each in runs]
    starts = [_starts(manifest) for manifest in manifests]
    changes = changed_games(games, starts)
    compared = [
        ComparedRun(name=str(folder), label=label, address=address, manifest=manifest)
        for folder, label, address, manifest in zip(folders, _labels(folders), addresses, manifests, strict=True)
    ]
    transitions = []
    for place, (before, after) in enumerate(pairwise(range(len(runs)))):
        same_starts = starts[before] == starts[after]
        significance = manifests[after]["campaign"]["assessment"]["significance"]
        rows = compared_rows(differences_of(games[before], games[after], same_starts), significance)
        transitions.append(
            Transition(
                before=compared[before],
                after=compared[after],
                same_starts=same_starts,
                significance=significance,
                rows=rows,
                changes=changes[place],
            )
        )
    found = histories([arms_of(planned(each)) for each in manifests], [failure_rates(each) for each in games])
    return Comparison(runs=compared, transitions=transitions, histories=found)


def _labels(folders: Sequence[Path]) -> list[str]:
    """The folders' names; where two have the same name, with the names of the folders that they are in, or numbered."""
    places = [each.absolute() for each in folders]
    names, longer = [each.name for each in places], [f"{each.parent.name}/{each.name}" for each in places]
    for found in (names, longer):
        if len({*found}) == len(found):
            return found
    return [f"{number}. {name}" for number, name in enumerate(names, 1)]


def _starts(manifest: Mapping[str, Any]) -> tuple[object, ...]:
    """What the starts of a run's games depend on: the scene's files, and the seed from which they are drawn."""
    scene = PurePath(manifest["campaign"]["scene"]).name
    return (*sorted(digests_read(manifest).get(scene, {}).items()), manifest["seeds"][0])
