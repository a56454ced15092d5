"""What the players know of the bodies around them, and their observations by it: people know each other as of their
reaction time ago (`game.memory`), the ego knows its object list (`game.object_list`)."""

from __future__ import annotations

from collections.abc import Mapping

from harness.environments.nearby_bodies import NearbyBodies
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.field_of_view import Seen
from harness.game.human_factors import PlayersLimits
from harness.game.initial_state import InitialState
from harness.game.memory import Memory, as_they_are
from harness.game.object_list import ObjectLists
from harness.game.observation import as_it_is, observe
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.state import State
from harness.road.scene.open_scene import OpenScene
from harness.sumo.simulation import Reading


class Knowledge:
    """What the players of G games know."""

    def __init__(
        self, scene: OpenScene, games: int, around: tuple[PlayersLimits, NearbyBodies], taken_over: BoolArray
    ) -> None:
        """`taken_over` [P] are the players that the harness drives: SUMO's driver knows what is there."""
        self._limits, self._nearby = around
        world, errors = scene.world, scene.perception_errors
        self._memory = Memory(games, len(world.roles), world.step_s)
        self.object_lists: ObjectLists | None = None
        """Of the ego; None: it sees what is there."""
        if errors is not None and taken_over[EGO]:
            self.object_lists = ObjectLists(errors, games, world.steps, world.step_s)

    def reset(self, starts: Mapping[int, InitialState], state: State) -> None:
        """Begin games."""
        self._memory.begin(state)
        if self.object_lists is not None:
            for game, start in starts.items():
                self.object_lists.reset(game, start.parts)

    def remember(self, state: State) -> None:
        """Keep the motion of the players in this step."""
        if self._limits.delays:
            self._memory.remember(state)

    def observations(
        self, quantities: Quantities, step: IntArray, reading: Reading | None, games: IntArray, *, advance: bool
    ) -> FloatArray:
        """[N, P, SIZE] the observations of games [N], with arguments as of `seen`."""
        return observe(quantities, self.seen(quantities, step, reading, games, advance=advance))

    def seen(
        self, quantities: Quantities, step: IntArray, reading: Reading | None, games: IntArray, *, advance: bool = False
    ) -> Seen:
        """What the players of games [N] take the bodies of these quantities to be, in the steps [G]. `advance`, once
        per step of a game: the ego's perception goes on to this step."""
        lists, delays, bodies = self.object_lists, self._limits.delays, quantities.bodies
        if not delays and lists is None:
            return as_it_is(quantities)
        if delays:
            motion = self._memory.perceived(bodies, self._limits.lags(step)[games], games)
        else:
            motion = as_they_are(bodies, quantities.state.present.shape[1])
        if lists is None:
            return Seen(bodies, motion, quantities.hidden, quantities.meetings)
        names = self._nearby.names(bodies, reading, games)
        if advance:
            lists.advance(quantities, names, games)
        return lists.seen(quantities, motion, names, games)
