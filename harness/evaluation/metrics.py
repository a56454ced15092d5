"""The metrics of a player in one recorded game, each with its columns in `episodes.csv` and `summary.csv`.

A metric is a function with an entry of the registry, its decorator. Where it can't be measured in a game (no leader, no
collision course) it is None, never 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from harness.evaluation.column import NUMBER, SHARE, Column
from harness.evaluation.encounters import Encounter
from harness.evaluation.recorded_game import RecordedGame
from harness.game.arrays import BoolArray, FloatArray
from harness.game.outcome import Outcome


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """A player's part of a recorded game. Arrays are [N]: the steps in which it drove, without the start."""

    game: RecordedGame
    player: int

    def of(self, quantity: str) -> FloatArray:
        """One of the quantities [G, P] of `game.quantities.Quantities`; inf: no leader, or no collision course."""
        return self.game.while_driving(getattr(self.game.quantities, quantity), self.player)

    @property
    def outcome(self) -> Outcome:
        return self.game.outcomes[self.player]

    @property
    def step_s(self) -> float:
        return self.game.world.step_s

    @property
    def acceleration_mps2(self) -> FloatArray:
        """Along its heading."""
        return self.game.while_driving(self.game.quantities.state.acceleration_mps2, self.player)

    @property
    def payoff(self) -> FloatArray:
        return self.game.while_driving(self.game.payoff, self.player)

    def flags(self, column: str) -> BoolArray | None:
        flags = self.game.flags(column)
        return None if flags is None else self.game.while_driving(flags, self.player)

    def share(self, column: str) -> float | None:
        """Share of its steps in which a column has its flag; None where the trace lacks it."""
        flags = self.flags(column)
        return float(flags.mean()) if flags is not None and len(flags) else None

    @property
    def encounters(self) -> tuple[Encounter, ...]:
        return self.game.encounters[self.player]


Value: TypeAlias = float | str | None


@dataclass(frozen=True, kw_only=True)
class Metric:
    """A metric: its column, whose it is, and its function."""

    column: Column
    """Of the game; a player's has the player's name before this name."""
    whose: tuple[str, ...]
    """`ego`, `person` (each of them), `conduct` (each player, in `conduct.csv`), or `game` and `judged`, without a
    player's name."""
    mean: str
    """The column of `summary.csv` with the ego's mean per arm (that of the people: as in `episodes.csv`); empty:
    none."""
    of: Callable[[Drive], Value]


METRICS: list[Metric] = []
"""In the order of their columns; those of severity are added by `severity.measures`."""


def metric(
    *whose: str,
    meaning: str,
    dtype: str = NUMBER,
    source: str = "",
    mean: str = "",
    unit: str = "",
    optional: bool = False,
    name: str = "",
) -> Callable[[Callable[[Any], Value]], Callable[[Any], Value]]:
    """Enter a function of a `Drive` into `METRICS`: its name is that of the column, unless another one is given."""

    def enter(function: Callable[[Any], Value]) -> Callable[[Any], Value]:
        column = Column(name or function.__name__, dtype, meaning, source=source, unit=unit, optional=optional)
        METRICS.append(Metric(column=column, whose=whose, mean=mean, of=function))
        return function

    return enter


def finite(values: FloatArray, statistic: Callable[[FloatArray], float]) -> float | None:
    """A statistic of the measured values; None without any."""
    measured = values[np.isfinite(values)]
    return float(statistic(measured)) if len(measured) else None


@metric("ego", "person", meaning="Mean speed while driving.", source="the paper, step 1c", mean="mean_speed_mps")
def mean_speed_mps(drive: Drive) -> float | None:
    return finite(drive.of("speed_mps"), np.mean)


@metric(
    "ego",
    meaning="Mean gap to the leader, bumper to bumper, over the steps with one.",
    source="the paper, step 1c",
    mean="trailing_distance_m",
)
def trailing_distance_m(drive: Drive) -> float | None:
    return finite(drive.of("leader_gap_m"), np.mean)


