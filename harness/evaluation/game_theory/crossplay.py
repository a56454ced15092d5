"""Cross-play: every ego against every non-ego, over the same starts, as a table and as matrices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, mean_interval, measured_values, rate_interval
from harness.evaluation.game_theory.records import Pairing
from harness.evaluation.tables import table_of

Floats = npt.NDArray[np.float64]

MEASURED = ("ego_failed", "ego_payoff", "non_ego_payoff", "ego_mean_speed_mps")


def crossplay(pairings: Iterable[Pairing], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each pairing, in their order, the table `crossplay`.

    `episodes` has the columns of episodes.csv. A game counts when it was played and the ego's outcome is known; the
    other means are over those of these games in which they were measured, and empty without any. Episodes that only
    another pairing of the seed has are counted in `left_out`, like games that errored.

    Raises ValueError when an ego and a non-ego are paired twice, or an arm has two games for one episode.
    """
    pairings, games = list(pairings), games_by_arm(episodes)
    cells = [(pairing.seed, pairing.ego, pairing.non_ego) for pairing in pairings]
    for cell in {cell for cell in cells if cells.count(cell) > 1}:
        raise ValueError(f"seed {cell[0]}: {cell[1]!r} against {cell[2]!r} are paired twice")
    played: dict[int, set[int]] = {}
    values = {}
    for pairing in pairings:
        values[pairing] = measured_values(games.get((pairing.arm, pairing.seed)), MEASURED)
        if not values[pairing].index.is_unique:
            raise ValueError(f"arm {pairing.arm!r}, seed {pairing.seed}: an episode appears more than once")
        played.setdefault(pairing.seed, set()).update(values[pairing].index)
    rows = [_row(pairing, values[pairing], len(played[pairing.seed])) for pairing in pairings]
    return table_of("crossplay", rows)


def _row(pairing: Pairing, values: pd.DataFrame, episodes: int) -> dict[str, object]:
    known = values[np.isfinite(values["ego_failed"])]
    failures, count = known["ego_failed"].sum(), len(known)
    low, high = rate_interval(int(failures), count)
    row: dict[str, object] = {
        "seed": pairing.seed,
        "ego": pairing.ego,
        "non_ego": pairing.non_ego,
        "persona": pairing.persona,
        "arm": pairing.arm,
        "games": count,
        "left_out": episodes - count,
        "failure_rate": failures / count if count else np.nan,
        "failure_rate_low": low,
        "failure_rate_high": high,
        "ego_mean_speed_mps": known["ego_mean_speed_mps"].mean(),
    }
    for name in ("ego_payoff", "non_ego_payoff"):
        measured = known[name].dropna().to_numpy(dtype=np.float64)
        low, high = mean_interval(measured)
        row |= {name: measured.mean() if len(measured) else np.nan, f"{name}_low": low, f"{name}_high": high}
    return row


@dataclass(frozen=True, kw_only=True)
class Matrices:
    """A seed's cross-play as matrices [E, N]; NaN where a pairing was not played."""

    egos: Sequence[str]
    non_egos: Sequence[str]
    personas: Sequence[str]
    """The personas of the non-egos [N]."""
    failure_rates: Floats
    ego_payoffs: Floats
    non_ego_payoffs: Floats

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

    def matrix(column: str) -> Floats:
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
