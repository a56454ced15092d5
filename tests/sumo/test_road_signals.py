"""Traffic lights: each game starts at a place in their cycles, and reads the states that SUMO has.

At the junction of the scene, the link of the non-ego is green for 42 s, yellow for 3 s and red for 45 s. That of the
ego is red for 45 s, green for 42 s and yellow for 3 s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import replace

import libsumo
import numpy as np
import pytest

from harness.environments.arena import Arena, Seat
from harness.game.arrays import IntArray
from harness.game.initial_state import InitialState
from harness.game.junctions import Signal
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from tests.support.scenes import CROSSING, CROSSING_EDGES, CROSSING_NODES, build_scene, drawn
from tests.support.simulations import local_simulation, stepped

CYCLE_S, STEP_S = 90.0, 0.1
LIGHTS = CROSSING_NODES.replace('id="c" x="0" y="0" type="priority"', 'id="c" x="0" y="0" type="traffic_light"')
GREEN, YELLOW, RED = int(Signal.GREEN), int(Signal.YELLOW), int(Signal.RED)
CODES = {"G": GREEN, "y": YELLOW, "r": RED}
Open = Callable[..., LibsumoSimulation]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    folder = tmp_path_factory.mktemp("scenes") / "lights"
    return build_scene(folder, LIGHTS, CROSSING_EDGES, CROSSING, goal_m=50.0, time_limit_s=100.0)


@pytest.fixture
def opened(scene: OpenScene) -> Iterator[Open]:
    """Opens simulations, and closes them."""
    with ExitStack() as stack:
        yield lambda games=1: stack.enter_context(closing(local_simulation(scene, games)))


def starting(scene: OpenScene, place: float) -> InitialState:
    """A game that starts at a place in the cycles."""
    return replace(drawn(scene, "lights"), signal_place=place)


def seconds(*times_s: float) -> list[float]:
    return [time_s / CYCLE_S for time_s in times_s]


def column(scene: OpenScene, player: int) -> int:
    """The column of a player's own link in the table of signals."""
    lines = scene.world.right_of_way.stop_lines
    return int(lines.link[lines.player.tolist().index(player)])


def read(simulation: LibsumoSimulation, start: InitialState, steps: int) -> IntArray:
    """[T, L] the states of a single game's links in each step; the cars stand."""
    poses = [np.array([column]) for column in (start.x_m, start.y_m, start.heading_rad)]
    states = [stepped(simulation, *poses).signals for _ in range(steps)]
    return np.array([each[0] for each in states if each is not None])


# --- the place in the cycle ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time_s", "non_ego", "ego"),
    [
        (0.0, (GREEN, 0.0), (RED, 0.0)),
        (40.0, (GREEN, 40.0), (RED, 40.0)),
        (42.0, (YELLOW, 0.0), (RED, 42.0)),
        (43.5, (YELLOW, 1.5), (RED, 43.5)),  # red through two phases
        (45.0, (RED, 0.0), (GREEN, 0.0)),
        (80.0, (RED, 35.0), (GREEN, 35.0)),
        (89.0, (RED, 44.0), (YELLOW, 2.0)),
    ],
)
def test_reset__sets_states_and_seconds_since_they_changed(
    scene: OpenScene, opened: Open, time_s: float, non_ego: tuple[int, float], ego: tuple[int, float]
) -> None:
    found = opened().reset(0, starting(scene, time_s / CYCLE_S), [])
    columns = [column(scene, player) for player in (EGO, NON_EGO)]
    assert found.states[columns].tolist() == [ego[0], non_ego[0]]
    assert found.since_s[columns] == pytest.approx([ego[1], non_ego[1]])


@pytest.mark.parametrize("share", [*np.linspace(0.0, 1.0, 8, endpoint=False), 0.999])
def test_reset__the_states_are_those_of_sumo(scene: OpenScene, opened: Open, share: float) -> None:
    found = opened().reset(0, starting(scene, share), [])
    in_sumo = libsumo.trafficlight.getRedYellowGreenState("c")
    links = [index for _, index in scene.world.right_of_way.signal_links]
    assert found.states.tolist() == [CODES[in_sumo[index]] for index in links]
    assert found.text == f"c={in_sumo}"


@pytest.mark.parametrize("time_s", [0.0, 41.0, 44.0, 70.0])
def test_reset__the_cycle_goes_on_from_there(scene: OpenScene, opened: Open, time_s: float) -> None:
    """What a game reads is what a game that starts that much later is reset to; SUMO shows a change one step late."""
    simulation, start = opened(), starting(scene, time_s / CYCLE_S)
    simulation.reset(0, start, [])
    states = read(simulation, start, round(CYCLE_S / STEP_S) + 1)
    for steps in (1, 11, 21, 36, 150, 431, 460, 800, 901):
        later = (time_s + (steps - 1) * STEP_S + 0.05) % CYCLE_S  # between two steps: no change at this very time
        expected = simulation.reset(0, starting(scene, later / CYCLE_S), []).states
        assert states[steps - 1].tolist() == expected.tolist(), f"after {steps} steps"


def test_reset__a_game_does_not_move_the_lights_of_the_others(scene: OpenScene, opened: Open) -> None:
    simulation = opened(games=3)
    shares = seconds(10.0, 43.0, 60.0)
    before = [simulation.reset(game, starting(scene, share), []) for game, share in enumerate(shares)]
    simulation.reset(1, starting(scene, seconds(20.0)[0]), [])
    start = starting(scene, 0.0)
    poses = [np.tile(column, (3, 1)) for column in (start.x_m, start.y_m, start.heading_rad)]
    states = stepped(simulation, *poses).signals
    assert states is not None
    assert states[0].tolist() == before[0].states.tolist()
    assert states[2].tolist() == before[2].states.tolist()
    assert states[1, column(scene, NON_EGO)] == GREEN  # at 20 s; it was yellow at 43 s


def test_arena__seconds_since_the_change_count_from_it(scene: OpenScene) -> None:
    with closing(Arena(scene, 1, [Seat(None), Seat(None)], seed=1)) as arena:
        arena.reset({0: starting(scene, seconds(41.0)[0])})
        columns = [(arena.state.signals.copy(), arena.state.signal_s.copy())]
        for _ in range(60):
            arena.step(np.tile([-1.0, 0.0], (1, 2, 1)))
            columns.append((arena.state.signals.copy(), arena.state.signal_s.copy()))
    states, since_s = map(np.array, zip(*columns, strict=True))
    own = column(scene, NON_EGO)
    changed = np.flatnonzero(np.diff(states[:, 0, own]))
    assert changed.tolist() == [10, 40]  # yellow after 1 s, red after 4 s, each in the step that begins then
    assert since_s[:11, 0, own] == pytest.approx(41.0 + STEP_S * np.arange(11))
    assert since_s[11:41, 0, own] == pytest.approx(STEP_S * np.arange(30))
    assert since_s[41:, 0, own] == pytest.approx(STEP_S * np.arange(20))


# --- the draw --------------------------------------------------------------------------------------------------------


def test_share__is_drawn_per_game_from_0_to_1(scene: OpenScene) -> None:
    shares = np.array([drawn(scene, "game", game).signal_place for game in range(400)])
    assert len(np.unique(shares)) == 400
    assert shares.min() >= 0.0
    assert shares.max() < 1.0
    assert np.histogram(shares, 4, (0.0, 1.0))[0] == pytest.approx([100] * 4, abs=4 * 8.7)  # sqrt(400 / 4 * 3 / 4)
    assert [drawn(scene, "game", game).signal_place for game in range(5)] == shares[:5].tolist()
