"""A single game at a time on an arena, reset from a random generator, as the environments of one game need it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import NDArray

from harness.config.toml_reading import nearest
from harness.drivers.policy_file import ACTIONS
from harness.environments.arena import Arena, Seat, Step
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.initial_state import StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.seeding import parts_of
from harness.game.state import Bodies, State
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene

if TYPE_CHECKING:
    from harness.environments.scene_picture import ScenePicture, Window

Info: TypeAlias = dict[str, Any]
RENDER_MODES = ("rgb_array", "human")
"""Of the environments; those of a machine without a screen lack "human"."""
_OPTIONS = ("episode", "campaign_seed")  # of `reset`


class SingleGame:
    """An arena with one game, which is reset from a random generator."""

    def __init__(
        self,
        scene: OpenScene,
        seats: Sequence[Seat],
        start_distribution: StartDistribution,
        render_mode: str | None,
    ) -> None:
        """Load SUMO. Raises UsageError if there is no such render mode, or no window for it; SimulationError if SUMO
        can't load the scene."""
        self.metadata: dict[str, Any] = {"render_modes": _render_modes(), "render_fps": round(1.0 / scene.world.step_s)}
        if render_mode not in (None, *RENDER_MODES):
            remedy = f"one of {', '.join(RENDER_MODES)}"
            raise UsageError.of("environment", "render_mode", f"is {render_mode!r}", remedy)
        if render_mode not in (None, *self.metadata["render_modes"]):
            message = f"is {render_mode!r}, and matplotlib can't open a window here"
            remedy = "use a screen with Tk or Qt (apt-get install python3-tk, pip install PySide6), or rgb_array"
            raise UsageError.of("environment", "render_mode", message, remedy)
        self._scene, self._start_distribution, self._render_mode = scene, start_distribution, render_mode
        self._picture: ScenePicture | None = None
        self._window: Window | None = None
        self._bodies: Bodies | None = None
        self.arena = Arena(scene, 1, seats)

    def reset(
        self, generator: np.random.Generator, options: Mapping[str, Any] | None, *, ignores_others: bool = False
    ) -> None:
        """Reset to the episode that `options` name, or to the next game that the generator draws. Raises UsageError for
        wrong options, and for others unless it ignores them."""
        options = {key: value for key, value in (options or {}).items() if key in _OPTIONS or not ignores_others}
        parts = _named_game(options) if options else ("environment", int(generator.integers(2**63 - 1)))
        start = draw_initial_state(self._start_distribution, *parts)
        self.arena.reload(start.seed)
        self.arena.reset({0: start}, {0: self._scene.departures(*parts)})
        self._bodies = self.arena.nearby.of(self.arena.state, self.arena.reading)
        self._show()

    def play(self, actions: Mapping[int, FloatArray]) -> Step:
        """Play a step with these actions [2] of players. Raises ValueError for another shape and numbers that are not
        finite."""
        array = np.zeros((1, len(self.arena.seats), ACTIONS))
        for player, action in actions.items():
            array[0, player] = checked_actions(action, (ACTIONS,))
        step = self.arena.step(array)
        self._bodies = step.quantities.bodies
        self._show()
        return step

    def picture(self, player: int = EGO) -> Any:
        """What `render` returns: uint8 [height, width, 3] around a player, None in a window or without a render mode.
        Raises ResetNeeded before the first reset."""
        if self._render_mode is None:
            gymnasium.logger.warn("render does nothing: make the environment with render_mode='rgb_array'")
            return None
        if self._bodies is None:
            raise gymnasium.error.ResetNeeded("there is no game to draw: call reset first")
        return self._drawn(player) if self._render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the SUMO simulation and the window."""
        if self._window is not None:
            self._window.close()
            self._window = None
        self.arena.close()

    def _drawn(self, player: int) -> Any:
        from harness.environments.scene_picture import ScenePicture

        self._picture = self._picture or ScenePicture(self._scene)
        assert self._bodies is not None
        return self._picture.draw(self._bodies, 0, player)

    def _show(self) -> None:
        """Show the game in its window, in real time at most."""
        if self._render_mode != "human":
            return
        from harness.environments.scene_picture import Window

        self._window = self._window or Window(f"harness: {self._scene.document.name}")
        learners = [player for player, seats in enumerate(self.arena.seats) if seats[0].driver is None]
        self._window.show(self._drawn(learners[0]), self.arena.world.step_s)

    def ended(self, player: int) -> tuple[bool, bool]:
        """Whether the player's game was terminated, and whether it was truncated."""
        outcome = self.arena.state.outcome[0, player]
        return bool(outcome not in (Outcome.RUNNING, Outcome.TIMEOUT)), bool(outcome == Outcome.TIMEOUT)

    def observation(self, player: int, step: Step | None = None) -> FloatArray:
        """The player's observation [SIZE]; in its last step, the one before it was removed or stopped."""
        if step is not None and any(self.ended(player)):
            return step.observation[0, player].copy()
        return self.arena.observation[0, player].copy()

    def info(self, player: int, step: Step | None = None) -> Info:
        """What the environments report of a player beside its observation."""
        state = self.arena.state if step is None else step.quantities.state
        payoff, terms = self.arena.seats[player][0].payoff, dict[str, float]()
        if payoff is not None and step is None:
            terms = dict.fromkeys((*(each.name for each in payoff.terms), *payoff.fuzzy), 0.0)
        elif payoff is not None and step is not None:
            terms = {name: float(share[0]) + 0.0 for name, share in payoff.evaluate(step.quantities, player).items()}
        numbers = numbers_of(state, self.arena.world, player)
        return {name: column[0].item() for name, column in numbers.items()} | {"terms": terms}


def numbers_of(state: State, world: World, player: int) -> dict[str, NDArray[Any]]:
    """[G] the numbers in the info of a player."""
    outcome, station_m = state.outcome[:, player], state.station_m[:, player]
    return {
        "outcome": outcome.copy(),
        "is_success": outcome == Outcome.GOAL,
        "station_m": station_m.copy(),
        "goal_m": world.road.routes.goal_m[player] - station_m,
        "speed_mps": state.speed_mps[:, player].copy(),
        "time_s": state.step * world.step_s,
    }


def space_of(size: int) -> gymnasium.spaces.Box:
    """The space of observations or actions, of so many numbers from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)


def _render_modes() -> list[str]:
    from harness.environments.scene_picture import can_open_window

    return [mode for mode in RENDER_MODES if mode != "human" or can_open_window()]


def _named_game(options: Mapping[str, Any]) -> tuple[str | int, ...]:
    """The parts of the seeds of the game that `options` name: {"episode": 3} is episode 3 of every arm of a campaign
    with the seed 1; `campaign_seed` names another seed."""
    for key, value in options.items():
        if key not in _OPTIONS:
            raise UsageError.of("reset", f"options[{key!r}]", "is no option", nearest(str(key), _OPTIONS))
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise UsageError.of("reset", f"options[{key!r}]", f"is {value!r}", "give a whole number from 0 on")
    if "episode" not in options:
        raise UsageError.of("reset", "options['episode']", "is missing", "name the episode of the campaign's seed")
    return parts_of(options.get("campaign_seed", 1), options["episode"])


def checked_actions(actions: Any, shape: tuple[int, ...]) -> FloatArray:
    """Actions as an array. Raises ValueError if they have another shape or are not finite."""
    array = np.asarray(actions, dtype=float)
    if array.shape != shape:
        raise ValueError(f"actions have the shape {array.shape}, not {shape}: pedals and wheel, each from -1 to 1")
    if not np.isfinite(array).all():
        raise ValueError(f"an action is not finite: {actions}")
    return array
