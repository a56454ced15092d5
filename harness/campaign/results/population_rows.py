"""The table `populations`: the games against a population, by the persona that drove in them."""

from __future__ import annotations

import pandas as pd

from harness.config.campaign import Campaign
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.people import people_in
from harness.evaluation.strategies import NaiveEgo, ReconfiguredEgo, RetrainedEgo, against_persona
from harness.evaluation.tables import joined
from harness.game.initial_state import member_in_episode
from harness.game.roles import NON_EGO

_SUMMARY_COLUMNS = [name for name in TABLES["populations"] if name not in ("arm", "population", "seed", "persona")]


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
            members = [
                [member_in_episode(shares, player, campaign.start_seed, int(episode)) for player in players]
                for episode in games["episode"]
            ]
            drivers = [", ".join(names[each] for each in of_game) for of_game in members]
            rows = summarise(games.assign(persona=drivers)).sort_values(["seed", "persona"], kind="stable")
            frames.append(rows[["arm", "seed", "persona", *_SUMMARY_COLUMNS]].assign(population=name))
    return joined("populations", frames)
