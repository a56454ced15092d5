"""The metrics of a player in one game: from the recording of its steps to a value, or None if unscored.

A metric that can't be measured in a game (no leader, no collision course) is unscored, never 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.evaluation.encounters import Encounter
from harness.game.arrays import FloatArray
from harness.game.outcome import Outcome


@dataclass(frozen=True, kw_only=True)
class PlayerSeries:
    """One player's game, step by step while it drove, [T]; inf: no leader, or no collision course."""

    outcome: Outcome
    step_s: float
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    lateral_acceleration_mps2: FloatArray
    leader_gap_m: FloatArray
    time_to_collision_s: FloatArray
    payoff: FloatArray
    passed_red_s: FloatArray
    """Where the player passed a stop line on red: seconds since the signal became red; else -1."""
    wrong_way: FloatArray
    """1 while the player was among oncoming lanes, else 0."""
    encounters: tuple[Encounter, ...] = ()


def _finite(values: FloatArray, statistic: Callable[[FloatArray], float]) -> float | None:
    measured = values[np.isfinite(values)]
    return float(statistic(measured)) if len(measured) else None


def mean_speed_mps(drive: PlayerSeries) -> float | None:
    """Mean speed while driving."""
    return _finite(drive.speed_mps, np.mean)


def trailing_distance_m(drive: PlayerSeries) -> float | None:
    """Mean gap to the leader, bumper to bumper, over the steps in which there was one (paper, step 1c)."""
    return _finite(drive.leader_gap_m, np.mean)


def min_ttc_s(drive: PlayerSeries) -> float | None:
    """Least time to collision (TTC), of oriented boxes with constant heading and speed; 0 at contact."""
    return _finite(drive.time_to_collision_s, np.min)


def max_deceleration_mps2(drive: PlayerSeries) -> float | None:
    """Hardest braking; 0 if the player never decelerated."""
    return _finite(np.maximum(-drive.acceleration_mps2, 0.0), np.max)


def max_lateral_acceleration_mps2(drive: PlayerSeries) -> float | None:
    """Greatest lateral acceleration, to either side."""
    return _finite(np.abs(drive.lateral_acceleration_mps2), np.max)


def time_to_goal_s(drive: PlayerSeries) -> float | None:
    """Time until the goal was reached."""
    return len(drive.speed_mps) * drive.step_s if drive.outcome is Outcome.GOAL else None


def payoff(drive: PlayerSeries) -> float | None:
    """The player's own payoff, summed over the game (equation 1)."""
    return float(drive.payoff.sum())


def red_lights(drive: PlayerSeries) -> float:
    """Number of stop lines that the player passed on red."""
    return float(np.count_nonzero(drive.passed_red_s >= 0.0))


def latest_red_s(drive: PlayerSeries) -> float | None:
    """Longest time since the onset of red at which the player passed a stop line."""
    return _finite(np.where(drive.passed_red_s >= 0.0, drive.passed_red_s, np.nan), np.max)


def wrong_way_s(drive: PlayerSeries) -> float:
    """Time among oncoming lanes."""
    return float(drive.wrong_way.sum()) * drive.step_s


def min_pet_s(drive: PlayerSeries) -> float | None:
    """Least post-encroachment time (PET) of the player and another road user in a zone of conflict of a junction."""
    return _finite(np.array([each.post_encroachment_s for each in drive.encounters]), np.min)


def pet_priority(drive: PlayerSeries) -> str | None:
    """`other` if the player had to yield in the passage of least PET, else `ego`."""
    found = [each for each in drive.encounters if np.isfinite(each.post_encroachment_s)]
    if not found:
        return None
    return "other" if min(found, key=lambda each: each.post_encroachment_s).must_yield else "ego"


def accepted_gap_s(drive: PlayerSeries) -> float | None:
    """Least gap that the player accepted: the time that a road user with priority would have needed to the zone of
    conflict, at constant speed, when the player entered it; 0 if it was inside."""
    return _finite(np.array([each.gap_s for each in drive.encounters if each.must_yield]), np.min)


OF_EGO: Mapping[str, Callable[[PlayerSeries], float | str | None]] = {
    "ego_mean_speed_mps": mean_speed_mps,
    "ego_trailing_distance_m": trailing_distance_m,
    "ego_min_ttc_s": min_ttc_s,
    "ego_max_deceleration_mps2": max_deceleration_mps2,
    "ego_max_lateral_acceleration_mps2": max_lateral_acceleration_mps2,
    "ego_time_to_goal_s": time_to_goal_s,
    "ego_red_lights": red_lights,
    "ego_wrong_way_s": wrong_way_s,
    "ego_min_pet_s": min_pet_s,
    "ego_pet_priority": pet_priority,
    "ego_accepted_gap_s": accepted_gap_s,
    "ego_payoff": payoff,
}
OF_NON_EGO: Mapping[str, Callable[[PlayerSeries], float | None]] = {
    "non_ego_mean_speed_mps": mean_speed_mps,
    "non_ego_red_lights": red_lights,
    "non_ego_latest_red_s": latest_red_s,
    "non_ego_wrong_way_s": wrong_way_s,
    "non_ego_payoff": payoff,
}
