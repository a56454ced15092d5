"""Made-up games of a campaign with cross-play: arms of egos against non-egos, and best responses to their pairs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd

from harness.evaluation.columns import TABLES
from harness.evaluation.game_theory.best_response_gap import Response
from harness.evaluation.game_theory.crossplay import Pairing
from harness.evaluation.game_theory.findings import find
from harness.evaluation.tables import typed


def arm(
    name: str,
    seed: int = 1,
    ego_failed: Sequence[int | None] = (),
    ego_payoff: Sequence[float] | None = None,
    non_ego_payoff: Sequence[float] | None = None,
    persona: str = "",
    speed: float = 13.0,
    first_episode: int = 0,
) -> pd.DataFrame:
    """Games of one arm, an episode each; None in `ego_failed` is a game that errored."""
    count = len(ego_failed)
    ego = [10.0] * count if ego_payoff is None else ego_payoff
    non_ego = [20.0] * count if non_ego_payoff is None else non_ego_payoff
    rows = [
        {
            "arm": name,
            "persona": persona,
            "seed": seed,
            "episode": first_episode + place,
            "ego_outcome": {None: "error", 0: "goal", 1: "collision"}[failed],
            "ego_failed": failed,
            "ego_mean_speed_mps": math.nan if failed is None else speed,
            "ego_payoff": math.nan if failed is None else ego[place],
            "non_ego_outcome": "" if failed is None else "goal",
            "non_ego_payoff": math.nan if failed is None else non_ego[place],
            "duration_s": 10.0,
            "severity": {None: math.nan, 0: 0.0, 1: 300.0}[failed],
            "error": "it died" if failed is None else "",
        }
        for place, failed in enumerate(ego_failed)
    ]
    return pd.DataFrame(rows, columns=list(TABLES["episodes"]))


def table(*arms: pd.DataFrame) -> pd.DataFrame:
    """Arms one below the other, as in episodes.csv."""
    return typed(pd.concat(arms, ignore_index=True))


OWN, WITHOUT = "naive_vs_speedy", "naive_vs_speedy_with_shoulder_glance_of_careful"


def trait_row(trait: str, with_it: int, without: int, p: float = 1e-6, seed: int = 1, **changes: Any) -> dict[str, Any]:
    """A row of the table `attribution`: 100 games against speedy with a trait and without it."""
    counts = {"without_pairs": 100, "failures": with_it, "failures_without": without}
    counts |= {"without_pairs_left_out": 0, "alone_pairs": 100, "failures_baseline": 2, "failures_alone": 9}
    cells = {"without_difference": (with_it - without) / 100, "alone_difference": 0.07, "without_p_holm": p}
    arms = {"arm": OWN, "without_arm": WITHOUT, "baseline_arm": "naive_vs_careful", "alone_arm": "x"}
    return {"persona": "speedy", "seed": seed, "trait": trait, **arms, **counts, **cells, **changes}


FAILING = {
    ("naive", "speedy"): 0.24,
    ("naive", "speedy_round2"): 0.3,
    ("naive", "distracted"): 0.16,
    ("naive", "sumo"): 0.02,
    ("retrained_speedy", "speedy"): 0.04,
    ("retrained_speedy", "speedy_round2"): 0.12,
    ("retrained_speedy", "distracted"): 0.1,
    ("retrained_speedy", "sumo"): 0.0,
    ("retrained_distracted", "speedy"): 0.2,
    ("retrained_distracted", "speedy_round2"): 0.22,
    ("retrained_distracted", "distracted"): 0.04,
    ("retrained_distracted", "sumo"): 0.0,
    ("robust", "speedy"): 0.04,
    ("robust", "speedy_round2"): 0.06,
    ("robust", "distracted"): 0.04,
    ("robust", "sumo"): 0.02,
}
"""Share of games the ego fails."""
TRAINED_AGAINST = {
    "retrained_speedy": ("speedy",),
    "retrained_distracted": ("distracted",),
    "robust": ("speedy", "distracted"),
}
Gains = Mapping[tuple[Literal["ego", "non_ego"], str], float]
GAINS: Gains = {
    ("ego", "speedy"): 0.1,
    ("non_ego", "speedy"): 6.0,
    ("ego", "distracted"): -0.3,
    ("non_ego", "distracted"): 0.1,
}
"""The gain of the best response, by role and persona."""


def a_campaign(
    seeds: Sequence[int] = (1,), games: int = 50, gains: Gains | None = None
) -> tuple[pd.DataFrame, list[Pairing], list[Response]]:
    """Episodes, pairings and responses of a made-up campaign: every cell of FAILING, and best responses of both
    sides of each persona's last pair."""
    gains, random = {**GAINS, **(gains or {})}, np.random.default_rng(5)
    arms, pairings, responses = [], [], []
    for seed in seeds:
        for (ego, non_ego), rate in FAILING.items():
            persona = "" if non_ego == "sumo" else non_ego.partition("_")[0]
            name = f"{ego}_vs_{non_ego}"
            failed = [int(place < rate * games) for place in range(games)]
            arms.append(_noisy(name, seed, failed, persona, random))
            pairings.append(Pairing(arm=name, seed=seed, ego=ego, non_ego=non_ego, persona=persona))
        for (role, persona), gain in gains.items():
            non_ego = {"speedy": "speedy_round2"}.get(persona, persona)
            ego = f"retrained_{persona}"
            pair = next(each for each in arms if each["arm"][0] == f"{ego}_vs_{non_ego}" and each["seed"][0] == seed)
            best = pair.copy()
            best["arm"] = f"best_{role}_{persona}"
            earned = f"{role}_payoff"
            best[earned] = best[earned].astype(float) + random.normal(gain, 0.3, size=games)
            if role == "non_ego" and gain > 1:
                best.loc[: games // 4, ["ego_failed", "ego_outcome"]] = [1, "collision"]
            arms.append(best)
            responses.append(
                Response(
                    seed=seed,
                    role=role,
                    persona=persona,
                    round=2,
                    pair_arm=pair["arm"][0],
                    response_arm=best["arm"][0],
                    ego=ego,
                    non_ego=non_ego,
                    search_steps=600_000,
                    search_starts=2,
                )
            )
    return table(*arms), pairings, responses


def _noisy(name: str, seed: int, failed: Sequence[int], persona: str, random: np.random.Generator) -> pd.DataFrame:
    ego = [float(random.normal(8, 1) - 12 * each) for each in failed]
    non_ego = [float(random.normal(15, 2) + 3 * each) if persona else math.nan for each in failed]
    return arm(name, seed, failed, ego, non_ego, persona, speed=float(random.normal(13, 0.5)))


def findings(
    seeds: Sequence[int] = (1,),
    games: int = 50,
    gains: Gains | None = None,
    significance: float = 0.01,
) -> Any:
    """The findings of such a campaign."""
    episodes, pairings, responses = a_campaign(seeds, games, gains)
    return find(pairings, responses, TRAINED_AGAINST, episodes, significance)
