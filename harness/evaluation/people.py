"""The people of a game: the columns of each person in `episodes.csv`, and values over all of them.

A person's columns begin with its name (`game.roles.roles_of`): `non_ego_outcome`, `non_ego_2_outcome` and so on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from harness.evaluation.column import TEXT, Column
from harness.game.roles import MOST_PEOPLE, NON_EGO, ROLES, roles_of

COLLIDED_WITH = "ego_collided_with"
_COLLIDED_WITH = Column(COLLIDED_WITH, TEXT, "What the ego collided with: a person, an obstacle, or `background`.")
"""Only tables of several people have it."""
_ONE = f"{ROLES[NON_EGO]}_"


def people_in(columns: Iterable[str]) -> tuple[str, ...]:
    """The names of the people in a table of games with these columns."""
    columns = set(columns)
    return tuple(name for name in roles_of(1 + MOST_PEOPLE)[NON_EGO:] if f"{name}_outcome" in columns)


def columns_for(people: int, columns: Mapping[str, Column]) -> dict[str, Column]:
    """Columns of a table of games with one person, for a number of people.

    With several, those of a person occur for each of them, and `COLLIDED_WITH` follows `ego_failed`.
    """
    result: dict[str, Column] = {}
    names = roles_of(1 + people)[NON_EGO:]
    own = {name: column for name, column in columns.items() if name.startswith(_ONE)}
    for name, column in columns.items():
        if name not in own:
            result[name] = column
            result |= {COLLIDED_WITH: _COLLIDED_WITH} if people > 1 and name == "ego_failed" else {}
        elif name == next(iter(own)):
            cells = [(each, cell.removeprefix(_ONE), kind) for each in names for cell, kind in own.items()]
            result |= {f"{each}_{cell}": replace(kind, name=f"{each}_{cell}") for each, cell, kind in cells}
    return result


def of_people(games: pd.DataFrame, cell: str) -> pd.DataFrame:
    """A cell of every person (such as `outcome`) in each game: a column for each person."""
    return games[[f"{name}_{cell}" for name in people_in(games.columns)]]


def judged_outcomes(games: pd.DataFrame) -> pd.Series:
    """The outcome of the judged player of each game: the ego, or the person that drives where there is no ego."""
    ego = games["ego_outcome"].fillna("")
    return ego.where(ego != "", outcomes_of_people(games))


def outcomes_of_people(games: pd.DataFrame) -> pd.Series:
    """The outcome of the first person that took part in each game; empty without one."""
    first, *others = (outcomes.fillna("") for _, outcomes in of_people(games, "outcome").items())
    for each in others:
        first = first.where(first != "", each)
    return first


def judged(game: Mapping[str, Any]) -> tuple[str, str]:
    """The name of the judged player of a game, a row of `episodes.csv`, and its outcome."""
    names = ("ego", *people_in(game))
    return next(((name, game[f"{name}_outcome"]) for name in names if game[f"{name}_outcome"]), (names[-1], ""))
