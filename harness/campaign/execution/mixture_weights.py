"""The weights of a mixture in equilibrium, from the games that were played."""

from __future__ import annotations

import numpy as np

from harness.campaign.plan.planned_drivers import EquilibriumMixture, description, persona_of
from harness.campaign.storage.arm_tables import arm_tables
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import StageFailed
from harness.evaluation.game_theory.nash import NoEquilibrium, equilibrium_shares


def equilibrium_of(mixture: EquilibriumMixture, folder: RunFolder) -> tuple[float, ...]:
    """The shares of a mixture's members in the equilibrium of its arms.

    Raises StageFailed where there is none, or where no game of an arm could be played.
    """
    cells = [[_mean_payoffs(folder, arm) for arm in row] for row in mixture.arms]
    payoffs = np.array(cells, dtype=np.float64)  # [E, N, P]
    try:
        ego_shares, non_ego_shares = equilibrium_shares(payoffs[..., 0], payoffs[..., 1])
    except NoEquilibrium as error:
        raise StageFailed(f"the mixture of {description(mixture)} can't be weighed: {error}") from error
    are_egos = not any(persona_of(each) for each in mixture.members)
    return tuple(float(share) for share in (ego_shares if are_egos else non_ego_shares))


def _mean_payoffs(folder: RunFolder, arm: str) -> tuple[float, float]:
    episodes = arm_tables(folder, arm).episodes
    played = episodes[episodes["error"] == ""]
    if played.empty:
        raise StageFailed(f"{arm}: none of its games could be played, so that it can't weigh a mixture")
    return float(played["ego_payoff"].mean()), float(played["non_ego_payoff"].mean())
