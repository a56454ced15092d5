"""Trial of a scene's routes: a rule-based driver drives each player's route alone, from starts drawn for it.

It keeps its lane, cruises, stops at red lights and yields, in the same kinematic car as every learner. A route that it
can't drive is too sharp or too narrow, or its starts are impossible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.drivers.rules_driver import lane_keeper
from harness.environments.arena import Arena, Seat
from harness.errors import Problem, SimulationError, UsageError
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.outcome import Outcome
from harness.road.scene.open_scene import OpenScene

STARTS = 50
"""Starts of each player in a trial."""
_ENDS = {
    Outcome.RAIL: "touches the edge of the road",
    Outcome.COLLISION: "touches an obstacle",
    Outcome.TIMEOUT: "does not reach its goal in time",
}


@dataclass(frozen=True, kw_only=True)
class RouteTrial:
    """The games of one player alone."""

    role: str
    starts: int
    arrived: int
    failure: str
    """The end of the first game that does not reach the goal, in words with place and time; empty if all reach it."""

    def sentence(self) -> str:
        """The finding on a route that can't be driven from every start."""
        share = f"from {self.arrived} of {self.starts} starts"
        return f"{self.role}: alone, a rule-based driver reaches the goal {share}; {self.failure}"


def try_routes(scene: OpenScene, *, starts: int = STARTS) -> list[RouteTrial]:
    """The trial of each player's route. Raises SimulationError if SUMO can't load the scene."""
    world, players = scene.world, range(len(scene.world.roles))
    drawn = {}
    for player in players:
        alone = scene.start_distribution([HumanFactors()] * len(players), [float(each == player) for each in players])
        for number in range(starts):
            drawn[player * starts + number] = draw_initial_state(alone, "route trial", player, number)
    arena = Arena(scene, len(drawn), [Seat(lane_keeper(world, each)) for each in players])
    try:
        arena.reset(drawn)
        lasted_s = np.zeros((arena.games, len(players)))
        while (running := arena.state.running).any():
            lasted_s += world.step_s * running
            arena.step()
        state = arena.state
    finally:
        arena.close()
    trials = []
    for player in players:
        games = np.arange(player * starts, (player + 1) * starts)
        failed = games[state.outcome[games, player] != Outcome.GOAL]
        failure = ""
        if len(failed):
            first = (failed[0], player)
            failure = (
                f"from one of the others it {_ENDS[Outcome(int(state.outcome[first]))]} at ({state.x_m[first]:.1f}, "
                f"{state.y_m[first]:.1f}) after {lasted_s[first]:.1f} s"
            )
        trials.append(
            RouteTrial(role=world.roles[player], starts=starts, arrived=starts - len(failed), failure=failure)
        )
    return trials


def check_routes(scene: OpenScene, remedy: str) -> None:
    """Raise UsageError, with a remedy, for each route that a rule-based driver can't drive from every start."""
    name = scene.folder.name
    try:
        trials = try_routes(scene)
    except (SimulationError, FloatingPointError) as error:
        raise UsageError.of(name, "", f"its routes can't be driven: {error}", remedy) from None
    if problems := [Problem(name, "", trial.sentence(), remedy) for trial in trials if trial.failure]:
        raise UsageError(problems)
