"""A game as other people's learners know games: a Gymnasium environment for one player, a PettingZoo one for both.

Each has an arena of its own, with one game. Any number of them may live in one process: the first has SUMO in the
process itself, further ones in a process each (`harness.traffic.open_simulation`).
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
from harness.game.observation import SIZE, observe
from harness.game.seeding import generator_of
from harness.game.state import ROLES, Outcome
from harness.traffic.scene import OpenScene, open_scene

SCENE, PERSONA = "networks/merge", "personas/careful.toml"
_CHECKOUT = Path(__file__).resolve().parents[2]

Place: TypeAlias = str | Path
Info: TypeAlias = dict[str, Any]


class DrivingEnv(gymnasium.Env[Any, Any]):
    """One player's game on a scene of SUMO traffic. Also `gymnasium.make("harness/Ego-v0")`, `"harness/NonEgo-v0"`.

    Observation: Box(-1, 1, (46,), float32), in the player's own frame; `harness.game.observation.LAYOUT` names its
    entries. Each is divided by its scale and clipped.

    | entries | what | scale |
    | --- | --- | --- |
    | 0 | speed_mps | 30 m/s |
    | 1 | speed_over_limit, as a share of the limit | 1 |
    | 2 | acceleration_mps2 | 10 m/s2 |
    | 3 | steering_rad | the car's lock |
    | 4 | lane_end_m, how far the player's lane goes on | 100 m |
    | 5 | goal_m, how far the goal is | 200 m |
    | 6-11 | path_turned_rad, the route's heading 0, 5, 10, 20, 30, 50 m ahead, against the player's | 0.5 rad |
    | 12 | path_left_m, how far to the left the route's line is | 8 m |
    | 13-18 | free_left_m, to the nearest surface on the left, at the same distances | 8 m |
    | 19-24 | free_right_m, to the nearest surface on the right (negative) | 8 m |
    | 25-31 | other0, the nearest other: seen (0 or 1), ahead_m, left_m, | 1, 50 m, 8 m, |
    |  | ahead_mps (relative), left_mps (absolute), turned_sin, turned_cos | 10 m/s, 5 m/s, 1, 1 |
    | 32-38, 39-45 | other1 and other2, the next nearest; zeros where there are fewer | |

    Action: Box(-1, 1, (2,), float32): pedals (-1 full brake, 0 coast, 1 full throttle) and wheel (-1 as far right,
    1 as far left as is of use at this speed).

    Reward: the step's payoff to the player's persona, equation 1 of the paper.

    End: terminated when the player reaches its goal, touches a vehicle or a rail; truncated when the scene's time
    limit is up (training in campaigns, where the time limit is a failure, treats it as an end of the game too).

    Info: `outcome` ("" while the game runs, then goal, collision, rail or timeout), `terms` (the reward by the
    payoff's terms), `station_m` and `goal_m` (way along the route, and to the goal), `speed_mps`, `time_s`.

    A game is drawn from the environment's random generator: the same seed gives the same games, SUMO's chance included.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

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

        `player` ("ego" or "non_ego") is learned, for the payoff and with the habits of `persona`. `other` is the
        other player's driver: None (nobody, the player is alone), "sumo", or the folder of a policy, which drives
        with the habits of `other_persona`. Paths are looked for from the working directory, then in the
        harness's own checkout. Raises UsageError for what can't be found or read, SimulationError where SUMO fails.
        """
        if player not in ROLES:
            raise UsageError.of("DrivingEnv", "player", f"there is no player {player!r}", nearest(player, ROLES))
        if other in (None, "sumo") and other_persona is not None:
            raise UsageError.of("DrivingEnv", "other_persona", "only a policy has a persona", "leave it out")
        self._player = ROLES.index(player)
        own = _read_persona(persona)
        theirs = _read_persona(other_persona or PERSONA)
        if other is None or other == "sumo":
            opponent = Seat(SumoDriver())
        else:
            opponent = Seat(LearnedDriver(read_policy(_found(other)), theirs.decisions == "sampled"))
        seats, human_factors, present = (
            [opponent] * 2,
            [theirs.human_factors if other_persona else HumanFactors()] * 2,
            [1.0] * 2,
        )
        seats[self._player], human_factors[self._player] = Seat(None, own.payoff), own.human_factors
        present[1 - self._player] = float(other is not None)
        self._game = _Game(scene, seats, human_factors, present)
        self._running = False
        self.render_mode = render_mode
        self.observation_space = _observation_space()
        self.action_space = _action_space()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[FloatArray, Info]:
        """Start the next game that the generator draws. There are no options."""
        super().reset(seed=seed)
        self._game.start(self.np_random)
        self._running = True
        return self._game.seen(self._player), self._game.info(self._player)

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, Info]:
        """Drive one step. Raises ResetNeeded if no game is running, ValueError if the action is not finite,
        ImpossibleNumber where what came of it can't be right."""
        if not self._running:
            raise gymnasium.error.ResetNeeded("no game is running: call reset first")
        step = self._game.play({self._player: action})
        terminated, truncated = self._game.ended(self._player)
        self._running = not (terminated or truncated)
        return (
            self._game.seen(self._player, step),
            float(step.payoff[0, self._player]),
            terminated,
            truncated,
            self._game.info(self._player, step),
        )

    def close(self) -> None:
        """Give SUMO back; the environment is of no more use."""
        self._running = False
        self._game.arena.close()


class ParallelDrivingEnv(ParallelEnv[str, FloatArray, FloatArray]):
    """The two players' game: agents "ego" and "non_ego", each as in `DrivingEnv`, each paid by its own persona.

    An agent whose game has ended is no longer among `agents`: at its goal it leaves the scene, after a crash it
    stands there as an obstacle. The other drives on until its own end.
    """

    metadata: dict[str, Any] = {"name": "driving_v0", "render_modes": []}  # noqa: RUF012 - as PettingZoo declares it

    def __init__(
        self,
        scene: Place | OpenScene = SCENE,
        ego_persona: Place = PERSONA,
        non_ego_persona: Place = PERSONA,
        render_mode: None = None,
    ) -> None:
        """Open the scene and load SUMO. Paths and errors are as in `DrivingEnv`."""
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
        """What an agent sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """What an agent does."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, FloatArray], dict[str, Info]]:
        """Start the next game that the generator draws. There are no options."""
        if seed is not None or self._generator is None:
            self._generator, _ = seeding.np_random(seed)
        self._game.start(self._generator)
        self.agents = list(ROLES)
        players = range(len(ROLES))
        return (
            {ROLES[k]: self._game.seen(k) for k in players},
            {ROLES[k]: self._game.info(k) for k in players},
        )

    def step(
        self, actions: Mapping[str, FloatArray]
    ) -> tuple[dict[str, FloatArray], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]]:
        """Drive one step with an action for each of `agents`. Raises KeyError where one has none, and as
        `DrivingEnv.step` does."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        players = {agent: ROLES.index(agent) for agent in self.agents}
        step = self._game.play({player: actions[agent] for agent, player in players.items()})
        ended = {agent: self._game.ended(player) for agent, player in players.items()}
        self.agents = [agent for agent in self.agents if not any(ended[agent])]
        return (
            {agent: self._game.seen(player, step) for agent, player in players.items()},
            {agent: float(step.payoff[0, player]) for agent, player in players.items()},
            {agent: terminated for agent, (terminated, _) in ended.items()},
            {agent: truncated for agent, (_, truncated) in ended.items()},
            {agent: self._game.info(player, step) for agent, player in players.items()},
        )

    def close(self) -> None:
        """Give SUMO back; the environment is of no more use."""
        self.agents = []
        self._game.arena.close()


class _Game:
    """An arena with one game, which is started anew from a random generator."""

    def __init__(
        self,
        scene: Place | OpenScene,
        seats: Sequence[Seat],
        human_factors: Sequence[HumanFactors],
        present: Sequence[float],
    ) -> None:
        self._scene = scene if isinstance(scene, OpenScene) else open_scene(_found(scene))
        self._start_distribution = self._scene.start_distribution(human_factors, present)
        self.arena = Arena(self._scene, 1, seats)

    def start(self, generator: np.random.Generator) -> None:
        parts = ("environment", int(generator.integers(2**63 - 1)))
        start = draw_initial_state(self._start_distribution, *parts)
        self.arena.reload(start.seed)
        self.arena.reset({0: start}, {0: self._scene.departures(generator_of(*parts, "others"))})

    def play(self, actions: Mapping[int, FloatArray]) -> Step:
        given = np.zeros((1, len(ROLES), ACTIONS))
        for player, action in actions.items():
            given[0, player] = action
        if not np.isfinite(given).all():
            raise ValueError(f"an action is not finite: {dict(actions)}")
        return self.arena.step(given)

    def ended(self, player: int) -> tuple[bool, bool]:
        """Whether the player's game was terminated, and whether it was truncated."""
        outcome = self.arena.state.outcome[0, player]
        return bool(outcome not in (Outcome.RUNNING, Outcome.TIMEOUT)), bool(outcome == Outcome.TIMEOUT)

    def seen(self, player: int, step: Step | None = None) -> FloatArray:
        """What the player sees; at its end, what it saw last, before it left or came to stand."""
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


def _found(written: Place) -> Path:
    """A path from the working directory or, if there is none there, from the harness's own checkout."""
    path = Path(written)
    return _CHECKOUT / path if not path.exists() and (_CHECKOUT / path).exists() else path


def _read_persona(written: Place) -> Persona:
    return read_document(_found(written), Persona)
