"""What a shield or perception errors do: each arm of an altered ego beside that of the ego itself, in the same games.

Games are paired by episode as in `comparisons.comparison`. `mcnemar_p` is two-sided: a shield may also cause failures,
and an error may also prevent one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, holm, mcnemar, mean_cells, pairs_of, rate_cells
from harness.evaluation.strategies import Arm, ErrorFreeEgo, ShieldedEgo, counterparts
from harness.evaluation.tables import table_of

_COMPARED = ("ego_failed", "ego_mean_speed_mps")
_INTERVENTIONS = ("ego_shield_interventions_per_km", "ego_shielded_share")
_ERRORS = ("ego_lost_share", "ego_ghost_share")


def compare_shielded(arms: Mapping[str, Arm], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each shielded arm and training seed, the table `shields`. `arms` are the planned ones by name.

    Raises ValueError when an arm has two games for one episode.
    """
    rows = _rows(arms, episodes, ShieldedEgo, "shielded", "fewer_failures", _INTERVENTIONS, twin_has_it=True)
    return table_of("shields", rows)


def compare_perception(arms: Mapping[str, Arm], episodes: pd.DataFrame, seeds: int) -> pd.DataFrame:
    """A row for each arm that is played with and without perception errors and each training seed, the table
    `perception`. `arms` are the planned ones by name, for this number of training seeds.

    The family of `p_holm` is what is planned. Raises ValueError when an arm has two games for one episode.
    """
    planned = seeds * sum(isinstance(arm.ego, ErrorFreeEgo) for arm in arms.values())
    rows = list(_rows(arms, episodes, ErrorFreeEgo, "error_free", "more_failures", _ERRORS, twin_has_it=False))
    corrected = holm(np.array([row["mcnemar_p"] for row in rows], dtype=np.float64), planned)
    return table_of("perception", [row | {"p_holm": p} for row, p in zip(rows, corrected.tolist(), strict=True)])


def _rows(
    arms: Mapping[str, Arm],
    episodes: pd.DataFrame,
    altered: type[ShieldedEgo | ErrorFreeEgo],
    twin: str,
    difference: str,
    shares: Sequence[str],
    *,
    twin_has_it: bool,
) -> Iterator[dict[str, Any]]:
    """A row for each arm of an `altered` ego, the twin, and training seed; `twin` is what its columns begin with.

    `difference` is the column of the ego's own failures minus the twin's. The speed is lost, and the means of `shares`
    are measured, with the shield or the errors: the twin has them, or else the ego itself.
    """
    games = games_by_arm(episodes)
    for (name, seed), played in games.items():
        arm = arms.get(name)
        if arm is None or not isinstance(arm.ego, altered):
            continue
        (own,) = counterparts(arm)
        without, having = (own.name, name) if twin_has_it else (name, own.name)
        before, after, left_out = pairs_of(games, seed, without, having, _COMPARED)
        of_own, of_twin = (before, after) if twin_has_it else (after, before)
        failures, measured = of_own[:, 0] - of_twin[:, 0], games.get((having, seed), played[:0])
        yield (
            {"arm": own.name, f"{twin}_arm": name, "persona": played["persona"].iloc[0], "seed": seed}
            | {"pairs": len(before), "pairs_left_out": left_out}
            | rate_cells("failure_rate", of_own[:, 0].sum(), len(of_own))
            | rate_cells(f"{twin}_failure_rate", of_twin[:, 0].sum(), len(of_twin))
            | mean_cells(difference, failures)
            | {"mcnemar_p": mcnemar(failures, "two-sided") if len(failures) else np.nan}
            | mean_cells("speed_loss_mps", before[:, 1] - after[:, 1])
            | {column.removeprefix("ego_"): measured[column].mean() for column in shares}
        )
