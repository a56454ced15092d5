"""Cross-play: every ego against every non-ego, over the same starts, as a table and as matrices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, mean_cells, measured_values, rate_cells
from harness.evaluation.research_questions import AloneBound
from harness.evaluation.tables import table_of
from harness.game.arrays import FloatArray

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


@dataclass(frozen=True, kw_only=True)
class Matrices:
    """A seed's cross-play as matrices [E, N]; NaN where a pairing was not played."""

    egos: Sequence[str]
    non_egos: Sequence[str]
    personas: Sequence[str]
    """The personas of the non-egos [N]."""
    failure_rates: FloatArray
    ego_payoffs: FloatArray
    non_ego_payoffs: FloatArray

    def among(self, egos: Sequence[int], non_egos: Sequence[int]) -> Matrices:
        """The rows and columns at these places."""
        at = np.ix_(egos, non_egos)
        return Matrices(
            egos=[self.egos[place] for place in egos],
            non_egos=[self.non_egos[place] for place in non_egos],
            personas=[self.personas[place] for place in non_egos],
            failure_rates=self.failure_rates[at],
            ego_payoffs=self.ego_payoffs[at],
            non_ego_payoffs=self.non_ego_payoffs[at],
        )


def matrices(found: pd.DataFrame) -> Matrices:
    """The rows of `crossplay` of one seed as matrices; egos and non-egos in order of first appearance."""
    egos, non_egos = list(dict.fromkeys(found["ego"])), list(dict.fromkeys(found["non_ego"]))
    persona = dict(zip(found["non_ego"], found["persona"], strict=True))

    def matrix(column: str) -> FloatArray:
        cells = found.pivot(index="ego", columns="non_ego", values=column)
        return cells.reindex(index=egos, columns=non_egos).to_numpy(dtype=np.float64)

    return Matrices(
        egos=egos,
        non_egos=non_egos,
        personas=[persona[name] for name in non_egos],
        failure_rates=matrix("failure_rate"),
        ego_payoffs=matrix("ego_payoff"),
        non_ego_payoffs=matrix("non_ego_payoff"),
    )
