"""The arena as a vector environment for Stable-Baselines3: one learner, G games, automatic resets.

Several arenas, in each of which the learner drives in another place of the scene, are one environment: `JoinedVecEnv`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Arena
from harness.environments.auto_reset import AutoReset, Replays
from harness.environments.live_simulation import LiveSimulation
from harness.environments.seats import Seat, taken_over, with_walkers
from harness.environments.single_game import space_of
from harness.game.arrays import FloatArray
from harness.game.initial_state import StartDistribution
from harness.game.observation_layout import SIZE
from harness.game.outcome import Outcome
from harness.road.scene.open_scene import OpenScene
from harness.sumo.scene_games import SceneGames
from harness.sumo.subprocess_simulation import open_simulations

OBSERVATION_SPACE, ACTION_SPACE = space_of(SIZE), space_of(ACTIONS)

Seats: TypeAlias = Sequence[Sequence[Seat]]
"""[P][n] the seats of the players of a scene."""


@dataclass(frozen=True, kw_only=True)
class Finished:
    """A learner's finished game."""

    road: str
    """The name of its scene."""
    payoff: float
    steps: int
    outcome: Outcome
    alone: bool = False
    """Whether no other player took part."""


class GamesVecEnv(LiveSimulation, VecEnv):
    """Games of one learner: what Stable-Baselines3's `VecEnv` asks for that has no meaning for them."""

    render_mode = None

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The attribute, once for each game in `indices`."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Raises AttributeError: games have no attributes of their own."""
        raise AttributeError(f"the games share all attributes; {attr_name!r} can't be set for some of them")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method once for each game in `indices`."""
        method: Callable[..., Any] = getattr(self, method_name)
        return [method(*args, **kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False for each game: games are not wrapped."""
        return [False for _ in self._get_indices(indices)]


