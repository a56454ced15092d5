"""A Gymnasium environment for one player, and a PettingZoo environment for both.

Each environment has its own arena with one game. A process may contain any number of environments: the first runs SUMO
in the process itself, each further one in a process of its own (`harness.traffic.open_simulation`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from harness.config.persona import Persona
from harness.config.toml_reading import nearest, read_document
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import ACTIONS, read_policy
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat, Step
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.attention import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation import observe
from harness.game.observation_layout import SIZE
from harness.game.seeding import generator_of
from harness.game.state import ROLES, Outcome
from harness.traffic.scene import OpenScene, open_scene

SCENE, PERSONA = "networks/merge", "personas/careful.toml"
_CHECKOUT = Path(__file__).resolve().parents[2]

Place: TypeAlias = str | Path
Info: TypeAlias = dict[str, Any]


class DrivingEnv(gymnasium.Env[Any, Any]):
    """One player's game on a scene with SUMO traffic. Also `gymnasium.make("harness/Ego-v0")`, `"harness/NonEgo-v0"`.

    Observation: Box(-1, 1, (98,), float32), in the player's frame; `harness.game.observation_layout` names its entries.
    An entry x is divided by its scale and clipped to [-1, 1], or compressed:

    | entries | quantity | scale |
    | --- | --- | --- |
    | 0, 1 | speed_mps, speed_limit_mps | 30 m/s |
    | 2 | speed_over_limit, as a share of the limit | 1 |
    | 3 | over_posted_mps, speed over what limits ahead, signals and signs permit | x/(|x| + 5 m/s) |
    | 4 | acceleration_mps2 | 10 m/s2 |
    | 5, 6 | steering_rad, road_steering_rad (the angle that follows the route) | the car's lock |
    | 7, 8 | lane_end_m, goal_m, distance to the end of the player's lane and to the goal | 100 m, 200 m |
    | 9-11 | own_side_left_m, own_side_right_m (marks to oncoming lanes), path_left_m (the route's line) | 8 m |
    | 12-17 | path_turned_rad, the route's heading 0, 5, 10, 20, 30, 50 m ahead | x/(|x| + 0.5 rad) |
    | 18-23 | path_bend_per_m, the tightest bend from there on to the next | x/(|x| + 0.1/m) |
    | 24-29, 30-35 | free_left_m, free_right_m, to the nearest surface on that side (right negative), there | 8 m |
    | 36 | stop_line_m, distance of the front bumper to the next stop line | x/(|x| + 20 m) |
    | 37-41 | at that line: give_way, stop_sign, signal_green, signal_yellow, signal_red | 1 |
    | 42 | signal_s, time since the signal changed | x/(|x| + 5 s) |
    | 43-45 | leader_seen (0 or 1), leader_gap_m, leader_mps (relative), ahead | 1, x/(|x| + 20 m), + 10 m/s |
    | 46-58 | other0, the most urgent road user: seen (0 or 1), ahead_m, left_m | 1, x/(|x| + 20 m), + 8 m |
    |  | ahead_mps (relative), left_mps (absolute) | x/(|x| + 10 m/s), + 5 m/s |
    |  | turned_sin, turned_cos (its heading), length_m, width_m | 1, 1, 20 m, 4 m |
    |  | own_to_conflict_m, other_to_conflict_m, to the place where the two ways meet | x/(|x| + 20 m) |
    |  | arrives_later_s than the player, has_priority (1, -1, 0 without a conflict) | x/(|x| + 3 s), 1 |
    | 59-71, 72-84, 85-97 | other1 to other3, the next most urgent; zeros if there are fewer | as other0 |

    Action: Box(-1, 1, (2,), float32): pedals (-1 full brake, 0 coast, 1 full throttle) and wheel (0 follows the route;
    -1 and 1 add the largest angle to the right and to the left; the largest useful angle depends on the speed).

    Reward: float, the step's payoff to the player's persona (equation 1 of the paper).

    End: terminated when the player reaches its goal or touches a vehicle or a rail; truncated when the scene's time
    limit is up. (Training in campaigns treats the time limit as a termination, because there it is a failure.)

    Info: `outcome` ("" while the game runs, then goal, collision, rail or timeout), `terms` (the reward by term of the
    payoff), `station_m` and `goal_m` (distance along the route, and to the goal), `speed_mps`, `time_s`.

    Each game is drawn from the environment's random generator: the same seed gives the same games, including the random
    numbers of SUMO.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - declared so by Gymnasium

    def __init__(
        self,
        scene: Place | OpenScene = SCENE,
        player: str = "ego",
        persona: Place = PERSONA,
        other: Place | None = None,
        other_persona: Place | None = None,
        render_mode: None = None,
    ) -> None:
        """Open the scene and load SUMO.

        `player` ("ego" or "non_ego") is the learner; it has the payoff and the human factors of `persona`. `other` is
        the driver of the other player: None (the player is alone), "sumo", or the folder of a policy, which has the
        human factors of `other_persona`. Paths are relative to the working directory or, if they do not exist there,
        to the harness's checkout. Raises UsageError for arguments that are wrong and files that can't be read,
        SimulationError if SUMO fails.
        """
        if player not in ROLES:
            raise UsageError.of("DrivingEnv", "player", f"there is no player {player!r}", nearest(player, ROLES))
        if other in (None, "sumo") and other_persona is not None:
            raise UsageError.of("DrivingEnv", "other_persona", "only a policy has a persona", "leave it out")
        self._player = ROLES.index(player)
        own = _read_persona(persona)
        opponent_persona = _read_persona(other_persona or PERSONA)
        if other is None or other == "sumo":
            opponent = Seat(SumoDriver())
        else:
            sampled = opponent_persona.decisions == "sampled"
            opponent = Seat(LearnedDriver(read_policy(_resolve(other)), sampled))
        opponent_factors = opponent_persona.human_factors if other_persona else HumanFactors()
        seats, human_factors, present = [opponent] * 2, [opponent_factors] * 2, [1.0] * 2
        seats[self._player], human_factors[self._player] = Seat(None, own.payoff), own.human_factors
        present[1 - self._player] = float(other is not None)
        self._game = _Game(scene, seats, human_factors, present)
        self._running = False
        self.render_mode = render_mode
        self.observation_space = _observation_space()
        self.action_space = _action_space()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[FloatArray, Info]:
        """Reset to the next game that the generator draws. There are no options."""
        super().reset(seed=seed)
        self._game.reset(self.np_random)
        self._running = True
        return self._game.observation(self._player), self._game.info(self._player)

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, Info]:
        """Drive one step. Raises ResetNeeded if no game is running, ValueError if the action is not finite,
        ImpossibleNumber if a number of the game is impossible."""
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

    def close(self) -> None:
        """Close the SUMO simulation. The environment can't be used afterwards."""
        self._running = False
        self._game.arena.close()


