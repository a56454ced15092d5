"""Carrying out a parameter search: its table, and the driver that it found, as a document for campaigns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.stages import SearchStage
from harness.campaign.storage.versions import versions_since
from harness.campaign.trained_policies import DRIVER
from harness.config.tunable import Tunable
from harness.errors import StageFailed
from harness.evaluation.tables import table_of, write_csv
from harness.files import make_folder, write_atomically
from harness.road.scene.open_scene import OpenScene
from harness.training.parameter_search import SearchSpec, Trial, best, run_search, version_of_search


def carry_out_search(stage: SearchStage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Carry out a search; the facts, and the files of the driver and of the table.

    Raises as `PlayerFactory.player` does, StageFailed where the ego can't play.
    """
    context = run.context
    spec = SearchSpec(
        scene=scene,
        driver=context.external_driver(),
        persona=context.ego_persona,
        people=PlayerFactory(context=context, scene=scene).people(stage.opponent),
        settings=context.document.reconfiguration,
        parts=("reconfiguration", stage.seed, stage.name),
    )
    file = context.folder.work(stage.id) / "trials.json"
    versions = versions_since(file, version_of_search())
    try:
        trials = run_search(spec, file, run.on_progress, run.on_start)
    except StageFailed as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    unplayed = sum(each.mean_payoff is None for each in trials)
    facts = {"trials": len(trials), "trials_unplayed": unplayed, "chosen_trial": best(trials), "versions": versions}
    found, table = context.folder.policy(stage.id), file.with_name("reconfiguration.csv")
    _write_driver(stage, spec, trials, found)
    labels = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed}
    _write_table(trials, spec.driver.searched, labels, table)
    return facts, [found / DRIVER, table]


def _write_driver(stage: SearchStage, spec: SearchSpec, trials: Sequence[Trial], folder: Path) -> None:
    chosen = best(trials)
    first, found = trials[0], trials[chosen]
    comments = [
        f"{spec.driver.in_words}, reconfigured against the persona {stage.persona}, seed {stage.seed}.",
        f"Found in {len(trials)} trials of {spec.settings.games} games each, as trial {chosen}: mean payoff "
        f"{found.mean_payoff:.4g} instead of {first.mean_payoff:.4g}.",
        "A campaign takes this file as [ego] driver; paths in it are relative to its folder.",
    ]
    driver = spec.driver.tuned(found.values) if chosen else spec.driver
    make_folder(folder)
    write_atomically(folder / DRIVER, driver.document_in(folder).toml(*comments).encode())


def _write_table(trials: Sequence[Trial], searched: Sequence[Tunable], labels: Mapping[str, Any], file: Path) -> None:
    chosen, best_payoff = best(trials), float("-inf")
    rows = []
    for number, trial in enumerate(trials):
        best_payoff = max(best_payoff, best_payoff if trial.mean_payoff is None else trial.mean_payoff)
        results = {
            "mean_payoff": trial.mean_payoff,
            "failure_rate": trial.failure_rate,
            "best_payoff": best_payoff,
            "chosen": number == chosen,
            "error": trial.error,
        }
        for key, low, high in searched:
            tried = {"trial": number, "parameter": key, "value": trial.values[key], "low": low, "high": high}
            rows.append({**labels, **tried, **results})
    write_csv(table_of("reconfiguration", rows), file)
