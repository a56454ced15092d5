"""What the shield of an ego does: each shielded arm beside the same arm without it, in the same games."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, mcnemar, mean_cells, pairs_of, rate_cells
from harness.evaluation.strategies import Arm, ShieldedEgo, counterparts
from harness.evaluation.tables import table_of

_COMPARED = ("ego_failed", "ego_mean_speed_mps")
_INTERVENTIONS = ("ego_shield_interventions_per_km", "ego_shielded_share")


def compare_shielded(arms: Mapping[str, Arm], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each shielded arm and training seed, the table `shields`. `arms` are the planned ones by name.

    Games are paired by episode as in `comparisons.comparison`. `mcnemar_p` is two-sided: a shield may also cause
    failures. Raises ValueError when an arm has two games for one episode.
    """
    games, rows = games_by_arm(episodes), []
    for (name, seed), played in games.items():
        arm = arms.get(name)
        if arm is None or not isinstance(arm.ego, ShieldedEgo):
            continue
        (without,) = counterparts(arm)
        before, after, left_out = pairs_of(games, seed, without.name, name, _COMPARED)
        failures = before[:, 0] - after[:, 0]
        rows.append(
            {"arm": without.name, "shielded_arm": name, "persona": played["persona"].iloc[0], "seed": seed}
            | {"pairs": len(before), "pairs_left_out": left_out}
            | rate_cells("failure_rate", before[:, 0].sum(), len(before))
            | rate_cells("shielded_failure_rate", after[:, 0].sum(), len(after))
            | mean_cells("fewer_failures", failures)
            | {"mcnemar_p": mcnemar(failures, "two-sided") if len(failures) else np.nan}
            | mean_cells("speed_loss_mps", before[:, 1] - after[:, 1])
            | {column.removeprefix("ego_"): played[column].mean() for column in _INTERVENTIONS}
        )
    return table_of("shields", rows)
