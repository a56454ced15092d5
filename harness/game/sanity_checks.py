"""Sanity checks of a game's numbers: a fault is reported in the step in which it occurs, with player, step and game.

| number | valid | tolerance |
| --- | --- | --- |
| decisions of a driver | [N, 2] numbers from -1 to 1 | none |
| pose and motion of a player | finite | |
| distance moved in a step | at most the larger speed of the two steps and the car's top speed, times the step | below |
| pose and motion of background vehicles near a player | finite | |
| payoffs | finite as 32-bit numbers, as the learner stores them | |
| observations | -1 to 1 | none |

The tolerance covers rounding. A player that SUMO moves may cover a lane's width more, because a lane change without
duration takes no time. A game does not continue after a fault. In an assessment, it becomes a row with outcome `error`.
A training fails: its earlier steps may have the same fault, and omitting a game would change the training data.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.observation_layout import LAYOUT
from harness.game.quantities import Quantities
from harness.game.roles import roles_of
from harness.game.state import Bodies, PlayersMotion, State, motion_of

ROUNDING_M = 1e-3  # rounding of positions in network coordinates, which may be millions of metres
LANE_CHANGE_M = 6.0  # width of a wide lane, plus the swing of a car's centre
_LARGEST = float(np.finfo(np.float32).max)
_NO_FAULT, _MOTION, _MOVED, _BACKGROUND, _PAYOFF = range(5)


class ImpossibleNumber(FloatingPointError):
    """A number of the game is invalid."""


def checked_decisions(decided: Any, driver: str, games: IntArray, steps: IntArray) -> FloatArray:
    """The decisions of a driver for games [N], as an array [N, 2]. `driver` names it, `steps` [G] are the steps played
    so far. Raises ImpossibleNumber unless the decisions are N pairs of numbers from -1 to 1."""
    subject = f"the driver of {driver}"
    try:
        actions = np.asarray(decided, dtype=float)
    except (TypeError, ValueError):
        text = f"{subject} decided {decided!r:.100}, which are not numbers, {_where(games[0], steps + 1)}"
        raise ImpossibleNumber(text) from None
    if actions.shape != (len(games), 2):
        text = f"decided an array of shape {list(actions.shape)}, not {[len(games), 2]},"
        raise ImpossibleNumber(f"{subject} {text} {_where(games[0], steps + 1)}")
    if _outside(actions):
        row = int(np.flatnonzero(~(np.abs(actions) <= 1.0).all(1))[0])
        text = f"decided {actions[row].tolist()}, not from -1 to 1,"
        raise ImpossibleNumber(f"{subject} {text} {_where(games[row], steps + 1)}")
    return actions


def check_step(before: State, q: Quantities, *, drove: BoolArray, payoff: FloatArray, taken_over: BoolArray) -> None:
    """Check the result of a step: the players that drove [G, P], payoffs [G, P], and the bodies near them.

    taken_over [P] are the players that the harness moves. Raises ImpossibleNumber for the first fault.
    """
    now, bodies, world = q.state, q.bodies, q.world
    fault, game, player = _first_fault(
        (motion_of(before), motion_of(now)),
        tuple(bodies),
        (drove, payoff, taken_over, world.actuators.max_speed_mps),
        world.step_s,
    )
    if fault == _NO_FAULT:
        return
    here, role, where = (game, player), world.roles[player], _where(game, now.step)
    if fault == _BACKGROUND:
        raise ImpossibleNumber(f"a background vehicle has no finite position, heading or speed {where}")
    if fault == _PAYOFF:
        raise ImpossibleNumber(f"the payoff of {role} is {payoff[here]} {where}")
    if fault == _MOTION:
        motion = f"x {now.x_m[here]} m, y {now.y_m[here]} m, heading {now.heading_rad[here]}, {now.speed_mps[here]} m/s"
        raise ImpossibleNumber(f"the motion of {role} is not finite {where}: {motion}")
    moved = np.hypot(now.x_m[here] - before.x_m[here], now.y_m[here] - before.y_m[here])
    speed = max(before.speed_mps[here], now.speed_mps[here])
    raise ImpossibleNumber(f"{role} moved {moved:.2f} m {where}, in {world.step_s:g} s at {speed:.2f} m/s")


def check_observation(observation: FloatArray, games: IntArray, steps: IntArray) -> None:
    """Check the observations [N, P, SIZE] of games [N]; `steps` [G] are the steps played so far.

    Raises ImpossibleNumber for the first entry that is not from -1 to 1.
    """
    if _outside(observation):
        n, player, entry = np.argwhere(~(np.abs(observation) <= 1.0))[0].tolist()
        value, where = observation[n, player, entry], _where(games[n], steps)
        raise ImpossibleNumber(
            f"{roles_of(observation.shape[1])[player]} sees {LAYOUT[entry]} as {value} {where}, not from -1 to 1"
        )


def _where(game: int, steps: IntArray) -> str:
    return f"in step {steps[game]}" + (f" of game {game}" if len(steps) > 1 else "")


@compiled
def _outside(values: FloatArray) -> int:
    """Number of values that are not from -1 to 1."""
    count = 0
    for value in values.flat:
        count += not abs(value) <= 1.0  # also counts NaN
    return count


@compiled
def _first_fault(
    motions: tuple[tuple[Any, ...], tuple[Any, ...]],
    bodies: tuple[Any, ...],
    step: tuple[BoolArray, FloatArray, BoolArray, FloatArray],
    step_s: float,
) -> tuple[int, int, int]:
    """The first fault, its game and its player, from the motion before and after the step, the bodies, and the players
    that drove, payoffs, the players that the harness moves, and top speeds."""
    before, now, among = PlayersMotion(*motions[0]), PlayersMotion(*motions[1]), Bodies(*bodies)
    drove, payoff, taken_over, max_speed_mps = step
    players = drove.shape[1]
    for g, p in np.ndindex(drove.shape):
        if drove[g, p]:
            for values in now:
                if not np.isfinite(values[g, p]):
                    return _MOTION, g, p
            speed = min(max(abs(before.speed_mps[g, p]), abs(now.speed_mps[g, p])), max_speed_mps[p])  # or backwards
            moved_m = np.hypot(now.x_m[g, p] - before.x_m[g, p], now.y_m[g, p] - before.y_m[g, p])
            if not moved_m <= speed * step_s + (ROUNDING_M if taken_over[p] else LANE_CHANGE_M):
                return _MOVED, g, p
        if p == 0:  # the players of a game have the same bodies
            for b in range(players, among.present.shape[1]):
                finite = np.isfinite(among.x_m[g, b]) and np.isfinite(among.y_m[g, b])
                finite = finite and np.isfinite(among.speed_mps[g, b]) and np.isfinite(among.heading_rad[g, b])
                if among.present[g, b] and not finite:
                    return _BACKGROUND, g, p
        if not abs(payoff[g, p]) <= _LARGEST:
            return _PAYOFF, g, p
    return _NO_FAULT, 0, 0
