"""Lapses of attention: when they occur, and what the driver does and knows in one.

During a lapse of attention the driver's actions are omitted. Paper, section 4.3.2: the distracted driver "omits atomic
actions from the RL model during random intervals", of about 5 s each, the time that reading a text message takes
(NHTSA). The paper's driver releases pedals and wheel, and the car drifts.

A glance at a telephone holds them: the pedals stay as they are, and the wheel follows the road by peripheral sight.
Peripheral sight also ends the glance where the car closes in on the one ahead (`NOTICED_TTC_S`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, exp, log
from typing import Literal

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.road import Routes
from harness.game.seeding import between
from harness.game.state import State

Controls = Literal["released", "held"]

_QUANTILE_95 = 1.6449  # of the standard normal distribution
PERIPHERAL_S = 2.0
"""Time constant with which peripheral sight turns a car to the direction of the road in a glance. Chosen here."""
NOTICED_TTC_S = 4.0
"""Time to collision with the vehicle ahead at which peripheral sight ends a glance. On the road, drivers noticed that
they closed in on the car ahead at 6 to 8 s when they looked at it, and at 4 s when they looked 90 degrees off it
(Lamble, Laakso and Summala, Ergonomics 42, 1999, 807-815)."""


@dataclass(frozen=True, kw_only=True)
class Attention:
    """When attention lapses, and what the car does in a lapse.

    The time between lapses is exponentially distributed. The length of a lapse is drawn uniformly from `lapse_s`, or
    from the lognormal distribution whose middle 90 % it is. During a lapse, pedals and wheel are released or held.
    Bumps add an angle to the wheel that is drawn for each lapse from a normal distribution.
    """

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    lapse_distribution: Literal["uniform", "lognormal"] = "uniform"
    controls: Controls = "released"
    bump_steering_sd_rad: float = 0.0

    @property
    def mean_lapse_s(self) -> float:
        """The mean length of a lapse."""
        if self.lapse_distribution == "uniform":
            return 0.5 * sum(self.lapse_s)
        mean, deviation = self._of_logarithm
        return exp(mean + 0.5 * deviation**2)

    def lapse_at_s(self, generator: np.random.Generator) -> float:
        """Draw the length of a lapse."""
        if self.lapse_distribution == "uniform":
            return between(self.lapse_s, generator.random())
        return float(generator.lognormal(*self._of_logarithm))

    @property
    def _of_logarithm(self) -> tuple[float, float]:
        """Mean and standard deviation of the logarithm of a lapse's length."""
        low, high = map(log, self.lapse_s)
        return 0.5 * (low + high), (high - low) / (2.0 * _QUANTILE_95)


@dataclass(frozen=True)
class Lapses:
    """The lapses of one player in a game of T steps, drawn before the game starts."""

    lapsed: BoolArray  # [T]
    steering_rad: FloatArray  # [T] steering angle that bumps give the wheel in a lapse
    held: bool = False  # whether pedals and wheel are held in a lapse, or released

    @classmethod
    def none(cls, steps: int) -> Lapses:
        """No lapse in a game of `steps` steps."""
        return cls(np.zeros(steps, dtype=bool), np.zeros(steps))


def lags(lapsed: BoolArray, delay_steps: int) -> IntArray:
    """[T] how many steps old is what a player with the lapses [T] knows of the others: the reaction time, and more as
    long as the player did not look then; from the first step on at most the steps played."""
    steps = np.arange(len(lapsed))
    looked = np.maximum.accumulate(np.where(lapsed, 0, steps))
    return steps - looked[np.maximum(steps - delay_steps, 0)]


