"""What the columns of `episodes.csv` are: unit, meaning with formula, and source. `docs/columns.md` is made of it."""

from __future__ import annotations

from collections.abc import Mapping

from harness.evaluation.severity.columns import OF_SEVERITY, Column

_SPEED = Column("float64", "m/s", "Mean speed while driving.", "the paper, step 1c")
_RED = Column("float64", "", "Number of stop lines passed on red.", "")
_WRONG_WAY = Column("float64", "s", "Time among oncoming lanes.", "")
_PAYOFF = Column("float64", "", "The player's own payoff, summed over the game.", "the paper, equation 1")
_OUTCOME = "`goal`, `collision` (with a road user), `rail` (with the edge of the drivable area), `timeout` or `error`"

EPISODES: Mapping[str, Column] = {
    "arm": Column("object", "", "The name of the arm, such as naive_vs_speedy.", ""),
    "persona": Column("object", "", "The persona of the non-ego; of an arm with one.", ""),
    "seed": Column("int64", "", "The training seed.", ""),
    "episode": Column("int64", "", "The game. Equal numbers begin alike in every arm.", ""),
    "ego_outcome": Column("object", "", f"How the ego's game ended: {_OUTCOME}; empty without an ego.", ""),
    "ego_failed": Column("Int64", "", "1 if the ego did not reach its goal, else 0.", "the paper, section 4"),
    "ego_mean_speed_mps": _SPEED,
    "ego_trailing_distance_m": Column(
        "float64",
        "m",
        "Mean gap to the leader, bumper to bumper, over the steps with one.",
        "the paper, step 1c",
    ),
    "ego_min_ttc_s": Column(
        "float64",
        "s",
        "Least time to collision (TTC) with a road user: oriented boxes at constant headings and speeds; 0 at contact.",
        "Hayward 1972, Near-miss determination through use of a scale of danger, for boxes at any angle",
    ),
    "ego_max_deceleration_mps2": Column("float64", "m/s^2", "Strongest braking; 0 if the ego never braked.", ""),
    "ego_max_lateral_acceleration_mps2": Column(
        "float64", "m/s^2", "Greatest lateral acceleration, to either side; empty where SUMO drives.", ""
    ),
    "ego_time_to_goal_s": Column("float64", "s", "Time until the goal; empty without it.", ""),
    "ego_red_lights": _RED,
    "ego_wrong_way_s": _WRONG_WAY,
    "ego_min_pet_s": Column(
        "float64",
        "s",
        "Least post-encroachment time in a zone of conflict of a junction, from when the first leaves the zone until "
        "the second enters it.",
        "Allen, Shin and Cooper 1978",
    ),
    "ego_pet_priority": Column("object", "", "Whether the `ego` or the `other` had priority in that passage.", ""),
    "ego_accepted_gap_s": Column(
        "float64",
        "s",
        "Least gap that the ego accepted: the time that a road user with priority would have needed to the zone of "
        "conflict at constant speed when the ego entered it.",
        "",
    ),
    "ego_payoff": _PAYOFF,
    "non_ego_outcome": Column("object", "", f"How the person's game ended: {_OUTCOME}; empty without one.", ""),
    "non_ego_mean_speed_mps": _SPEED,
    "non_ego_red_lights": _RED,
    "non_ego_latest_red_s": Column(
        "float64", "s", "Longest time since the onset of red at which the person passed a stop line.", ""
    ),
    "non_ego_wrong_way_s": _WRONG_WAY,
    "non_ego_payoff": _PAYOFF,
    "duration_s": Column("float64", "s", "Duration of the game.", ""),
    **OF_SEVERITY,
    "error": Column("object", "", "Why the game could not be played; empty if it was.", ""),
}
"""Every column in order, with one person."""
