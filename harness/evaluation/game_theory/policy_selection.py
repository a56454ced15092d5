"""The policy with which a player goes on after a round: the best of its new answer and of all that it had.

Each candidate plays the same games: the same starts, the same draws of the opponent from its mixture, and the same
games alone on the road. They are games of the selection: no training, assessment, best response or other round plays
them. The candidate with the highest mean payoff is chosen; of equal ones the oldest.

The payoff decides, and not the ego's failures: it is what a player maximises (SafeDriveRL, equation 1), what its
training raised, and what a best response is defined by (equation 2). An ego that should put failures first has a
persona whose payoff does.

The choice has the noise of its games. With N of them the standard error of a difference of two candidates is that of N
paired differences, which `more_than_answer_low` and `_high` show, and a candidate that is better by less may lose. The
mean of the chosen one is too high on average, as it is the highest of several: what the player earns is measured by its
arms, whose games did not choose it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.evaluation.comparisons.comparison import mean_cells
from harness.game.arrays import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True)
class CandidateGames:
    """The games of K candidates, the oldest first and the new answer last, in N episodes."""

    payoffs: FloatArray
    """[K, N] the candidate's payoff; NaN: the game could not be played."""
    failed: BoolArray
    """[K, N] whether the candidate did not reach its goal."""
    alone: BoolArray
    """[N] which episodes are without the opponent."""

    @property
    def complete(self) -> BoolArray:
        """[N] the episodes that every candidate could play: the others count for none."""
        return np.asarray(np.isfinite(self.payoffs).all(axis=0))


def best_candidate(games: CandidateGames) -> int:
    """The place of the candidate with the highest mean payoff over the complete episodes; of equal ones the first.

    Raises ValueError where no episode is complete.
    """
    payoffs = games.payoffs[:, games.complete]
    if not payoffs.shape[1]:
        raise ValueError("no episode could be played by every candidate")
    return int(payoffs.mean(axis=1).argmax())


def selection_rows(names: Sequence[str], games: CandidateGames) -> list[dict[str, Any]]:
    """The cells of the table `selections` about each candidate, by their names [K]. Raises as `best_candidate`."""
    best, complete = best_candidate(games), games.complete
    payoffs, failed = games.payoffs[:, complete], games.failed[:, complete]
    shared = {
        "episodes": int(complete.sum()),
        "alone": int(games.alone[complete].sum()),
        "left_out": int((~complete).sum()),
    }
    return [
        shared
        | {"candidate": name, "failure_rate": float(failed[place].mean()), "chosen": place == best}
        | mean_cells("payoff", payoffs[place])
        | mean_cells("more_than_answer", payoffs[place] - payoffs[-1])
        for place, name in enumerate(names)
    ]
