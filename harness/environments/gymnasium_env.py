"""A Gymnasium environment for one player, and a PettingZoo environment for all.

Each environment has its own arena with one game. A process may contain any number of environments: the first runs SUMO
in the process itself, each further one in a process of its own (`harness.sumo.subprocess_simulation`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Seat
from harness.environments.live_simulation import LiveSimulation
from harness.environments.seats import PERSONA, SCENE, Place, opened_scene, read_persona, seating_of
from harness.environments.single_game import RENDER_MODES, Info, SingleGame, space_of
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.observation_layout import SIZE
from harness.road.scene.open_scene import OpenScene

_PICTURES_PER_S = 10  # the steps of the shipped scenes; an environment has those of its own scene


class DrivingEnv(LiveSimulation, gymnasium.Env[Any, Any]):
    """One player's game on a scene with SUMO traffic. Also `gymnasium.make("harness:harness/Ego-v0")`, or `NonEgo-v0`.

    Observation: Box(-1, 1, (98,), float32), in the player's frame. docs/observation.md has its entries,
    `harness.game.observation_layout.LAYOUT` their order.

    Action: Box(-1, 1, (2,), float32): pedals (-1 full brake, 0 coast, 1 full throttle) and wheel (0 follows the route;
    -1 and 1 add the largest angle to the right and to the left; the largest useful angle depends on the speed).

    Reward: float, the step's payoff to the player's persona (equation 1 of the paper).

    End: terminated when the player reaches its goal or touches a vehicle or a rail; truncated when the scene's time
    limit is up. (Training in campaigns treats the time limit as a termination, because there it is a failure.)

    Info, all numbers: `outcome` (an `Outcome`: 0 while the game runs, then 1 goal, 2 collision, 3 rail, 4 timeout),
    `is_success` (whether the goal is reached), `terms` (the reward by term of the payoff), `station_m` and `goal_m`
    (distance along the route, and to the goal), `speed_mps`, `time_s`.

    Each game is drawn from the environment's random generator: the same seed gives the same games, including the random
    numbers of SUMO. `reset(options={"episode": 3, "campaign_seed": 1})` starts a certain game instead: the one that
    the arms of a campaign with that seed have as episode 3.

    Render: `rgb_array` is uint8 [320, 640, 3], the 100 m around the player from above; `human` shows the same in a
    window, in real time at most. Where no window can be opened, `metadata["render_modes"]` lacks it, and it is refused.

    >>> environment = DrivingEnv(other="sumo")
    >>> observation, info = environment.reset(seed=1)
    >>> observation, reward, terminated, truncated, info = environment.step(environment.action_space.sample())
    >>> observation.shape, terminated, info["time_s"]
    ((98,), False, 0.1)
    >>> import harness
    >>> harness.Outcome(info["outcome"]).name
    'RUNNING'
    >>> environment.close()
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": _PICTURES_PER_S}  # noqa: RUF012 - declared so by Gymnasium

    def __init__(
        self,
        scene: Place | OpenScene = SCENE,
        player: str = "ego",
        persona: Place = PERSONA,
        *,
        other: Place | None = None,
        other_persona: Place | None = None,
        render_mode: str | None = None,
        allow_code: bool = False,
    ) -> None:
        """Open the scene and load SUMO.

        `player` (a name of the scene: "ego", "non_ego", with more people "non_ego_2" and so on) is the learner; it
        has the payoff and the human factors of `persona`. `other` is the driver of every other player: None (the player
        is alone), "sumo", or what `[ego] driver` of a campaign may be: the folder of a policy, a driver document, the
        name of a shipped driver, of a shipped policy ("paper_merge/naive-seed11") or of an installed package. It has
        the human factors of `other_persona`. Code in files runs only with `allow_code`. Paths are relative to the
        working directory; scenes and personas also have names, as in a campaign ("merge", "speedy"). Raises UsageError
        for arguments that are wrong and files that can't be read, SimulationError if SUMO fails.
        """
        seating = seating_of(
            scene, player, persona=persona, other=other, other_persona=other_persona, allow_code=allow_code
        )
        self._player = seating.learner
        self._game = SingleGame(seating.scene, seating.seats, seating.start_distribution, render_mode)
        self.metadata = {**self.metadata, **self._game.metadata}
        self._running = False
        self.render_mode = render_mode
        self.observation_space, self.action_space = space_of(SIZE), space_of(ACTIONS)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[FloatArray, Info]:
        """Reset to the next game that the generator draws, or to the episode that `options` name. Raises UsageError for
        other options."""
        super().reset(seed=seed)
        self._game.reset(self.np_random, options)
        self._running = True
        return self._game.observation(self._player), self._game.info(self._player)

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, Info]:
        """Drive one step. Raises ResetNeeded if no game is running, ValueError if the action is not finite or has
        another shape, ImpossibleNumber if a number of the game is impossible."""
        if not self._running:
            raise gymnasium.error.ResetNeeded("no game is running: call reset first")
        step = self._game.play({self._player: action})
        terminated, truncated = self._game.ended(self._player)
        self._running = not (terminated or truncated)
        return (
            self._game.observation(self._player, step),
            float(step.payoff[0, self._player]),
            terminated,
            truncated,
            self._game.info(self._player, step),
        )

    def render(self) -> Any:
        """The picture of a game with the render mode rgb_array; None with the others."""
        return self._game.picture(self._player)

    def close(self) -> None:
        """Close the SUMO simulation. The environment can't be used afterwards."""
        self._running = False
        self._game.close()


