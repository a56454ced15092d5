"""The egos of several leagues, ranked by the games that all of them played."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from harness.campaign.plan.stages import arms_of
from harness.campaign.results.league_rows import person_in, shield_in
from harness.campaign.storage.manifest import campaign_in, planned
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.config.campaign import Assessment
from harness.errors import UsageError
from harness.evaluation.comparisons.tied_ranks import GAME, PLAYER, league_ranks
from harness.evaluation.tables import read_csv, write_csv
from harness.reports.provenance import scene_of

LEAGUE = "league.csv"
RANKS = "league_ranks.csv"
SIGNIFICANCE = Assessment().significance


def rank_leagues(folder: Path) -> tuple[pd.DataFrame, Path]:
    """Rank the egos of the leagues in a folder, and write the table `league_ranks` there: the table, and its file.

    Raises UsageError if the leagues of the folder have fewer than two egos, or if no game was played by all egos.
    """
    leagues = sorted(file.parent for file in folder.glob(f"*/{LEAGUE}") if not read_csv(file).empty)
    games = pd.concat([_games_of(league) for league in leagues], ignore_index=True) if leagues else None
    if games is None or len(games[PLAYER].drop_duplicates()) < 2:
        found = ", ".join(each.name for each in leagues) or "none"
        raise UsageError.of(folder, "", f"has fewer than two egos: {found}", "play some: harness league --ego EGO")
    table = league_ranks(games, SIGNIFICANCE)
    if not table["games"].any():
        remedy = "play the same scenes: harness league --scenes"
        raise UsageError.of(folder, "", "no game was played by the egos of all leagues", remedy)
    write_csv(table, folder / RANKS)
    return table, folder / RANKS


def _games_of(league: Path) -> pd.DataFrame:
    """The games of the scenes of a league, as `league_ranks` reads them: each game alone or beside SUMO's driver once,
    though it is played for people of every training seed."""
    ego = read_csv(league / LEAGUE)["ego"].iloc[0]
    found = []
    for file in sorted(league.glob(f"*/{MANIFEST}")):
        run = RunFolder(file.parent)
        episodes = read_csv(run.path / "episodes.csv")
        played = episodes[(episodes["error"] == "") & episodes["ego_failed"].notna()]
        manifest = run.manifest()
        campaign = campaign_in(manifest)
        arms = arms_of(planned(manifest))
        people = {name: person_in(arm) for name, arm in arms.items()}
        shields = {name: shield_in(arm, campaign) for name, arm in arms.items()}
        named = played.assign(scene=scene_of(manifest), person=played["arm"].map(people), ego=ego)
        named["shield"] = played["arm"].map(shields)
        found.append(named.assign(seed=named["seed"].where(named["persona"] != "", 0)))
    games = pd.concat(found, ignore_index=True)
    return games.drop_duplicates([*GAME, *PLAYER])[[*GAME, *PLAYER, "ego_failed"]]