def draw_lapses(attention: Attention, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw the lapses of one player for a game of `steps` steps of `step_s` seconds.

    Lapses also occur before the game. The probability that a game starts within a lapse is therefore the long-run
    share of time in lapses. The length of this lapse is drawn as that of any other, and a share of it, drawn uniformly,
    is before the game. In a stationary renewal process it would be a longer one: long lapses cover a given time more
    often.
    """
    lapses = replace(Lapses.none(steps), held=attention.controls == "held")
    starts_within = generator.random() < attention.mean_lapse_s / (attention.mean_lapse_s + attention.mean_attentive_s)
    elapsed_share = generator.random() if starts_within else 0.0  # part of the first lapse before the game
    time_s = 0.0 if starts_within else generator.exponential(attention.mean_attentive_s)
    attentive_from = 0
    while time_s < steps * step_s:
        duration_s = attention.lapse_at_s(generator) * (1.0 - elapsed_share)
        steering_rad = generator.normal(0.0, attention.bump_steering_sd_rad)
        first = max(ceil(time_s / step_s), attentive_from)
        end = first + max(round(duration_s / step_s), 1)
        lapses.lapsed[first:end], lapses.steering_rad[first:end] = True, steering_rad
        attentive_from = end + 1  # one attentive step keeps two lapses apart
        time_s += duration_s + generator.exponential(attention.mean_attentive_s)
        elapsed_share = 0.0
    return lapses


class PlayersLapses:
    """The lapses of the players of G games that are played together."""

    def __init__(self, games: int, players: int, steps: int) -> None:
        self._lapsed = np.zeros((games, players, steps), dtype=bool)
        self._steering_rad = np.zeros((games, players, steps))
        self.held = np.zeros((games, players), dtype=bool)
        """Whether a player holds pedals and wheel in a lapse."""

    def reset(self, game: int, player: int, lapses: Lapses) -> None:
        """Set a player's lapses for a game that starts."""
        self._lapsed[game, player], self._steering_rad[game, player] = lapses.lapsed, lapses.steering_rad
        self.held[game, player] = lapses.held

    def omit_actions(
        self,
        requested: tuple[FloatArray, FloatArray],
        state: State,
        road: tuple[FloatArray, Routes],
        wheelbase_m: FloatArray,
        drove: BoolArray,
    ) -> BoolArray:
        """Change the requested accelerations and steering angles [G, P] of players that have a lapse in this step, as
        of `release_controls`. `road` are the steering angles that follow the road [G, P] and the routes, wheelbases are
        [P]. Returns these players [G, P]."""
        steering_rad, routes = road
        if self.held.any():
            heading_rad = routes.heading_rad[routes.rows(state.station_m)]
            steering_rad = held_steering_rad(state, (steering_rad, heading_rad), wheelbase_m)
        lapses = (self._lapsed, self.held, self._steering_rad)
        now = np.minimum(state.step, self._lapsed.shape[-1] - 1)
        return release_controls(requested, (state.acceleration_mps2, steering_rad), lapses, now, drove)

    def end(self, game: int, player: int, step: int) -> BoolArray:
        """End the lapse that a player has in a step, if any, before this step. Returns its steps with a lapse [T]."""
        lapsed = self._lapsed[game, player]
        attentive = np.flatnonzero(~lapsed[step:])
        lapsed[step : step + attentive[0] if len(attentive) else None] = False
        return lapsed


@compiled
def release_controls(
    requested: tuple[FloatArray, FloatArray],
    held: tuple[FloatArray, FloatArray],
    lapses: tuple[BoolArray, BoolArray, FloatArray],
    step: IntArray,
    drove: BoolArray,
) -> BoolArray:
    """Release or hold pedals and wheel of the players whose attention lapses in this step.

    The requested accelerations and steering angles [G, P] are changed in place. Released: no acceleration, and the
    angle that bumps give the wheel. Held: the accelerations and steering angles of `held` [G, P], the latter with the
    angle of the bumps. `lapses` are the steps with a lapse [G, P, T], whether a player holds pedals and wheel [G, P],
    and the steering angles of the bumps [G, P, T]; step [G] the current steps, drove [G, P] the players that still
    drive. Returns [G, P]: the players with a lapse.
    """
    (acceleration_mps2, steering_rad), (lapsed, holds, bump_rad) = requested, lapses
    inattentive = np.zeros(drove.shape, dtype=np.bool_)
    for g, p in np.ndindex(drove.shape):
        if drove[g, p] and lapsed[g, p, step[g]]:
            inattentive[g, p] = True
            acceleration_mps2[g, p], steering_rad[g, p] = 0.0, bump_rad[g, p, step[g]]
            if holds[g, p]:
                acceleration_mps2[g, p] = held[0][g, p]
                steering_rad[g, p] += held[1][g, p]
    return inattentive


def held_steering_rad(state: State, road: tuple[FloatArray, FloatArray], wheelbase_m: FloatArray) -> FloatArray:
    """[G, P] the steering angles of players who look away and hold the wheel: they follow the road, and turn the car to
    its direction. `road` are the steering angles that follow it and its headings [G, P]; wheelbases are [P]."""
    follows_rad, heading_rad = road
    turned_rad = (heading_rad - state.heading_rad + np.pi) % (2.0 * np.pi) - np.pi
    return follows_rad + np.arctan(wheelbase_m * turned_rad / (PERIPHERAL_S * np.maximum(state.speed_mps, 1.0)))
