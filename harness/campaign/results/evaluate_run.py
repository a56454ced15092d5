"""Evaluating a run: every number of its tables and of its report, from what the run holds. Reads and writes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import pandas as pd

from harness.campaign.plan.stages import AssessmentStage, TrainingStage, stage_id
from harness.campaign.results.matchups import matchups_of
from harness.campaign.results.read_run import ReadRun
from harness.campaign.results.realism_gate import declared_of, questions_of
from harness.campaign.storage.learned import judged
from harness.campaign.storage.manifest import is_tuned
from harness.config.campaign import Campaign
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.acceptance_checks import Evidence, judge
from harness.evaluation.comparisons.comparison import compare, games_by_arm
from harness.evaluation.comparisons.preventability import count_prevented
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import Goals, goals_alone
from harness.evaluation.game_theory.findings import GameFindings, find
from harness.evaluation.people import people_in
from harness.evaluation.realism import realism
from harness.evaluation.strategies import Arm, NaiveEgo, ReconfiguredEgo, RetrainedEgo, against_persona
from harness.evaluation.tables import joined, table_of
from harness.game.initial_state import member_in_episode
from harness.game.roles import NON_EGO
from harness.reports.run_tables import RunTables

_SUMMARY_COLUMNS = [name for name in TABLES["populations"] if name not in ("arm", "population", "seed", "persona")]


def evaluated(run: ReadRun) -> RunTables:
    """What a run's report is made of, without its replays."""
    entries = judged(run.manifest["stages"], run.campaign, run.stages, _goals(run))
    manifest = {**run.manifest, "stages": entries}
    prevented = {}
    if run.reference_drivers is not None:
        counts = count_prevented(run.reference_drivers, run.episodes)
        prevented = {"reference_drivers": run.reference_drivers, "preventability": counts}
    found = realism(run.conduct, _arms(run), declared_of(run), people_drive=_people_drive(run))
    tables = RunTables(
        manifest=manifest,
        arms=_arms(run),
        strategies={stage.name: stage.strategy for stage in run.stages if isinstance(stage, TrainingStage)},
        episodes=run.episodes,
        summary=summarise(run.episodes),
        comparisons=compare(questions_of(run, found), run.episodes, run.campaign.assessment.significance),
        training=_with_ends(run.training, entries),
        reconfiguration=run.reconfiguration,
        manoeuvres=run.manoeuvres,
        causes=run.causes,
        realism=found,
        game=_game(run),
        non_ego_drives=_people_drive(run),
        populations=by_who_drove(run.campaign, run.episodes),
        **prevented,
    )
    asked = run.campaign.acceptance
    if asked is None:
        return tables
    evidence = Evidence(
        arms=tables.arms,
        episodes=tables.episodes,
        summary=tables.summary,
        comparisons=tables.comparisons,
        gaps=tables.game.gaps if tables.game is not None else table_of("gaps"),
        preventability=tables.preventability if run.reference_drivers is not None else None,
    )
    personas = [*run.manifest["personas"], *run.campaign.mixed_people]
    return replace(tables, acceptance=judge(asked.bounds, asked.ego, personas, run.campaign.seeds, evidence))


def csv_tables(run: ReadRun, tables: RunTables) -> dict[str, pd.DataFrame]:
    """The tables that the run folder gets, by the names of their files."""
    names = ["episodes", "training", "summary", "comparisons", "causes", "manoeuvres", "realism"]
    names += ["reference_drivers", "preventability"] if run.reference_drivers is not None else []
    names += ["populations"] if run.campaign.population else []
    names += ["reconfiguration"] if is_tuned(run.manifest) else []
    found = {"conduct": run.conduct} | {name: getattr(tables, name) for name in names}
    return found | (tables.game.tables if tables.game is not None else {})


def _arms(run: ReadRun) -> dict[str, Arm]:
    return {stage.name: stage.arm for stage in run.stages if isinstance(stage, AssessmentStage)}


def _people_drive(run: ReadRun) -> bool:
    return all(each.drives for each in run.scene.document.players[1:])


def _goals(run: ReadRun) -> dict[str, Goals]:
    """How often the player of each arm without another player reached its goal, by the arm's stage."""
    games = games_by_arm(run.episodes)
    alone = [each for each in run.stages if isinstance(each, AssessmentStage) and not all(each.sides)]
    return {each.id: goals_alone(games.get((each.name, each.seed)), "ego" if each.ego else "non_ego") for each in alone}


def _with_ends(training: pd.DataFrame, entries: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """The learning curves, with the judgement of the manifest in the last row of each training."""
    last = training.drop_duplicates(["stage", "seed"], keep="last")
    ends = [entries[stage_id(str(row.stage), row.seed)].get("stopped") for row in last.itertuples()]
    return training.assign(stopped=pd.Series(ends, index=last.index, dtype=object).reindex(training.index).fillna(""))


def _game(run: ReadRun) -> GameFindings | None:
    """The findings on the game between strategies, from the finished arms of a run; None where it is not asked."""
    game = matchups_of(run.campaign, run.manifest["personas"], run.done, is_tuned(run.manifest))
    if game is None:
        return None
    significance = run.campaign.assessment.significance
    return find(game.pairings, game.responses, game.training_personas, run.episodes, significance)


def by_who_drove(campaign: Campaign, episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each arm against a population, seed and persona that drove in it, the table `populations`. With several
    people, the personas in their places.

    The draw is repeated here: it depends on the place, the seed of the starts and the episode only.
    """
    frames = []
    for population in campaign.population:
        name, names, shares = population.name, list(population.shares), list(population.shares.values())
        egos = (NaiveEgo(), RetrainedEgo(against=name), ReconfiguredEgo(against=name))
        for arm in [against_persona(ego, name).name for ego in egos]:
            games = episodes[episodes["arm"] == arm]
            players = range(NON_EGO, NON_EGO + len(people_in(games.columns)))
            draw = partial(member_in_episode, shares, seed=campaign.start_seed)
            drivers = [
                ", ".join(names[draw(player=player, episode=int(episode))] for player in players)
                for episode in games["episode"]
            ]
            rows = summarise(games.assign(persona=drivers)).sort_values(["seed", "persona"], kind="stable")
            frames.append(rows[["arm", "seed", "persona", *_SUMMARY_COLUMNS]].assign(population=name))
    return joined("populations", frames)