class ParallelDrivingEnv(ParallelEnv[str, FloatArray, FloatArray]):
    """The two players' game with the agents "ego" and "non_ego".

    Observation, action, end and info of each agent: as in `DrivingEnv`, in dictionaries by agent.

    Reward: float per agent, the step's payoff to the agent's own persona.

    End of an agent: it is removed from `agents`. At its goal it leaves the scene; after a crash it stays as an
    obstacle. The other agent continues until its own end.
    """

    metadata: dict[str, Any] = {"name": "driving_v0", "render_modes": []}  # noqa: RUF012 - declared so by PettingZoo

    def __init__(
        self,
        scene: Place | OpenScene = SCENE,
        ego_persona: Place = PERSONA,
        non_ego_persona: Place = PERSONA,
        render_mode: None = None,
    ) -> None:
        """Open the scene and load SUMO. Paths and errors are those of `DrivingEnv`."""
        personas = [_read_persona(ego_persona), _read_persona(non_ego_persona)]
        seats = [Seat(None, each.payoff) for each in personas]
        self._game = _Game(scene, seats, [each.human_factors for each in personas], [1.0, 1.0])
        self._generator: np.random.Generator | None = None
        self.render_mode = render_mode
        self.possible_agents = list(ROLES)
        self.agents: list[str] = []
        self.observation_spaces = {agent: _observation_space() for agent in ROLES}
        self.action_spaces = {agent: _action_space() for agent in ROLES}

    def observation_space(self, agent: str) -> gymnasium.spaces.Box:
        """An agent's observation space, Box(-1, 1, (98,), float32)."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """An agent's action space, Box(-1, 1, (2,), float32)."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, FloatArray], dict[str, Info]]:
        """Reset to the next game that the generator draws. There are no options."""
        if seed is not None or self._generator is None:
            self._generator, _ = seeding.np_random(seed)
        self._game.reset(self._generator)
        self.agents = list(ROLES)
        players = range(len(ROLES))
        return (
            {ROLES[k]: self._game.observation(k) for k in players},
            {ROLES[k]: self._game.info(k) for k in players},
        )

    def step(
        self, actions: Mapping[str, FloatArray]
    ) -> tuple[dict[str, FloatArray], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]]:
        """Drive one step with an action for each of `agents`. Raises KeyError if an action is missing, and as
        `DrivingEnv.step`."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        players = {agent: ROLES.index(agent) for agent in self.agents}
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

    def close(self) -> None:
        """Close the SUMO simulation. The environment can't be used afterwards."""
        self.agents = []
        self._game.arena.close()


