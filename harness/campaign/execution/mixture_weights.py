"""The weights of a mixture in equilibrium, from the games that were played."""

from __future__ import annotations

import numpy as np

from harness.campaign.plan.planned_drivers import EquilibriumMixture, description, persona_of
from harness.campaign.storage.arm_tables import arm_tables
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import StageFailed
from harness.evaluation.game_theory.nash import solve


def equilibrium_of(mixture: EquilibriumMixture, folder: RunFolder) -> tuple[float, ...]:
    """The shares of a mixture's members in the equilibrium of its arms.

    Raises StageFailed where there is none, or where no game of an arm could be played.
    """
    cells = [[_mean_payoffs(folder, arm) for arm in row] for row in mixture.arms]
    payoffs = np.array(cells, dtype=np.float64)  # [E, N, P]
    found = solve(payoffs[..., 0], payoffs[..., 1])
    if not found:
        reason = "no candidate equilibrium could be verified"
        raise StageFailed(f"the mixture of {description(mixture)} can't be weighed: {reason}")
    are_egos = not any(persona_of(each) for each in mixture.members)
    return tuple(map(float, found[0].ego_shares if are_egos else found[0].non_ego_shares))


def _mean_payoffs(folder: RunFolder, arm: str) -> tuple[float, float]:
    episodes = arm_tables(folder, arm).episodes
    played = episodes[episodes["error"] == ""]
    if played.empty:
        raise StageFailed(f"{arm}: none of its games could be played, so that it can't weigh a mixture")
    return float(played["ego_payoff"].mean()), float(played["non_ego_payoff"].mean())
