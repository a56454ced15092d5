"""Numbers of a game that can't be right: found in the step in which they appear, and named with player, step and game.

| what | must be | tolerance |
| --- | --- | --- |
| what a driver decides | [N, 2] numbers from -1 to 1 | none |
| where a player is, and how it moves | finite | |
| how far a player moved in a step | within its speed (of before and after) and its car's top speed | below |
| where others near a player are | finite | |
| payoffs | finite, as the learner's 32 bits have them | |
| observations | -1 to 1 | none |

A player whose car the harness moves goes its new speed times the step, so that only rounding is allowed for. Cars
that SUMO moves may go farther by a lane's width: a lane change without duration takes no time.

Nothing goes on from such a number. In an assessment the game is a row with outcome `error`, and the others are
played. A training fails: what was learned from the steps before rests on the same fault, and a game left out
silently would change what is learned.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.observation import LAYOUT
from harness.game.quantities import Quantities
from harness.game.state import ROLES, State

ROUNDING_M = 1e-3  # of positions in a net's coordinates, which may be millions of metres
LANE_CHANGE_M = 6.0  # a wide lane, and what the centre of a car swings when its front turns
_LARGEST = float(np.finfo(np.float32).max)
_FINE, _MOTION, _MOVED, _OTHER, _PAYOFF = range(5)


class ImpossibleNumber(FloatingPointError):
    """A number of the game that can't be right."""


def slack_m(taken_over: BoolArray) -> FloatArray:
    """[P] how much farther than its speed allows a player may move in a step."""
    return np.where(taken_over, ROUNDING_M, LANE_CHANGE_M)


def checked_decisions(decided: Any, driver: object, player: int, games: IntArray, steps: IntArray) -> FloatArray:
    """What a player's driver decided in games [N], as [N, 2]; `steps` [G] are those that were played so far.

    Raises ImpossibleNumber unless that are N times two numbers from -1 to 1.
    """
    who = f"the driver of {ROLES[player]}, {type(driver).__name__},"
    try:
        actions = np.asarray(decided, dtype=float)
    except (TypeError, ValueError):
        text = f"{who} decided {decided!r:.100}, no numbers, {_where(games[0], steps + 1)}"
        raise ImpossibleNumber(text) from None
    if actions.shape != (len(games), 2):
        text = f"decided an array of shape {list(actions.shape)}, not {[len(games), 2]},"
        raise ImpossibleNumber(f"{who} {text} {_where(games[0], steps + 1)}")
    if _outside(actions):
        wrong = int(np.flatnonzero(~(np.abs(actions) <= 1.0).all(1))[0])
        text = f"decided {actions[wrong].tolist()}, not from -1 to 1,"
        raise ImpossibleNumber(f"{who} {text} {_where(games[wrong], steps + 1)}")
    return actions


def check_step(before: State, q: Quantities, drove: BoolArray, payoff: FloatArray, slack: FloatArray) -> None:
    """Look at what a step brought to the players that drove [G, P]; `slack` [P] is `slack_m`.

    Raises ImpossibleNumber for the first thing that can't be right.
    """
    now, bodies, world = q.state, q.bodies, q.world
    what, game, player = _wrong_in_step(
        (before.x_m, before.y_m, before.speed_mps),
        (now.x_m, now.y_m, now.speed_mps, now.heading_rad, now.acceleration_mps2, now.steering_rad, now.station_m),
        (bodies.x_m, bodies.y_m, bodies.speed_mps, bodies.heading_rad),
        bodies.present,
        drove,
        payoff,
        slack,
        world.actuators.max_speed_mps,
        world.step_s,
    )
    if what == _FINE:
        return
    here, where = (game, player), _where(game, now.step)
    if what == _OTHER:
        raise ImpossibleNumber(f"another road user is nowhere, or has no speed, {where}")
    if what == _PAYOFF:
        raise ImpossibleNumber(f"the payoff of {ROLES[player]} is {payoff[here]} {where}")
    if what == _MOTION:
        motion = f"x {now.x_m[here]} m, y {now.y_m[here]} m, heading {now.heading_rad[here]}, {now.speed_mps[here]} m/s"
        raise ImpossibleNumber(f"the motion of {ROLES[player]} is no number {where}: {motion}")
    moved = np.hypot(now.x_m[here] - before.x_m[here], now.y_m[here] - before.y_m[here])
    speed = max(before.speed_mps[here], now.speed_mps[here])
    raise ImpossibleNumber(f"{ROLES[player]} moved {moved:.2f} m {where}, in {world.step_s:g} s at {speed:.2f} m/s")


def check_observation(observation: FloatArray, games: IntArray, steps: IntArray) -> None:
    """Look at what is seen in games [N], [N, P, SIZE]; `steps` [G] are those that were played.

    Raises ImpossibleNumber for the first entry that is not from -1 to 1.
    """
    if _outside(observation):
        n, player, entry = np.argwhere(~(np.abs(observation) <= 1.0))[0].tolist()
        value, where = observation[n, player, entry], _where(games[n], steps)
        raise ImpossibleNumber(f"{ROLES[player]} sees {LAYOUT[entry]} as {value} {where}, not from -1 to 1")


def _where(game: int, steps: IntArray) -> str:
    """In which step and, of several games, in which."""
    return f"in step {steps[game]}" + (f" of game {game}" if len(steps) > 1 else "")


@compiled
def _outside(values: FloatArray) -> int:
    """How many of the values are not from -1 to 1."""
    count = 0
    for value in values.flat:
        count += not abs(value) <= 1.0  # NaN is not
    return count


@compiled
def _wrong_in_step(
    before: tuple[FloatArray, ...],
    now: tuple[FloatArray, ...],
    bodies: tuple[FloatArray, ...],
    present: BoolArray,
    drove: BoolArray,
    payoff: FloatArray,
    slack: FloatArray,
    max_speed_mps: FloatArray,
    step_s: float,
) -> tuple[int, int, int]:
    """What is wrong first, in which game and of which player."""
    x_m, y_m, speed_mps = now[0], now[1], now[2]
    players = drove.shape[1]
    for g, p in np.ndindex(drove.shape):
        if drove[g, p]:
            for values in now:
                if not np.isfinite(values[g, p]):
                    return _MOTION, g, p
            speed = min(max(before[2][g, p], speed_mps[g, p]), max_speed_mps[p])
            if not np.hypot(x_m[g, p] - before[0][g, p], y_m[g, p] - before[1][g, p]) <= speed * step_s + slack[p]:
                return _MOVED, g, p
        for b in range(players, present.shape[1]):
            if present[g, b]:
                for values in bodies:
                    if not np.isfinite(values[g, b]):
                        return _OTHER, g, p
        if not abs(payoff[g, p]) <= _LARGEST:
            return _PAYOFF, g, p
    return _FINE, 0, 0
