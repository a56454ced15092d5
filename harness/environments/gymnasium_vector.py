"""The arena as Gymnasium's vector environment: one learner, G games in one SUMO simulation, automatic resets."""

from __future__ import annotations

from typing import Any, Literal, overload

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Arena
from harness.environments.auto_reset import AutoReset
from harness.environments.live_simulation import LiveSimulation
from harness.environments.seats import PERSONA, SCENE, Place, seating_of
from harness.environments.single_game import checked_actions, numbers_of
from harness.environments.vector_env import ACTION_SPACE, OBSERVATION_SPACE, ArenaVecEnv
from harness.errors import UsageError
from harness.game.arrays import BoolArray, FloatArray
from harness.game.outcome import Outcome
from harness.game.state import State
from harness.road.scene.open_scene import OpenScene

_PARTS = "vector environment"
_SEEDS = 2**31 - 1


class VectorDrivingEnv(LiveSimulation, gymnasium.vector.VectorEnv[Any, Any, Any]):
    """G games of `DrivingEnv` in one SUMO simulation. Also `gymnasium.make_vec("harness:harness/Ego-v0", num_envs=64)`.

    Observation, action, reward and end of each game: as in `DrivingEnv`. A game that ends is reset in the same step
    (`AutoresetMode.SAME_STEP`): its last observation and info are in `final_obs` and `final_info`.

    Info: the entries of `DrivingEnv` without `terms`, as arrays [G].

    The same seed gives the same games. They are not those of `DrivingEnv` with that seed: its games each have a SUMO
    simulation of their own.

    >>> environment = VectorDrivingEnv(4, other="sumo")
    >>> observations, info = environment.reset(seed=1)
    >>> observations, rewards, terminations, truncations, info = environment.step(environment.action_space.sample())
    >>> observations.shape, rewards.shape, info["time_s"]
    ((4, 98), (4,), array([0.1, 0.1, 0.1, 0.1]))
    >>> environment.close()
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        scene: Place | OpenScene = SCENE,
        player: str = "ego",
        *,
        persona: Place = PERSONA,
        other: Place | None = None,
        other_persona: Place | None = None,
        render_mode: str | None = None,
        allow_code: bool = False,
    ) -> None:
        """Open the scene and load SUMO with `num_envs` games. The other arguments and errors are those of
        `DrivingEnv`."""
        _check_number(num_envs)
        seating = seating_of(
            scene, player, persona=persona, other=other, other_persona=other_persona, allow_code=allow_code
        )
        if render_mode is not None:
            remedy = "gymnasium.make draws a single environment"
            raise UsageError.of("VectorDrivingEnv", "render_mode", f"is {render_mode!r}: there are no pictures", remedy)
        self.num_envs, self.render_mode = num_envs, None
        self.single_observation_space, self.single_action_space = OBSERVATION_SPACE, ACTION_SPACE
        self.observation_space = batch_space(OBSERVATION_SPACE, num_envs)
        self.action_space = batch_space(ACTION_SPACE, num_envs)
        self._learner, self._start_distribution = seating.learner, seating.start_distribution
        self.arena = Arena(seating.scene, num_envs, seating.seats)
        self._actions = np.zeros((num_envs, len(seating.seats), ACTIONS))
        self._games: AutoReset | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Reset every game: observations [G, 98]. Raises UsageError for options: there are none."""
        if options:
            raise UsageError.of("reset", f"options {sorted(options)}", "mean nothing here", "use harness.DrivingEnv")
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(_SEEDS))
        self.arena.reload(drawn)
        self._games = AutoReset(self.arena, self._start_distribution, _PARTS, drawn)
        self._games.reset(range(self.num_envs))
        return self._observation(), self._info(self.arena.state)

    def step(self, actions: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Drive one step with actions [G, 2]: observations [G, 98], rewards, terminations and truncations [G], info.

        Raises ResetNeeded before the first reset, ValueError for actions of another shape or that are not finite, and
        as `Arena.step`.
        """
        if self._games is None:
            raise gymnasium.error.ResetNeeded("no game is running: call reset first")
        self._actions[:, self._learner] = checked_actions(actions, (self.num_envs, ACTIONS))
        step = self.arena.step(self._actions)
        outcome = self.arena.state.outcome[:, self._learner]
        ended, truncated = outcome != Outcome.RUNNING, outcome == Outcome.TIMEOUT
        final: dict[str, Any] = {}
        if ended.any():
            last, final_obs = step.observation[:, self._learner], np.full(self.num_envs, None, dtype=object)
            for game in np.flatnonzero(ended).tolist():
                final_obs[game] = last[game].copy()
            final = {"final_obs": final_obs, "_final_obs": ended.copy()}
            final |= {"final_info": self._info(step.quantities.state, ended), "_final_info": ended.copy()}
            self._games.reset(np.flatnonzero(ended).tolist())
        payoff = step.payoff[:, self._learner]
        return self._observation(), payoff, ended & ~truncated, truncated, {**self._info(self.arena.state), **final}

    def close_extras(self, **kwargs: Any) -> None:
        """Close the SUMO simulation; called by `close`."""
        self.arena.close()

    def _observation(self) -> FloatArray:
        return self.arena.observation[:, self._learner].copy()

    def _info(self, state: State, of: BoolArray | None = None) -> dict[str, Any]:
        """The numbers [G] of the games in `of` [G], each with its mask."""
        numbers = numbers_of(state, self.arena.world, self._learner)
        mask = np.ones(self.num_envs, dtype=bool) if of is None else of
        return numbers | {f"_{name}": mask.copy() for name in numbers}


@overload
def make_vec(n: int, *, interface: Literal["gymnasium"] = "gymnasium", **arguments: Any) -> VectorDrivingEnv: ...
@overload
def make_vec(n: int, *, interface: Literal["sb3"], seed: int = 0, **arguments: Any) -> ArenaVecEnv: ...
def make_vec(
    n: int, *, interface: Literal["gymnasium", "sb3"] = "gymnasium", seed: int = 0, **arguments: Any
) -> VectorDrivingEnv | ArenaVecEnv:
    """`n` games of one learner in one SUMO simulation: Gymnasium's vector environment, or Stable-Baselines3's `VecEnv`.

    `arguments` are those of `DrivingEnv` without `render_mode`. `seed` is for Stable-Baselines3, whose `reset` has
    none: the same seed gives the same games. Raises as `DrivingEnv`.

    >>> environments = make_vec(4, player="non_ego", persona="speedy", other="sumo", interface="sb3")
    >>> environments.reset().shape
    (4, 98)
    >>> environments.close()
    """
    if interface == "gymnasium":
        return VectorDrivingEnv(n, **arguments)
    if interface != "sb3":
        raise UsageError.of("make_vec", "interface", f"is {interface!r}", "one of gymnasium, sb3")
    _check_number(n)
    seating = seating_of(**arguments)
    arena = Arena(seating.scene, n, seating.seats, seed=seed)
    return ArenaVecEnv(arena, seating.learner, seating.start_distribution, _PARTS, seed)


def _check_number(games: int) -> None:
    if games < 1:
        raise UsageError.of("make_vec", "n", f"is {games}", "give the number of games, at least 1")
