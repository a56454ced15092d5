"""A population's arms by who drove: each game had one of its people, drawn when it started."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from harness.config.campaign import Campaign, Population
from harness.environments.rollout import parts_of
from harness.evaluation.strategies import Arm, NaiveEgo, PersonaNonEgo, ReconfiguredEgo, RetrainedEgo
from harness.evaluation.summary import summarise
from harness.evaluation.tables import POPULATION_COLUMNS, typed
from harness.game.initial_state import draw_member
from harness.game.state import NON_EGO

_OF_SUMMARY = [name for name in POPULATION_COLUMNS if name not in ("arm", "population", "seed", "persona")]


def by_who_drove(campaign: Campaign, episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each arm against a population, seed and persona who drove in it, with `POPULATION_COLUMNS`.

    Who drove is what was drawn when the game was played: it hangs on the arm's seed and the episode alone.
    """
    found = [_of(each, arm, games) for each in campaign.population for arm, games in _arms_of(each, episodes)]
    return typed(pd.concat(found, ignore_index=True) if found else pd.DataFrame(columns=list(POPULATION_COLUMNS)))


def _arms_of(population: Population, episodes: pd.DataFrame) -> Iterable[tuple[str, pd.DataFrame]]:
    name = population.name
    for ego in (NaiveEgo(), RetrainedEgo(against=name), ReconfiguredEgo(against=name)):
        arm = Arm(ego=ego, non_ego=PersonaNonEgo(persona=name)).name
        games = episodes[episodes["arm"] == arm]
        if len(games):
            yield arm, games


def _of(population: Population, arm: str, games: pd.DataFrame) -> pd.DataFrame:
    names, shares = list(population.shares), list(population.shares.values())
    drove = [
        names[draw_member(shares, NON_EGO, *parts_of(int(seed), int(episode)))]
        for seed, episode in zip(games["seed"], games["episode"], strict=True)
    ]
    rows = summarise(games.assign(persona=drove)).sort_values(["seed", "persona"], kind="stable")
    return rows[["arm", "seed", "persona", *_OF_SUMMARY]].assign(population=population.name)
