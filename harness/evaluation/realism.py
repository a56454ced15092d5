"""Whether players drive as people do: the metrics of a run's games beside published figures, the table `realism`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd
from scipy.stats import chi2

from harness.evaluation.strategies import (
    Arm,
    NaiveEgo,
    PersonaNonEgo,
    RetrainedEgo,
    persona_alone,
    strategy_name,
)
from harness.evaluation.tables import table_of
from harness.game.outcome import Outcome
from harness.game.roles import EGO, NON_EGO, ROLES

INSIDE, OUTSIDE, NOT_COMPARABLE = "inside", "outside", "not comparable"
LEAST_GAMES = 5
"""A figure that could be measured in fewer games is not compared."""
_TAIL = 0.05  # of the games, on either side of their middle 90 %
_CRASHES = (Outcome.COLLISION.word, Outcome.RAIL.word)
_PER_MILLION_KM = 2.91


class Games(Enum):
    """The games in which a figure is measured."""

    ALONE = "alone on the road"
    ALL = "all"


@dataclass(frozen=True, kw_only=True)
class HumanFigure:
    """A published figure of people, and the metric that is compared with it."""

    metric: str
    """Column of `conduct.csv`."""
    low: float = -math.inf
    high: float = math.inf
    """The range of people: of the median over the games, or of the share of games if `at_most` is given."""
    at_most: float | None = None
    """The figure is the share of the games in which the metric is at most this."""
    games: Games = Games.ALL
    source: str
    """Empty: no published range was found."""

    @property
    def name(self) -> str:
        """Its name in the table."""
        return self.metric if self.at_most is None else f"{self.metric}_at_most_{self.at_most:g}"


OF_DRIVERS = (
    HumanFigure(
        metric="lane_change_s",
        low=3.5,
        high=8.0,
        source="6.28 s, SD 2.0, n = 7,192 (VTTI); 5 to 6 s on average (Toledo and Zohar)",
    ),
    HumanFigure(
        metric="free_over_limit_mps",
        low=-6.2,
        high=7.4,
        games=Games.ALONE,
        source="56 % of drivers above the limit of arterials, 16 to 19 % by 4.5 m/s or more (NHTSA 2015, "
        "DOT HS 812 485): the middle 90 % of the normal distribution with these shares",
    ),
    HumanFigure(metric="following_gap_s", low=1.0, source="1 to 2 s in rush hour, 1 s at least (US-101)"),
    HumanFigure(
        metric="accepted_gap_s", low=2.2, source="critical gap 2.2 s at roundabouts (UMass), 4.87 s for left turns"
    ),
    HumanFigure(
        metric="max_deceleration_mps2",
        high=3.4,
        games=Games.ALONE,
        source="comfortable for 90 % of drivers (AASHTO), on a road where nothing asks for more",
    ),
    HumanFigure(
        metric="max_lateral_acceleration_mps2",
        high=4.0,
        games=Games.ALONE,
        source="our own: half of what tyres hold on a dry road",
    ),
    HumanFigure(
        metric="max_jerk_mps3",
        high=12.65,
        source="the careful and competent driver of UN R157 in an emergency: 0.774 g within 0.6 s",
    ),
    HumanFigure(
        metric="lateral_wander_m",
        high=0.4,
        games=Games.ALONE,
        source="about 0.2 m (Verster and Roth 2011); twice of it",
    ),
    HumanFigure(metric="steering_reversals_per_s", games=Games.ALONE, source=""),
    HumanFigure(
        metric="latest_red_s",
        at_most=2.0,
        low=0.9,
        source="95 % of the drivers that pass on red do so within 2 s (Hunter; Bonneson)",
    ),
    HumanFigure(metric="looks_away_share", games=Games.ALONE, source=""),
    HumanFigure(metric="longest_lapse_s", games=Games.ALONE, source=""),
)
OF_WALKERS = (HumanFigure(metric="accepted_gap_s", low=3.0, source="3 s at least (DiPietro and King 1970)"),)
CRASHES = "crashes_per_million_km"
CRASH_SOURCE = "2.91 crashed vehicles per million km (arXiv 2312.12675v3)"


def realism(conduct: pd.DataFrame, arms: Mapping[str, Arm], *, people_drive: bool) -> pd.DataFrame:
    """The table `realism` from the table `conduct`: a row for each player of a run and each figure.

    `arms`: by name. `people_drive`: the people of the scene are in cars.
    """
    found: list[dict[str, object]] = []
    for player, games in _players(conduct, arms).items():
        of_people = OF_DRIVERS if people_drive or player in _egos(arms.values()) else OF_WALKERS
        found += (_compared(player, figure, games) for figure in of_people)
        found.append(_crashes(player, games[games["alone"]]))
    return table_of("realism", found)


def _egos(arms: Iterable[Arm]) -> set[str]:
    """The naive and the retrained egos of arms, by their names in the table."""
    return {f"{strategy_name(arm.ego)} ego" for arm in arms if isinstance(arm.ego, NaiveEgo | RetrainedEgo)}


def _players(conduct: pd.DataFrame, arms: Mapping[str, Arm]) -> dict[str, pd.DataFrame]:
    """The games of each ego and of each person of round 1. A population's and a crowd's people are left out: a game's
    row does not say which persona drove."""
    own = [arm for arm in arms.values() if arm.best_response_of is None]
    found: dict[str, list[pd.DataFrame]] = {}
    for arm in own:
        games = conduct[conduct["arm"] == arm.name].assign(alone=arm.ego is None or arm.non_ego is None)
        for name in _egos([arm]):
            found.setdefault(name, []).append(games[games["player"] == ROLES[EGO]])
        person = arm.non_ego
        if isinstance(person, PersonaNonEgo) and persona_alone(person.persona) in own:
            rows = games[(games["player"] == ROLES[NON_EGO]) & (games["persona"] == person.persona)]
            found.setdefault(strategy_name(person), []).append(rows)
    return {player: pd.concat(frames, ignore_index=True) for player, frames in found.items()}


def _compared(player: str, figure: HumanFigure, games: pd.DataFrame) -> dict[str, object]:
    chosen = games[games["alone"]] if figure.games is Games.ALONE else games
    values = chosen[figure.metric].dropna().to_numpy(dtype=float)
    few = len(values) < LEAST_GAMES
    value = math.nan
    if not few:
        value = float(np.median(values) if figure.at_most is None else np.mean(values <= figure.at_most))
    comparable = not few and figure.source != ""
    verdict = (INSIDE if figure.low <= value <= figure.high else OUTSIDE) if comparable else NOT_COMPARABLE
    spread = (math.nan, math.nan) if few else np.quantile(values, (_TAIL, 1.0 - _TAIL))
    return {
        "player": player,
        "figure": figure.name,
        "games": len(values),
        "measured_in": figure.games.value,
        "value": value,
        "low": float(spread[0]),
        "high": float(spread[1]),
        "people_low": figure.low if math.isfinite(figure.low) else None,
        "people_high": figure.high if math.isfinite(figure.high) else None,
        "realistic": verdict,
        "reason": _reason(few, figure),
        "source": figure.source,
    }


def _reason(few: bool, figure: HumanFigure) -> str:
    if few:
        return f"measured in fewer than {LEAST_GAMES} games"
    return "" if figure.source else "no published range was found"


def _crashes(player: str, alone: pd.DataFrame) -> dict[str, object]:
    """Crashes per million km alone, with the exact 95 % Poisson interval: outside if the rate of people is below it.

    Else it is not comparable, because so few kilometres prove nothing.
    """
    crashes, million_km = int(alone["outcome"].isin(_CRASHES).sum()), float(alone["distance_m"].sum()) / 1e9
    few = len(alone) < LEAST_GAMES or not million_km
    low = high = value = math.nan
    if not few:
        value = crashes / million_km
        low = float(chi2.ppf(0.025, 2 * crashes)) / 2.0 / million_km if crashes else 0.0
        high = float(chi2.ppf(0.975, 2 * crashes + 2)) / 2.0 / million_km
    outside = low > _PER_MILLION_KM  # false for NaN
    return {
        "player": player,
        "figure": CRASHES,
        "games": len(alone),
        "measured_in": Games.ALONE.value,
        "value": value,
        "low": low,
        "high": high,
        "people_high": _PER_MILLION_KM,
        "realistic": OUTSIDE if outside else NOT_COMPARABLE,
        "reason": "" if outside else f"{1e6 * million_km:.1f} km without another player are too few to tell",
        "source": CRASH_SOURCE,
    }
