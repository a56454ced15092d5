"""What the perception errors of an ego do: each arm beside the same arm without them, in the same games."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, holm, mcnemar, mean_cells, pairs_of, rate_cells
from harness.evaluation.strategies import Arm, ErrorFreeEgo, counterparts
from harness.evaluation.tables import table_of

_COMPARED = ("ego_failed", "ego_mean_speed_mps")
_SHARES = ("ego_lost_share", "ego_ghost_share")


def compare_perception(arms: Mapping[str, Arm], episodes: pd.DataFrame, seeds: int) -> pd.DataFrame:
    """A row for each arm that is played with and without perception errors and each training seed, the table
    `perception`. `arms` are the planned ones by name, for this number of training seeds.

    Games are paired by episode as in `comparisons.comparison`. `mcnemar_p` is two-sided: an error may also prevent a
    failure. The family of `p_holm` is what is planned. Raises ValueError when an arm has two games for one episode.
    """
    games, rows = games_by_arm(episodes), []
    planned = seeds * sum(isinstance(arm.ego, ErrorFreeEgo) for arm in arms.values())
    for (name, seed), without in games.items():
        arm = arms.get(name)
        if arm is None or not isinstance(arm.ego, ErrorFreeEgo):
            continue
        (own,) = counterparts(arm)
        before, after, left_out = pairs_of(games, seed, name, own.name, _COMPARED)
        failures, played = after[:, 0] - before[:, 0], games.get((own.name, seed), without[:0])
        rows.append(
            {"arm": own.name, "error_free_arm": name, "persona": without["persona"].iloc[0], "seed": seed}
            | {"pairs": len(before), "pairs_left_out": left_out}
            | rate_cells("failure_rate", after[:, 0].sum(), len(after))
            | rate_cells("error_free_failure_rate", before[:, 0].sum(), len(before))
            | mean_cells("more_failures", failures)
            | {"mcnemar_p": mcnemar(failures, "two-sided") if len(failures) else np.nan}
            | mean_cells("speed_loss_mps", before[:, 1] - after[:, 1])
            | {column.removeprefix("ego_"): played[column].mean() for column in _SHARES}
        )
    corrected = holm(np.array([row["mcnemar_p"] for row in rows], dtype=np.float64), planned)
    return table_of("perception", [row | {"p_holm": p} for row, p in zip(rows, corrected.tolist(), strict=True)])