@metric(
    "ego",
    meaning="Least time to collision (TTC) with a road user: oriented boxes at constant headings and speeds; 0 at "
    "contact.",
    source="Hayward 1972, Near-miss determination through use of a scale of danger, for boxes at any angle",
    mean="min_ttc_s",
)
def min_ttc_s(drive: Drive) -> float | None:
    return finite(drive.of("time_to_collision_s"), np.min)


@metric("ego", "conduct", meaning="Strongest braking; 0 without any.", mean="max_deceleration_mps2")
def max_deceleration_mps2(drive: Drive) -> float | None:
    return finite(np.maximum(-drive.acceleration_mps2, 0.0), np.max)


@metric(
    "ego",
    "conduct",
    meaning="Greatest lateral acceleration, to either side; empty where SUMO drives.",
    mean="max_lateral_acceleration_mps2",
)
def max_lateral_acceleration_mps2(drive: Drive) -> float | None:
    steering_is_known = drive.game.steers[drive.player]  # SUMO's cars change lanes without a steering angle
    return finite(np.abs(drive.of("lateral_acceleration_mps2")), np.max) if steering_is_known else None


@metric("ego", meaning="Time until the goal; empty without it.")
def time_to_goal_s(drive: Drive) -> float | None:
    return len(drive.payoff) * drive.step_s if drive.outcome is Outcome.GOAL else None


@metric("ego", "person", meaning="Number of stop lines passed on red.")
def red_lights(drive: Drive) -> float:
    return float(np.count_nonzero(drive.of("passed_red_s") >= 0.0))


@metric("person", "conduct", meaning="Longest time since the onset of red at which the player passed a stop line.")
def latest_red_s(drive: Drive) -> float | None:
    passed_red_s = drive.of("passed_red_s")
    return finite(passed_red_s[passed_red_s >= 0.0], np.max)


@metric("ego", "person", meaning="Time among oncoming lanes.")
def wrong_way_s(drive: Drive) -> float:
    return float(drive.of("wrong_way").sum()) * drive.step_s


@metric(
    "ego",
    "conduct",
    meaning="Least gap that the player accepted: the time that a road user with priority would have needed to the zone "
    "of conflict at constant speed when the player entered it; 0 if it was inside.",
)
def accepted_gap_s(drive: Drive) -> float | None:
    return finite(np.array([each.gap_s for each in drive.encounters if each.must_yield]), np.min)


@metric(
    "ego",
    "person",
    meaning="The player's own payoff, summed over the game.",
    source="the paper, equation 1",
    mean="ego_payoff",
)
def payoff(drive: Drive) -> float:
    return float(drive.payoff.sum())


@metric(
    "ego",
    meaning="Interventions of the shield per km driven: each a run of steps in which it changes the decision; empty "
    "in arms without a shield, and no column in runs without one.",
    mean="shield_interventions_per_km",
    unit="1/km",
    optional=True,
)
def shield_interventions_per_km(drive: Drive) -> float | None:
    flags, driven_m = drive.flags("shielded"), float(drive.of("speed_mps").sum()) * drive.step_s
    if flags is None or not driven_m:
        return None
    begins = np.diff(flags.astype(np.int64), prepend=0) > 0
    return float(np.count_nonzero(begins)) / (driven_m / 1000.0)


@metric(
    "ego",
    meaning="Share of the steps in which the shield changes the decision; empty in arms without a shield, and no "
    "column in runs without one.",
    mean="shielded_share",
    unit=SHARE,
    optional=True,
)
def shielded_share(drive: Drive) -> float | None:
    return drive.share("shielded")


@metric(
    "ego",
    meaning="Share of the steps in which its perception has lost a road user or obstacle in range; empty in arms "
    "without perception errors, and no column in runs without them.",
    mean="lost_share",
    unit=SHARE,
    optional=True,
)
def lost_share(drive: Drive) -> float | None:
    return drive.share("ego_lost")


@metric(
    "ego",
    meaning="Share of the steps in which it sees a ghost; empty in arms without perception errors, and no column in "
    "runs without them.",
    mean="ghost_share",
    unit=SHARE,
    optional=True,
)
def ghost_share(drive: Drive) -> float | None:
    return drive.share("ego_ghosts")
