"""The starts of games as points of a plane: which two quantities of a start tell best how its game ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import pandas as pd

from harness.game.arrays import FloatArray
from harness.game.roles import EGO, NON_EGO, roles_of
from harness.game.start_range import ArrivesAfterEgo, BesideEgo, OnLine, StartRange

NEIGHBOURS = 10
"""The nearest starts that predict how the game of a start ends."""
Ending = Literal["failure", "near_miss", "fine"]
SCORES: dict[Ending, float] = {"failure": 1.0, "near_miss": 0.5, "fine": 0.0}
"""What the neighbours predict. The order of the endings matters, not these numbers, which are our own."""


@dataclass(frozen=True, kw_only=True)
class Boundary:
    """What `harness minimise` found of a failure."""

    arm: str
    seed: int
    episode: int
    starts: pd.DataFrame
    """Quantities as columns: the start of the game, the mildest one that still fails, and the nearest one found that
    does not; without the last where none was found."""


def start_quantities(places: Sequence[StartRange], position_m: FloatArray, speed_mps: FloatArray) -> pd.DataFrame:
    """The quantities of N starts, a column each, from the positions of front bumpers and the speeds [N, P].

    A person's place is measured as the scene draws it: `_ahead_m` of the ego, `_after_s` the ego's arrival where the
    ways join, or `_position_m` along its own line. `_faster_mps` is its speed less the ego's.
    """
    roles = roles_of(len(places))
    found: dict[str, FloatArray] = {}
    for player in range(NON_EGO, len(places)):
        name, own_m, own_mps = roles[player], position_m[:, player], speed_mps[:, player]
        match places[player].place:
            case BesideEgo():
                found[f"{name}_ahead_m"] = own_m - position_m[:, EGO]
            case ArrivesAfterEgo(meeting_m=meeting_m, ego_meeting_m=ego_meeting_m):
                ego_arrival_s = (ego_meeting_m - position_m[:, EGO]) / speed_mps[:, EGO]
                found[f"{name}_after_s"] = (meeting_m - own_m) / own_mps - ego_arrival_s
            case OnLine():
                found[f"{name}_position_m"] = own_m
        found[f"{name}_faster_mps"] = own_mps - speed_mps[:, EGO]
        found[f"{name}_speed_mps"] = own_mps
    return pd.DataFrame(found | {"ego_position_m": position_m[:, EGO], "ego_speed_mps": speed_mps[:, EGO]})


def endings(games: pd.DataFrame) -> pd.Series:
    """How each game ends, rows of `episodes.csv` that were played: each an `Ending`."""
    near = games["near_miss"].fillna(0).astype(bool)
    failed = games["ego_failed"].fillna(0).astype(bool)
    return pd.Series(np.where(failed, "failure", np.where(near, "near_miss", "fine")), index=games.index, dtype=object)


def explained_share(points: FloatArray, scores: FloatArray) -> float:
    """The share of the variance of `scores` [N] that the mean of the `NEIGHBOURS` nearest other points [N, 2] explains,
    with both coordinates in units of their standard deviations; below 0 where the mean of all predicts better. NaN
    without variance, or with too few points."""
    from scipy.spatial import cKDTree

    variance = float(((scores - scores.mean()) ** 2).sum()) if len(scores) > NEIGHBOURS else 0.0
    if not variance:
        return np.nan
    spread = points.std(axis=0)
    scaled = points / np.where(spread > 0.0, spread, 1.0)
    _, nearest = cKDTree(scaled).query(scaled, NEIGHBOURS + 1)
    others = nearest != np.arange(len(points))[:, None]
    others[others.all(axis=1), -1] = False  # of equal points, the own one may be missing
    predicted = (scores[nearest] * others).sum(axis=1) / others.sum(axis=1)
    return 1.0 - float(((scores - predicted) ** 2).sum()) / variance


def best_pair(starts: pd.DataFrame, scores: FloatArray) -> tuple[str, str]:
    """The two columns of `starts` [N, at least 2] that tell the scores [N] of the games best (`explained_share`), in
    the order of the columns; the first two where no pair tells anything."""
    pairs = list(combinations(starts.columns, 2))
    shares = [explained_share(starts[list(pair)].to_numpy(float), scores) for pair in pairs]
    return max(zip(pairs, shares, strict=True), key=lambda each: max(each[1], 0.0) if each[1] == each[1] else 0.0)[0]
