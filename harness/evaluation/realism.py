"""Whether players drive as people do: the metrics of a run's games beside published figures, the table `realism`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import chi2
from scipy.stats.contingency import odds_ratio

from harness.evaluation.strategies import (
    ATTENTIVE,
    Arm,
    ErrorFreeEgo,
    NaiveEgo,
    PersonaNonEgo,
    RetrainedEgo,
    ShieldedEgo,
    persona_alone,
    strategy_name,
)
from harness.evaluation.tables import table_of
from harness.game.outcome import Outcome
from harness.game.roles import EGO, NON_EGO, ROLES

INSIDE, OUTSIDE, NOT_COMPARABLE = "inside", "outside", "not comparable"
DECLARED = "outside, declared"
"""Outside, as the persona says in `[[unlike_people]]`."""
LEAST_GAMES = 5
"""A figure that could be measured in fewer games is not compared."""
_TAIL = 0.05  # of the games, on either side of their middle 90 %
_CRASHES = (Outcome.COLLISION.word, Outcome.RAIL.word)
_PER_MILLION_KM = 2.91
_ODDS = (1.8, 7.2)


class Games(Enum):
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
    HumanFigure(metric="accepted_gap_s", source=""),
    HumanFigure(
        metric="max_deceleration_mps2",
        high=3.4,
        games=Games.ALONE,
        source="at stop signs no more for most drivers (Transportation Research Record 1937, 2005)",
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
_ROUNDING = 1e-6  # of a figure that a limit of the body holds exactly
OF_RIDERS = (HumanFigure(metric="accepted_gap_s", source=""),)
OF_WALKERS = (
    HumanFigure(metric="accepted_gap_s", low=3.0, source="3 s at least (DiPietro and King 1970)"),
    HumanFigure(
        metric="moving_speed_mps",
        low=0.92,
        high=1.60,
        games=Games.ALONE,
        source="15th percentile of older people 0.92 m/s (TCRP Report 112); 1.36 m/s, SD 0.24 (Randles et al. 2010)",
    ),
)
CRASHES = "crashes_per_million_km"
CRASH_SOURCE = "2.91 crashed vehicles per million km (arXiv 2312.12675v3)"
CRASH_ODDS = "crash_odds_ratio"
ODDS_SOURCE = "3.6 with a hand-held telephone (Dingus et al. 2016, PNAS 113:2636); within a factor of 2"


class _Player(NamedTuple):
    name: str
    persona: str
    """Empty: an ego."""
    seed: int


def realism(
    conduct: pd.DataFrame,
    arms: Mapping[str, Arm],
    declared: Mapping[str, Mapping[str, str]],
    of_people: Sequence[HumanFigure],
) -> pd.DataFrame:
    """The table `realism` from the table `conduct`: a row for each player of a run, training seed and figure.

    `arms`: by name. `declared`: by persona, the figures in which it is known not to be like people, with the reason of
    each. `of_people`: the figures of the people of the scene; an ego has those of drivers.
    """
    found: list[dict[str, object]] = []
    for player, games in _players(conduct, arms).items():
        figures = of_people if player.persona else OF_DRIVERS
        alone = games[games["alone"]]
        rows = [*(_compared(figure, games) for figure in figures), _crashes(alone)]
        attentive = persona_alone(player.persona, ATTENTIVE)
        if player.name == player.persona and attentive.name in arms:
            with_open_eyes = (conduct["arm"] == attentive.name) & (conduct["seed"] == player.seed)
            rows.append(_crash_odds(alone, _of_person(conduct[with_open_eyes], player.persona)))
        reasons = declared.get(player.persona, {})
        found += ({"player": player.name, "seed": player.seed, **_with_reason(row, reasons)} for row in rows)
    return table_of("realism", found)


def _with_reason(row: dict[str, object], reasons: Mapping[str, str]) -> dict[str, object]:
    reason = reasons.get(str(row["figure"])) if row["realistic"] == OUTSIDE else None
    return row if reason is None else row | {"realistic": DECLARED, "reason": reason}


def _players(conduct: pd.DataFrame, arms: Mapping[str, Arm]) -> dict[_Player, pd.DataFrame]:
    """The games of each ego and of each person, by training seed. A population's and a crowd's people are left out: a
    game's row does not say which persona drove."""
    found: dict[_Player, list[pd.DataFrame]] = {}
    for arm, name, persona in _roles(arms.values()):
        games = conduct[conduct["arm"] == arm.name].assign(alone=arm.ego is None or arm.non_ego is None)
        rows = _of_person(games, persona) if persona else games[games["player"] == ROLES[EGO]]
        for seed, of_seed in rows.groupby("seed"):
            found.setdefault(_Player(name, persona, int(str(seed))), []).append(of_seed)
    return {player: pd.concat(frames, ignore_index=True) for player, frames in found.items()}