class _Game:
    """An arena with one game, which is reset from a random generator."""

    def __init__(
        self,
        scene: Place | OpenScene,
        seats: Sequence[Seat],
        human_factors: Sequence[HumanFactors],
        present: Sequence[float],
    ) -> None:
        self._scene = scene if isinstance(scene, OpenScene) else open_scene(_resolve(scene))
        self._start_distribution = self._scene.start_distribution(human_factors, present)
        self.arena = Arena(self._scene, 1, seats)

    def reset(self, generator: np.random.Generator) -> None:
        parts = ("environment", int(generator.integers(2**63 - 1)))
        start = draw_initial_state(self._start_distribution, *parts)
        self.arena.reload(start.seed)
        self.arena.reset({0: start}, {0: self._scene.departures(generator_of(*parts, "others"))})

    def play(self, actions: Mapping[int, FloatArray]) -> Step:
        array = np.zeros((1, len(ROLES), ACTIONS))
        for player, action in actions.items():
            array[0, player] = action
        if not np.isfinite(array).all():
            raise ValueError(f"an action is not finite: {dict(actions)}")
        return self.arena.step(array)

    def ended(self, player: int) -> tuple[bool, bool]:
        """Whether the player's game was terminated, and whether it was truncated."""
        outcome = self.arena.state.outcome[0, player]
        return bool(outcome not in (Outcome.RUNNING, Outcome.TIMEOUT)), bool(outcome == Outcome.TIMEOUT)

    def observation(self, player: int, step: Step | None = None) -> FloatArray:
        """The player's observation [SIZE]; in its last step, the one before it was removed or stopped."""
        if step is not None and any(self.ended(player)):
            return observe(step.quantities)[0, player]
        return self.arena.observation[0, player].copy()

    def info(self, player: int, step: Step | None = None) -> Info:
        state = self.arena.state if step is None else step.quantities.state
        station_m = float(state.station_m[0, player])
        payoff = self.arena.seats[player][0].payoff
        terms = {} if step is None or payoff is None else payoff.evaluate(step.quantities, player)
        return {
            "outcome": Outcome(int(state.outcome[0, player])).word,
            "terms": {name: float(share[0]) + 0.0 for name, share in terms.items()},
            "station_m": station_m,
            "goal_m": float(self.arena.world.road.routes.goal_m[player]) - station_m,
            "speed_mps": float(state.speed_mps[0, player]),
            "time_s": float(state.step[0]) * self.arena.world.step_s,
        }


def _observation_space() -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-1.0, 1.0, (SIZE,), np.float32)


def _action_space() -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)


def _resolve(written: Place) -> Path:
    """A path relative to the working directory or, if it does not exist there, to the harness's checkout."""
    path = Path(written)
    return _CHECKOUT / path if not path.exists() and (_CHECKOUT / path).exists() else path


def _read_persona(written: Place) -> Persona:
    return read_document(_resolve(written), Persona)
