"""The egos of several leagues, ranked by the games that all of them played."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from harness.campaign.results.league_games import LEAGUE_GAMES, games_in
from harness.config.campaign import Assessment
from harness.errors import UsageError
from harness.evaluation.comparisons.tied_ranks import GAME, PLAYER, league_ranks
from harness.evaluation.tables import read_csv, write_csv

RANKS = "league_ranks.csv"
SIGNIFICANCE = Assessment().significance


def rank_leagues(folder: Path) -> tuple[pd.DataFrame, Path]:
    """Rank the egos of the leagues in a folder, and write the table `league_ranks` there: the table, and its file.

    Raises UsageError if the leagues of the folder have fewer than two egos, if two of them have the same games of one
    ego, or if no game was played by all egos.
    """
    leagues = {file.parent.name: _games_of(file) for file in sorted(folder.glob(f"*/{LEAGUE_GAMES}"))}
    games = pd.concat(leagues.values(), ignore_index=True) if leagues else None
    if games is None or len(games[PLAYER].drop_duplicates()) < 2:
        found = ", ".join(leagues) or "none"
        raise UsageError.of(folder, "", f"has fewer than two egos: {found}", "play some: harness league --ego EGO")
    _check_egos(folder, leagues)
    table = league_ranks(games, SIGNIFICANCE)
    if not table["games"].any():
        remedy = "play the same scenes: harness league --scenes"
        raise UsageError.of(folder, "", "no game was played by the egos of all leagues", remedy)
    write_csv(table, folder / RANKS)
    return table, folder / RANKS


def _check_egos(folder: Path, leagues: Mapping[str, pd.DataFrame]) -> None:
    """Raises UsageError if the same games are of one ego in two leagues."""
    places: dict[str, str] = {}
    games = pd.concat([each.assign(league=name) for name, each in leagues.items()], ignore_index=True)
    twice = games[games.duplicated([*GAME, *PLAYER], keep=False)]
    for ego, league in twice[["ego", "league"]].drop_duplicates().itertuples(index=False):
        if (first := places.setdefault(ego, league)) != league:
            message = f"{first} and {league} have the same games of an ego {ego!r}"
            raise UsageError.of(folder, "", message, "remove one of the two, or give the ego's file another name")


def _games_of(file: Path) -> pd.DataFrame:
    try:
        return games_in(read_csv(file))
    except (LookupError, ValueError) as error:
        message, remedy = "is not the table of a league", "run the league again, or remove its folder"
        raise UsageError.of(file, "", message, remedy) from error
