"""Cross-play: every ego against every non-ego, over the same starts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, mean_cells, measured_values, rate_cells
from harness.evaluation.research_questions import AloneBound
from harness.evaluation.tables import table_of

MEASURED = ("ego_failed", "ego_payoff", "non_ego_payoff", "ego_mean_speed_mps")


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """One arm as a cell of the cross-play: an ego strategy and a non-ego strategy."""

    arm: str
    seed: int
    ego: str
    non_ego: str
    persona: str
    """Of the non-ego; "" for SUMO's own driver, which has no payoff and is in no empirical game."""
    alone: tuple[AloneBound, ...] = ()
    """What its players have to achieve alone; otherwise there is no verdict on them."""


def crossplay(pairings: Iterable[Pairing], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each pairing, in their order, the table `crossplay`.

    `episodes` has the columns of episodes.csv. A game counts when it was played and the ego's outcome is known; the
    other means are over those of these games in which they were measured, and empty without any. Episodes that only
    another pairing of the seed has are counted in `left_out`, like games that errored.

    Raises ValueError when an ego and a non-ego are paired twice, or an arm has two games for one episode.
    """
    games, played = games_by_arm(episodes), dict[int, set[int]]()
    values = dict[tuple[int, str, str], tuple[Pairing, pd.DataFrame]]()
    for pairing in pairings:
        cell = (pairing.seed, pairing.ego, pairing.non_ego)
        if cell in values:
            raise ValueError(f"seed {pairing.seed}: {pairing.ego!r} against {pairing.non_ego!r} are paired twice")
        values[cell] = (pairing, measured_values(games.get((pairing.arm, pairing.seed)), MEASURED))
        played.setdefault(pairing.seed, set()).update(values[cell][1].index)
    rows = [_row(pairing, measured, len(played[pairing.seed])) for pairing, measured in values.values()]
    return table_of("crossplay", rows)


def _row(pairing: Pairing, values: pd.DataFrame, episodes: int) -> dict[str, object]:
    known = values.dropna(subset="ego_failed")
    row = vars(pairing) | {"games": len(known), "left_out": episodes - len(known)}
    row |= rate_cells("failure_rate", known["ego_failed"].sum(), len(known))
    for name in ("ego_payoff", "non_ego_payoff"):
        row |= mean_cells(name, known[name].dropna().to_numpy())
    return row | {"ego_mean_speed_mps": known["ego_mean_speed_mps"].mean()}
