"""Evaluating a run: every number of its tables and of its report, from what the run holds. Reads and writes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.results.drawn_starts import people_drive
from harness.campaign.results.matchups import matchups_of
from harness.campaign.results.read_run import ReadRun
from harness.campaign.results.run_people import by_who_drove, declared_of, failures_by_trait, is_played, questions_of
from harness.campaign.storage.learned import judged
from harness.campaign.storage.manifest import is_tuned
from harness.config.campaign import Campaign
from harness.evaluation.comparisons.acceptance_checks import Evidence, judge
from harness.evaluation.comparisons.altered_egos import compare_perception, compare_shielded
from harness.evaluation.comparisons.comparison import compare, games_by_arm
from harness.evaluation.comparisons.over_trainings import compare_over_trainings
from harness.evaluation.comparisons.preventability import count_prevented
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import Goals, goals_alone
from harness.evaluation.game_theory.findings import GameFindings, find
from harness.evaluation.realism import OF_DRIVERS, OF_RIDERS, OF_WALKERS, HumanFigure, realism
from harness.evaluation.tables import table_of
from harness.reports.run_tables import RunTables
from harness.road.scene.open_scene import OpenScene


def evaluated(run: ReadRun) -> RunTables:
    """What a run's report is made of, without its replays."""
    read, campaign = run.tables, run.campaign
    entries = judged(run.manifest["stages"], campaign, run.stages, _goals(run))
    found = realism(read.conduct, read.arms, declared_of(run), _figures_of_people(run.scene))
    asked, significance = questions_of(run, found), campaign.assessment.significance
    played = [each for each in asked if is_played(each, run)]
    tables = replace(
        read,
        manifest={**run.manifest, "stages": entries},
        summary=summarise(read.episodes),
        comparisons=compare(played, read.episodes, significance, planned=len(asked)),
        over_trainings=compare_over_trainings(asked, read.episodes, significance),
        training=_with_ends(read.training, entries),
        shields=compare_shielded(read.arms, read.episodes),
        perception=compare_perception(read.arms, read.episodes, len(campaign.seeds)),
        realism=found,
        game=_game(run),
        populations=by_who_drove(campaign, read.episodes),
        preventability=count_prevented(read.reference_drivers, read.episodes),
        **failures_by_trait(run),
    )
    return with_acceptance(tables, campaign, is_judged=run.is_judged)


def with_acceptance(tables: RunTables, campaign: Campaign, is_judged: bool) -> RunTables:
    """The tables with the checks of the campaign's bounds, if it has some. `is_judged`: reference drivers judged the
    failures."""
    acceptance = campaign.acceptance
    if acceptance is None:
        return tables
    evidence = Evidence(
        arms=tables.arms,
        episodes=tables.episodes,
        summary=tables.summary,
        comparisons=tables.comparisons,
        gaps=tables.game.gaps if tables.game is not None else table_of("gaps"),
        preventability=tables.preventability if is_judged else None,
    )
    personas = [*tables.manifest["personas"], *campaign.mixed_people]
    return replace(tables, acceptance=judge(acceptance.bounds, acceptance.ego, personas, campaign.seeds, evidence))


def csv_tables(run: ReadRun, tables: RunTables) -> dict[str, pd.DataFrame]:
    """The tables that the run folder gets, by the names of their files."""
    names = ["episodes", "training", "summary", "comparisons"]
    names += ["conduct", "causes", "manoeuvres", "realism", "undecided"]
    names += ["attribution"] if run.campaign.attribution is not None else []
    names += ["reference_drivers", "takeovers", "preventability"] if run.is_judged else []
    names += ["over_trainings"] if len(tables.over_trainings) else []
    names += ["populations"] if run.campaign.population else []
    names += ["reconfiguration"] if is_tuned(run.manifest) else []
    names += ["shields"] if run.campaign.ego.shield is not None else []
    names += ["perception"] if run.campaign.ego.perception is not None else []
    names += ["selections"] if len(tables.selections) else []
    found = {name: getattr(tables, name) for name in names}
    return found | (tables.game.tables if tables.game is not None else {})


def _figures_of_people(scene: OpenScene) -> tuple[HumanFigure, ...]:
    if people_drive(scene):
        return OF_DRIVERS
    return OF_WALKERS if all(each.on_foot for each in scene.document.non_ego) else OF_RIDERS


def _goals(run: ReadRun) -> dict[str, Goals]:
    """How often the player of each arm without people reached its goal, by the arm's stage."""
    games = games_by_arm(run.tables.episodes)
    alone = [each for each in run.stages if isinstance(each, AssessmentStage) and each.is_without_people]
    return {each.id: goals_alone(games.get((each.name, each.seed)), "ego" if each.ego else "non_ego") for each in alone}


def _with_ends(training: pd.DataFrame, entries: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """The learning curves, with the judgement of the manifest in the last row of each training."""
    last = training.drop_duplicates(["stage", "seed"], keep="last")
    stopped = {(each["name"], each["seed"]): each.get("stopped") for each in entries.values()}
    ends = [stopped[row.stage, row.seed] for row in last.itertuples()]
    return training.assign(stopped=pd.Series(ends, index=last.index, dtype=object).reindex(training.index).fillna(""))


def _game(run: ReadRun) -> GameFindings | None:
    """The findings on the game between strategies, from the finished arms of a run; None where it is not asked."""
    game = matchups_of(run.campaign, run.manifest["personas"], run.done, is_tuned(run.manifest))
    if game is None:
        return None
    significance = run.campaign.assessment.significance
    return find(game.pairings, game.responses, game.training_personas, run.tables.episodes, significance)