class ParallelDrivingEnv(LiveSimulation, ParallelEnv[str, FloatArray, FloatArray]):
    """The players' game with the agents "ego" and "non_ego", with more people "non_ego_2" and so on.

    Observation, action, end and info of each agent: as in `DrivingEnv`, in dictionaries by agent.

    Reward: float per agent, the step's payoff to the agent's own persona.

    End of an agent: it is removed from `agents`. At its goal it leaves the scene; after a crash it stays as an
    obstacle. The other agents continue until their own ends.

    Reset options and render as in `DrivingEnv`; the picture shows what is around the ego.

    >>> environment = ParallelDrivingEnv(non_ego_persona="speedy")
    >>> observations, infos = environment.reset(seed=1)
    >>> straight_on = {agent: [0.0, 0.0] for agent in environment.agents}
    >>> observations, rewards, terminations, truncations, infos = environment.step(straight_on)
    >>> sorted(rewards)
    ['ego', 'non_ego']
    >>> environment.close()
    """

    metadata: dict[str, Any] = {"name": "driving_v0", "render_modes": list(RENDER_MODES), "render_fps": _PICTURES_PER_S}  # noqa: RUF012 - declared so by PettingZoo

    def __init__(
        self,
        scene: Place | OpenScene = SCENE,
        ego_persona: Place = PERSONA,
        non_ego_persona: Place | Sequence[Place] = PERSONA,
        render_mode: str | None = None,
    ) -> None:
        """Open the scene and load SUMO. `non_ego_persona` is one persona for all people of the scene, or one for each.
        Paths and errors are those of `DrivingEnv`."""
        opened = opened_scene(scene)
        self._roles = opened.world.roles
        people = len(self._roles) - 1
        written = [non_ego_persona] * people if isinstance(non_ego_persona, Place) else list(non_ego_persona)
        if len(written) != people:
            message, remedy = f"{len(written)} personas for {people} people", "give one for each, or one for all"
            raise UsageError.of("ParallelDrivingEnv", "non_ego_persona", message, remedy)
        personas = [read_persona(each) for each in (ego_persona, *written)]
        seats = [Seat(None, each.payoff) for each in personas]
        starts = opened.start_distribution([each.human_factors for each in personas], [1.0] * len(personas))
        self._game = SingleGame(opened, seats, starts, render_mode)
        self.metadata = {**self.metadata, **self._game.metadata}
        self._generator: np.random.Generator | None = None
        self.render_mode = render_mode
        self.possible_agents = list(self._roles)
        self.agents: list[str] = []
        self.observation_spaces = {agent: space_of(SIZE) for agent in self._roles}
        self.action_spaces = {agent: space_of(ACTIONS) for agent in self._roles}

    def observation_space(self, agent: str) -> gymnasium.spaces.Box:
        """An agent's observation space, Box(-1, 1, (98,), float32)."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """An agent's action space, Box(-1, 1, (2,), float32)."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, FloatArray], dict[str, Info]]:
        """Reset as `DrivingEnv.reset` does. Other options are ignored: PettingZoo's checker passes some."""
        if seed is not None or self._generator is None:
            self._generator, _ = seeding.np_random(seed)
        self._game.reset(self._generator, options, ignores_others=True)
        self.agents = list(self._roles)
        return (
            {agent: self._game.observation(player) for player, agent in enumerate(self._roles)},
            {agent: self._game.info(player) for player, agent in enumerate(self._roles)},
        )

    def step(
        self, actions: Mapping[str, FloatArray]
    ) -> tuple[dict[str, FloatArray], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]]:
        """Drive one step with an action for each of `agents`. Raises KeyError if an action is missing, and as
        `DrivingEnv.step`."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        players = {agent: self._roles.index(agent) for agent in self.agents}
        step = self._game.play({player: actions[agent] for agent, player in players.items()})
        ended = {agent: self._game.ended(player) for agent, player in players.items()}
        self.agents = [agent for agent in self.agents if not any(ended[agent])]
        return (
            {agent: self._game.observation(player, step) for agent, player in players.items()},
            {agent: float(step.payoff[0, player]) for agent, player in players.items()},
            {agent: terminated for agent, (terminated, _) in ended.items()},
            {agent: truncated for agent, (_, truncated) in ended.items()},
            {agent: self._game.info(player, step) for agent, player in players.items()},
        )

    def render(self) -> Any:
        """As `DrivingEnv.render`, around the ego."""
        return self._game.picture()

    def close(self) -> None:
        """Close the SUMO simulation. The environment can't be used afterwards."""
        self.agents = []
        self._game.close()
