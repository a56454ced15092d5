"""The columns of the tables `searches` and `falsification`, but for those that many tables share."""

from __future__ import annotations

from harness.evaluation.column import COUNT, FLAG, MAYBE, NUMBER, TEXT, Column

_CRITERION = Column(
    "criterion",
    TEXT,
    "`failure`: the ego fails; else the reference driver that prevents it from the conflict on.",
)
_SEED = Column("seed", COUNT, "The training seed.")
_SEARCHER = Column("searcher", TEXT, "`random`, `cross-entropy` or `cma-es`.")
_GAMES = Column("games", COUNT, "Games of each search.")
SEARCHES = (
    Column("arm", TEXT, "The arm whose players play."),
    *(_SEED, _SEARCHER),
    Column("learned", FLAG, "Whether learned people play, from random starts; else SUMO drives for the people."),
    Column("repeat", COUNT, "The search, of several with other random numbers."),
    *(_CRITERION, _GAMES),
    Column("found", COUNT, "Games that meet the criterion."),
    Column("first_game", MAYBE, "The first of them, from 1; empty: none."),
)
FALSIFICATION = (
    _CRITERION,
    Column("arm", TEXT, "The arm of learned people."),
    _SEED,
    Column("searched_arm", TEXT, "The arm whose starts and ordinary drivers were searched."),
    *(_SEARCHER,),
    Column("repeats", COUNT, "Searches on each side."),
    _GAMES,
    Column("found_by_person", COUNT, "Searches with learned people in which a game met the criterion."),
    Column("found_by_searcher", COUNT, "Searches of the searcher in which a game met the criterion."),
    Column("mean_games_person", NUMBER, "Mean games with learned people until the first find, at most `games`."),
    Column("mean_games_searcher", NUMBER, "The same of the searcher."),
)