class ArenaVecEnv(GamesVecEnv):
    """G games of one learner, as Stable-Baselines3's `VecEnv`. A game ends when the learner's part in it ends.

    Observation: Box(-1, 1, (98,), float32) per game, [G, 98]; entries as in docs/observation.md.
    A learner with several seats has one entry more for each: 1 for the one that it has in this game, else 0.

    Action: Box(-1, 1, (2,), float32) per game, [G, 2]: pedals and wheel.

    Reward: [G] float32, the step's payoff to the learner's persona times `payoff_scale`.

    End: `done` [G] is true when the learner reaches its goal, touches a vehicle or a rail, or when the time limit is
    up. The game is reset in the same step, and its last observation, before the learner is removed or stopped, is
    `terminal_observation` in `infos`.

    Each game is drawn from `parts`, the number of its tile, and the count of that tile's games.

    >>> import harness
    >>> environments = harness.make_vec(2, other="sumo", interface="sb3")
    >>> observations = environments.reset()
    >>> observations, rewards, done, infos = environments.step([[0.0, 0.0], [0.5, 0.0]])
    >>> done.tolist()
    [False, False]
    >>> environments.close()
    """

    def __init__(
        self,
        arena: Arena,
        learner: int,
        start_distribution: StartDistribution,
        *parts: str | int,
        payoff_scale: float = 1.0,
    ) -> None:
        self._seats = len(arena.seats[learner])
        inputs = SIZE + (self._seats if self._seats > 1 else 0)
        super().__init__(arena.games, space_of(inputs), ACTION_SPACE)
        self.arena, self.learner, self._payoff_scale = arena, learner, payoff_scale
        self._actions = np.zeros((arena.games, len(arena.seats), ACTIONS))
        self._finished: list[Finished] = []
        self.sample_from(start_distribution, *parts)

    def sample_from(
        self, start_distribution: StartDistribution, *parts: str | int, replays: Replays | None = None
    ) -> None:
        """Draw the games of the next `reset` and after from `start_distribution` and `parts`; with `replays`, some are
        played from other starts instead."""
        self._games = AutoReset(self.arena, start_distribution, *parts, replays=replays)
        self._payoff = np.zeros(self.num_envs)

    def reset(self) -> FloatArray:
        """Reset every game. Returns observations [G, SIZE]."""
        self._games.reset(range(self.num_envs))
        return self._seen(self.arena.observation)

    def step_async(self, actions: FloatArray) -> None:
        """Store the learner's actions [G, 2] for `step_wait`. Raises ValueError for another shape."""
        if np.shape(actions) != (self.num_envs, ACTIONS):
            raise ValueError(f"actions have the shape {np.shape(actions)}, not {(self.num_envs, ACTIONS)}")
        self._actions[:, self.learner] = actions

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        """Play a step, and reset the games that ended; their last observations are in `infos`.

        Raises as `Arena.step` does.
        """
        self.place()
        return self.advance()

    def place(self) -> None:
        """The first half of `step_wait` (`Arena.place`)."""
        self.arena.place(self._actions)

    def advance(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        """The second half of `step_wait` (`Arena.advance`)."""
        step = self.arena.advance()
        payoff = step.payoff[:, self.learner].astype(np.float32)
        self._payoff += payoff
        done = ~self.arena.state.running[:, self.learner]
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(done)
        if len(ended):
            last = self._seen(step.observation)
            for game in ended:
                infos[game] = {"terminal_observation": last[game]}
                self._finish(int(game))
            self._games.reset(ended.tolist())
        return self._seen(self.arena.observation), payoff * self._payoff_scale, done, infos

    def _seen(self, observation: FloatArray) -> FloatArray:
        """[G, D] what the learner sees, by the observations of all players, and with several seats which one it has."""
        seen = observation[:, self.learner].copy()
        if self._seats == 1:
            return seen
        which = np.eye(self._seats, dtype=np.float32)[self.arena.member[:, self.learner]]
        return np.concatenate((seen, which), axis=1)

    def take_finished(self) -> list[Finished]:
        """The games that ended since the last call, removed from the list."""
        finished, self._finished = self._finished, []
        return finished

    def reload(self, seed: int) -> None:
        self.arena.reload(seed)

    def close(self) -> None:
        self.arena.close()

    def _finish(self, game: int) -> None:
        state = self.arena.state
        outcome = Outcome(int(state.outcome[game, self.learner]))
        took_part = state.present[game] | (state.outcome[game] != Outcome.RUNNING)  # a player at its goal has left
        payoff, steps, alone = float(self._payoff[game]), int(state.step[game]), int(took_part.sum()) == 1
        road = self.arena.scene.document.name
        self._finished.append(Finished(road=road, payoff=payoff, steps=steps, outcome=outcome, alone=alone))
        self._games.ended(game, payoff)
        self._payoff[game] = 0.0


class JoinedVecEnv(GamesVecEnv):
    """The games of several `ArenaVecEnv`, those of the first environment first."""

    def __init__(self, environments: Sequence[ArenaVecEnv]) -> None:
        self.environments = tuple(environments)
        games = [each.num_envs for each in self.environments]
        super().__init__(sum(games), self.environments[0].observation_space, ACTION_SPACE)
        self._cuts = np.cumsum(games)[:-1]

    def split(self, of_games: np.ndarray) -> list[np.ndarray]:
        """The values [G, ...] of all games, for each environment."""
        return np.split(of_games, self._cuts)

    def reset(self) -> FloatArray:
        return np.concatenate([each.reset() for each in self.environments])

    def step_async(self, actions: FloatArray) -> None:
        for each, own in zip(self.environments, self.split(actions), strict=True):
            each.step_async(own)

    def step_wait(self) -> tuple[FloatArray, FloatArray, Any, list[dict[str, Any]]]:
        for each in self.environments:
            each.place()
        steps = [each.advance() for each in self.environments]
        observation, payoff, done = (np.concatenate([step[part] for step in steps]) for part in range(3))
        return observation, payoff, done, [info for step in steps for info in step[3]]

    def take_finished(self) -> list[Finished]:
        return [game for each in self.environments for game in each.take_finished()]

    def reload(self, seed: int) -> None:
        """Reload SUMO with a seed, the same in every arena: their games differ by their place."""
        for each in self.environments:
            each.reload(seed)

    def close(self) -> None:
        for each in self.environments:
            each.close()


def open_arenas(parts: Sequence[tuple[OpenScene, int, Seats]], *, seed: int) -> list[Arena]:
    """An arena for each part: its scene, its number of games, and the seats of their players. They share one SUMO where
    they can: all of them make the first half of a step (`Arena.place`) before one of them goes on.

    Raises SimulationError if SUMO can't load a scene.
    """
    seated = [(scene, games, with_walkers(seats, scene.world)) for scene, games, seats in parts]
    played = [SceneGames(scene=scene, games=games, taken_over=taken_over(seats)) for scene, games, seats in seated]
    simulations = open_simulations(played, seed=seed)
    try:
        return [
            Arena(scene, games, seats, simulation=simulation)
            for (scene, games, seats), simulation in zip(seated, simulations, strict=True)
        ]
    except BaseException:
        for each in simulations:
            each.close()
        raise
