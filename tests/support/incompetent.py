"""Made-up campaigns with a player that can't drive the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from harness.evaluation.competence import DID_NOT_LEARN
from tests.support.pages import GAMES, recomputed


def cannot_drive(arguments: dict[str, Any], seeds: Sequence[int] = (1,)) -> dict[str, Any]:
    """The campaign with a speedy driver that never reaches its goal alone, in these seeds."""
    episodes = arguments["episodes"]
    alone = (episodes["arm"] == "speedy_alone") & episodes["seed"].isin(seeds)
    episodes.loc[alone, "non_ego_outcome"] = "rail"
    for seed in seeds:
        entry = arguments["manifest"]["stages"][f"speedy-seed{seed}"]
        entry |= {"stopped": DID_NOT_LEARN, "goals": 0, "played": GAMES, "goal_share_asked": 0.8}
    return recomputed(arguments, competence={})