def _roles(arms: Iterable[Arm]) -> Iterator[tuple[Arm, str, str]]:
    """Each arm with a player of it: its name in the table, and its persona."""
    own = [arm for arm in arms if arm.best_response_of is None and not arm.is_of_a_trait]
    own = [
        arm for arm in own if not isinstance(arm.ego, ShieldedEgo | ErrorFreeEgo)
    ]  # the same people in the same games
    for arm in own:
        if isinstance(arm.ego, NaiveEgo | RetrainedEgo):
            yield arm, f"{strategy_name(arm.ego)} ego", ""
        person = arm.non_ego
        if isinstance(person, PersonaNonEgo) and person.borrowed is None and persona_alone(person.persona) in own:
            yield arm, strategy_name(person), person.persona


def _of_person(games: pd.DataFrame, persona: str) -> pd.DataFrame:
    return games[(games["player"] == ROLES[NON_EGO]) & (games["persona"] == persona)]


def _compared(figure: HumanFigure, games: pd.DataFrame) -> dict[str, object]:
    chosen = games[games["alone"]] if figure.games is Games.ALONE else games
    values = chosen[figure.metric].dropna().to_numpy(dtype=float)
    few = len(values) < LEAST_GAMES
    value = low = high = math.nan
    if not few and figure.at_most is not None:
        value = float(np.mean(values <= figure.at_most))
    elif not few:
        value = float(np.median(values))
        low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL)).tolist()
    comparable = not few and figure.source != ""
    inside = figure.low - _ROUNDING <= value <= figure.high + _ROUNDING
    verdict = (INSIDE if inside else OUTSIDE) if comparable else NOT_COMPARABLE
    return {
        "figure": figure.name,
        "games": len(values),
        "measured_in": figure.games.value,
        "value": value,
        "low": low,
        "high": high,
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


def _crashes(alone: pd.DataFrame) -> dict[str, object]:
    """Crashes per million km alone, with the exact 95 % Poisson interval: outside if the rate of people is below it.

    Else it is not comparable, because so few kilometres prove nothing.
    """
    crashes, million_km = _crashed(alone), float(alone["distance_m"].sum()) / 1e9
    few = len(alone) < LEAST_GAMES or not million_km
    low = high = value = math.nan
    if not few:
        value = crashes / million_km
        low = float(chi2.ppf(0.025, 2 * crashes)) / 2.0 / million_km if crashes else 0.0
        high = float(chi2.ppf(0.975, 2 * crashes + 2)) / 2.0 / million_km
    outside = low > _PER_MILLION_KM  # false for NaN
    return {
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


def _crashed(games: pd.DataFrame) -> int:
    return int(games["outcome"].isin(_CRASHES).sum())


def _crash_odds(lapsing: pd.DataFrame, attentive: pd.DataFrame) -> dict[str, object]:
    """The odds of a crash alone, against those of the same person without lapses: the conditional maximum likelihood
    estimate with the exact 95 % interval (`scipy.stats.contingency.odds_ratio`).

    It is outside if the interval is beside the range of people, and inside if the estimate is in the range. Else there
    are too few crashes to tell.
    """
    sides, (least, most) = (lapsing, attentive), _ODDS
    crashes = [_crashed(games) for games in sides]
    value = low = high = math.nan
    if min(map(len, sides)) >= LEAST_GAMES and 0 < sum(crashes) < sum(map(len, sides)):
        found = odds_ratio([[crashed, len(games) - crashed] for crashed, games in zip(crashes, sides, strict=True)])
        value, (low, high) = float(found.statistic), found.confidence_interval(0.95)
    verdict = OUTSIDE if low > most or high < least else INSIDE if least <= value <= most else NOT_COMPARABLE
    with_lapses, without = (f"{crashed} of {len(games)}" for crashed, games in zip(crashes, sides, strict=True))
    few = f"crashes in {with_lapses} games with lapses and in {without} without are too few to tell"
    return {
        "figure": CRASH_ODDS,
        "games": len(lapsing) + len(attentive),
        "measured_in": Games.ALONE.value,
        "value": value if math.isfinite(value) else None,
        "low": low,
        "high": high if math.isfinite(high) else None,
        "people_low": least,
        "people_high": most,
        "realistic": verdict,
        "reason": few if verdict == NOT_COMPARABLE else "",
        "source": ODDS_SOURCE,
    }
