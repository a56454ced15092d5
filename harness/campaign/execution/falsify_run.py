"""Falsification of a run's ego: learned people from random starts, and searchers of starts and ordinary drivers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from harness.assessment.conflict_replay import Collision, ConflictReplay, collision_of
from harness.assessment.continuation import Continuation
from harness.assessment.falsification import FIRST_EPISODE, Searcher, fails, falsify
from harness.assessment.rollout import Game
from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.run_players import RunPlayers
from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.planned_drivers import SumoDriven
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.results.read_run import episodes_of
from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.reference_drivers import REFERENCES
from harness.errors import UsageError
from harness.evaluation.comparisons.comparison import games_by_arm
from harness.evaluation.comparisons.games_to_failure import (
    FAILURE,
    SearchResult,
    falsification_table,
    searches_table,
)
from harness.evaluation.competence import gate
from harness.evaluation.strategies import PersonaNonEgo
from harness.evaluation.tables import write_csv
from harness.files import make_folder

NAIVE_ARMS = "naive_vs_"


@dataclass(frozen=True, kw_only=True)
class PlannedSearch:
    stage: AssessmentStage
    searcher: Searcher
    learned: bool


def planned_searches(folder: RunFolder, players: RunPlayers, arms: Sequence[str], seed: int) -> list[PlannedSearch]:
    """The searches of the arms, by default of those of the naive ego in which people are as their personas say: learned
    people play from random starts, and where SUMO drives for the people each searcher searches. Raises UsageError where
    the run has no such arm, none of one of the two kinds, or a player that can't drive the scene alone."""
    of_naive = [each for each in players.arms() if each.seed == seed and each.name.startswith(NAIVE_ARMS)]
    named = arms or [each.name for each in of_naive if not _exchanges_a_trait(each)]
    stages = [players.arm(name, seed) for name in named]
    games = games_by_arm(episodes_of(folder))
    for stage in stages:
        if reason := gate(alone_bounds(players.document, stage.arm), seed, games)["reason"]:
            raise UsageError.of(folder.path, stage.name, reason, "name arms of players that can drive")
    by_sumo = [all(isinstance(each, SumoDriven) for each in stage.non_ego) for stage in stages]
    if all(by_sumo) or not any(by_sumo):
        kind = "learned people" if all(by_sumo) else "an ordinary driver"
        raise UsageError.of("ARM", " ".join(named), f"no arm has {kind}", "name arms of both, as naive_vs_sumo is one")
    return [
        PlannedSearch(stage=stage, searcher=searcher, learned=not sumo)
        for stage, sumo in zip(stages, by_sumo, strict=True)
        for searcher in (Searcher if sumo else (Searcher.RANDOM,))
    ]


def _exchanges_a_trait(stage: AssessmentStage) -> bool:
    """Whether a person of an arm has a trait of another persona (`[attribution]`): it never drives alone."""
    return isinstance(stage.arm.non_ego, PersonaNonEgo) and stage.arm.non_ego.borrowed is not None


def carry_out_searches(
    players: RunPlayers,
    searches: Sequence[PlannedSearch],
    *,
    games: int,
    repeats: int,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Iterator[SearchResult]:
    """Carry out the searches, each several times. `on_progress` gets the games played and all games.

    Raises SimulationError, StageFailed and UsageError.
    """
    played, total = 0, len(searches) * repeats * games
    for search in searches:
        arm = players.seated(search.stage)
        failures: list[list[Game]] = [[] for _ in range(repeats)]
        for repeat, game in falsify(arm, search.searcher, games=games, repeats=repeats):
            if fails(game):
                failures[repeat].append(game)
            played += 1
            on_progress(played, total)
        for repeat, failed in enumerate(failures):
            first = FIRST_EPISODE + repeat * games
            yield SearchResult(
                arm=arm.name,
                seed=search.stage.seed,
                searcher=search.searcher.value,
                learned=search.learned,
                repeat=repeat,
                games=games,
                found={
                    criterion: [episode - first + 1 for episode in episodes]
                    for criterion, episodes in _by_criterion(arm, failed).items()
                },
            )


def write_searches(
    results: Sequence[SearchResult], folder: Path, significance: float
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Write the tables `searches` and `falsification` into a folder; both."""
    searches, found = searches_table(results), falsification_table(results, significance)
    make_folder(folder)
    write_csv(searches, folder / "searches.csv")
    write_csv(found, folder / "falsification.csv")
    return searches, found


def _by_criterion(arm: SeatedArm, failures: Sequence[Game]) -> dict[str, list[int]]:
    """The episodes of all failures, and of those that each reference driver prevents from the conflict on."""
    collisions: list[Collision] = []
    for game in failures:
        episode = int(game.played["episode"])
        collision = collision_of(pd.DataFrame(game.trace), arm.scene, episode, Continuation.IN_ITS_PLACE)
        if collision is not None:
            collisions.append(collision)
    takeovers = ConflictReplay(arm.scene, collisions, arm.seed).takeovers()
    prevented = {
        name: [each.episode for each, takeover in zip(collisions, takeovers[name], strict=True) if takeover.prevented]
        for name in REFERENCES
    }
    return {FAILURE: [int(game.played["episode"]) for game in failures], **prevented}
