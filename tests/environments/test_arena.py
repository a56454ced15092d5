"""The stepping loop on real SUMO: effects of a step on players and background traffic, and observations."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import libsumo
import numpy as np
import pytest
import shapely

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Step
from harness.game.arrays import FloatArray, IntArray
from harness.game.geometry import Box, boxes_of
from harness.game.initial_state import InitialState
from harness.game.observation_layout import LAYOUT, SIZE
from harness.game.outcome import Outcome
from harness.game.payoff import Payoff
from harness.road.demand.route_file import Departure
from harness.road.scene.open_obstacles import polygon_of
from harness.road.scene.open_scene import OpenScene
from tests.support.scenes import (
    CROSSING,
    CROSSING_EDGES,
    CROSSING_NODES,
    LEFT_Y,
    RIGHT_Y,
    ZIPPER,
    ZIPPER_EDGES,
    ZIPPER_NODES,
    build_scene,
    drawn,
    placed,
)

COAST = np.zeros((1, 2, 2))
FLOW = '<flow id="f" type="van" begin="0" period="2" departLane="random"><route edges="{}"/></flow>'
Open = Callable[..., Arena]


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    folder = tmp_path_factory.mktemp("scenes") / "crossing"
    return build_scene(folder, CROSSING_NODES, CROSSING_EDGES, CROSSING, goal_m=50.0)


@pytest.fixture(scope="module")
def payoff(repository: Any) -> Payoff:
    return read_document(repository / "personas/careful.toml", Persona).payoff


@pytest.fixture
def arena_of(arena_of: Open, payoff: Payoff) -> Open:
    return partial(arena_of, payoff=payoff)


def after_reset(arena: Arena, start: InitialState, *background: Departure) -> Arena:
    arena.reset({0: start}, {0: list(background)})
    return arena


def outcomes(arena: Arena) -> list[str]:
    return [Outcome(int(each)).word for each in arena.state.outcome[0]]


def bodies(step: Step) -> list[shapely.Geometry]:
    """All bodies of the first game."""
    return [polygon_of(box) for box in boxes_of(Box(*(column[0] for column in step.quantities.bodies.boxes)))]


def play_to_the_end(arena: Arena, action: FloatArray = COAST, steps: int = 200) -> list[Step]:
    """Steps until the game has ended for both players."""
    played = []
    while arena.state.running.any() and len(played) < steps:
        played.append(arena.step(action))
    return played


# --- players, SUMO and tiles ------------------------------------------------------------------------------------------


def test_step__players_have_the_same_pose_in_sumo_and_arena(merge: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(merge), drawn(merge, 1))
    generator = np.random.default_rng(0)
    for _ in range(40):
        arena.step(generator.normal(0.1, 0.1, (1, 2, 2)))
        for k in np.flatnonzero(arena.state.running[0]):
            x, y = libsumo.vehicle.getPosition(("ego", "non_ego")[k])
            heading = np.radians(90.0 - libsumo.vehicle.getAngle(("ego", "non_ego")[k]))
            pose = [float(getattr(arena.state, name)[0, k]) for name in ("x_m", "y_m", "heading_rad")]
            assert (x - 2.3 * np.cos(heading), y - 2.3 * np.sin(heading), heading) == pytest.approx(pose, abs=1e-3)


def test_tiles__games_are_independent(merge: OpenScene, arena_of: Open) -> None:
    actions = np.random.default_rng(0).normal(0.05, 0.1, (100, 2, 2))
    together = arena_of(merge, 4)
    together.reset({game: drawn(merge, "tile", game) for game in range(4)})
    four = [(s.payoff.copy(), together.observation.copy()) for s in (together.step(np.array([a] * 4)) for a in actions)]
    together.close()
    alone = arena_of(merge)
    for game in range(4):
        alone.reload(7)
        alone.reset({0: drawn(merge, "tile", game)})
        for action, (payoffs, observations) in zip(actions, four, strict=True):
            step = alone.step(action[None])
            np.testing.assert_allclose(step.payoff[0], payoffs[game], atol=1e-9)
            np.testing.assert_allclose(alone.observation[0], observations[game], atol=1e-6)


def test_reset__of_one_game_has_no_effect_on_the_others(merge: OpenScene, arena_of: Open) -> None:
    arena, start = arena_of(merge, 2), drawn(merge, "restart")
    arena.reset({0: start, 1: drawn(merge, "goes on")})
    first = arena.observation[0].copy()
    actions = np.random.default_rng(0).normal(0.0, 0.05, (20, 2, 2, 2))
    seen = [(arena.step(action), arena.observation[0].copy())[1] for action in actions]
    before = arena.observation[1].copy()
    arena.reset({0: start})
    np.testing.assert_array_equal(arena.observation[0], first)
    np.testing.assert_array_equal(arena.observation[1], before)
    for action, expected in zip(actions, seen, strict=True):
        arena.step(action)
        np.testing.assert_array_equal(arena.observation[0], expected)


def test_step__quantities_of_earlier_steps_do_not_change(merge: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(merge), drawn(merge, 1))
    steps = [arena.step(COAST) for _ in range(5)]
    travelled = [float(step.quantities.state.x_m[0, 0]) for step in steps]
    assert np.diff(travelled) == pytest.approx([0.1 * drawn(merge, 1).speed_mps[0]] * 4)
    assert [int(step.quantities.state.step[0]) for step in steps] == [1, 2, 3, 4, 5]


def test_step__the_first_step_has_an_advance(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (40.2, RIGHT_Y, 0, 10), (60.2, LEFT_Y, 0, 7)))
    np.testing.assert_allclose(arena.step(COAST).quantities.advanced_m, [[1.0, 0.7]], atol=1e-9)


# --- how games end ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("background", [False, True])
def test_goal__the_player_is_removed_and_the_other_continues(background: bool, tmp_path: Any, arena_of: Open) -> None:
    road = build_scene(tmp_path, others=FLOW.format("road") if background else "")
    arena = after_reset(arena_of(road), placed(road, (240, RIGHT_Y, 0, 10), (200, LEFT_Y, 0, 10)))
    for _ in range(10):
        step = arena.step(COAST)
    assert outcomes(arena) == ["goal", ""]
    assert step.quantities.state.present.all()
    assert arena.state.present[0].tolist() == [False, True]
    arena.step(COAST)
    assert ("ego" in libsumo.vehicle.getIDList()) is not background  # removed only where SUMO drives vehicles
    assert not arena.observation[0, 0].any()
    assert arena.observation[0, 1, LAYOUT.index("other0_seen")] == 0.0


def test_wreck__slides_along_the_rail_and_stays_as_an_obstacle_without_payoff(
    straight: OpenScene, arena_of: Open
) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (60, RIGHT_Y, 0, 10), (120, RIGHT_Y, 0.6, 10)))
    while not outcomes(arena)[1]:
        arena.step(COAST)
    assert outcomes(arena) == ["", "rail"]
    at_rail_m, heading_rad = arena.state.x_m[0, 1], arena.state.heading_rad[0, 1]
    along_mps = 10.0 * np.cos(heading_rad)  # the road goes east
    assert arena.state.speed_mps[0, 1] == pytest.approx(along_mps, rel=1e-3)
    y_m = arena.state.y_m[0, 1]
    steps = play_to_the_end(arena)
    assert outcomes(arena) == ["collision", "rail"]
    # friction brakes it: v^2 / (2 mu g), less half a step of the first 8.2 m/s, as a displacement is the new speed's
    slid_m = along_mps**2 / (2.0 * 0.8 * 9.81)
    assert arena.state.x_m[0, 1] - at_rail_m == pytest.approx(slid_m, abs=0.5)
    assert arena.state.y_m[0, 1] == pytest.approx(y_m, abs=1e-6)
    assert arena.state.heading_rad[0, 1] == heading_rad
    assert all(step.payoff[0, 1] == 0.0 and not step.drove[0, 1] for step in steps)
    assert (arena.step(COAST).payoff == 0.0).all()


def test_wreck__after_a_collision_goes_on_in_its_direction(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (100, RIGHT_Y, 0, 12), (107, RIGHT_Y, 0, 3)))
    play_to_the_end(arena)
    assert outcomes(arena) == ["collision", "collision"]
    speeds = arena.state.speed_mps[0].copy()
    assert (speeds > 0.0).all()
    arena.step(COAST)
    assert arena.state.speed_mps[0] == pytest.approx(np.maximum(speeds - 0.8 * 9.81 * 0.1, 0.0))


def test_wreck__of_a_player_driven_by_sumo_stands_in_sumo_too(straight: OpenScene, arena_of: Open) -> None:
    start = placed(straight, (100, RIGHT_Y, 0, 12), (107, RIGHT_Y, 0, 3))
    arena = after_reset(arena_of(straight, 1, None, SumoDriver()), start)
    play_to_the_end(arena, np.array([[[1.0, 0.0], [0.0, 0.0]]]))
    assert outcomes(arena) == ["collision", "collision"]
    for _ in range(10):
        arena.step(COAST)
    assert libsumo.vehicle.getPosition("non_ego")[0] - 2.3 == pytest.approx(arena.state.x_m[0, 1])


def test_timeout__ends_the_game_at_the_limit(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (100, RIGHT_Y, 0, 0), (100, LEFT_Y, 0, 0)))
    assert len(play_to_the_end(arena, steps=500)) == straight.world.steps == 200
    assert outcomes(arena) == ["timeout", "timeout"]


def test_outcome__contact_has_priority_over_goal_and_time(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (249.5, RIGHT_Y, 0, 10), (253, RIGHT_Y, 0, 0)))
    arena.step(COAST)
    assert outcomes(arena) == ["collision", "collision"]


@pytest.mark.parametrize("heading", [0.0, 0.3, -0.7, np.pi / 2, 2.5])
def test_contact__of_turned_boxes_is_found_in_its_step(straight: OpenScene, arena_of: Open, heading: float) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (100, -3.2, 0, 15), (115, -3.0, heading, 0)))
    *before, last = play_to_the_end(arena)
    assert outcomes(arena) == ["collision", "collision"]
    assert shapely.intersects(*bodies(last))
    assert not any(shapely.intersects(*bodies(step)) for step in before)


@pytest.mark.parametrize("heading", [0.2, -0.2, 0.9, -1.4])
def test_rail__contact_is_in_the_step_in_which_the_body_leaves_the_road(
    straight: OpenScene, arena_of: Open, heading: float
) -> None:
    arena = after_reset(arena_of(straight), placed(straight, (100, -3.2, heading, 10), None))
    *before, last = play_to_the_end(arena)
    road = shapely.box(-50, -6.4, 350, 0)
    assert outcomes(arena) == ["rail", ""]
    assert not shapely.covers(road, bodies(last)[0])
    assert all(shapely.covers(road.buffer(0.02), bodies(step)[0]) for step in before)


def test_contact__on_a_junction_is_found(crossing: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(crossing), placed(crossing, (-20, -1.6, 0, 10), (1.6, -21, np.pi / 2, 10)))
    *_, last = play_to_the_end(arena)
    assert outcomes(arena) == ["collision", "collision"]
    assert shapely.intersects(*bodies(last))
    assert (np.abs(last.quantities.state.x_m[0]) < 6).all()


def test_junction__has_no_rails_on_the_route(crossing: OpenScene, arena_of: Open) -> None:
    arena = after_reset(arena_of(crossing), placed(crossing, (-20, -1.6, 0, 10), None))
    play_to_the_end(arena)
    assert outcomes(arena)[0] == "goal"


# --- players and background traffic driven by SUMO --------------------------------------------------------------------


def test_sumo_driver__merges_and_reaches_the_goal(merge: OpenScene, arena_of: Open) -> None:
    arena = arena_of(merge, 1, SumoDriver(), SumoDriver())
    for episode in range(3):
        arena.reload(episode)
        after_reset(arena, drawn(merge, "sumo", episode))
        steps = play_to_the_end(arena, steps=300)
        assert outcomes(arena) == ["goal", "goal"]
        xs = np.array([step.quantities.state.x_m[0, 1] for step in steps if step.drove[0, 1]])
        speeds = np.array([step.quantities.state.speed_mps[0, 1] for step in steps if step.drove[0, 1]])
        np.testing.assert_allclose(np.diff(xs), 0.1 * speeds[1:], atol=0.03)
        assert steps[0].quantities.state.acceleration_mps2.tolist() == [[0.0, 0.0]]
        assert max(np.abs(step.quantities.state.acceleration_mps2).max() for step in steps) < 8.0


def test_background__is_observed_at_its_position_in_sumo(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(
        arena_of(straight),
        placed(straight, (100, RIGHT_Y, 0, 10), None),
        Departure(name="van", vehicle_type="van", edges=("road",), depart_s=0.0, lane="1", position="123", speed="10"),
    )
    seen = {name: arena.observation[0, 0, k] for k, name in enumerate(LAYOUT)}
    assert seen["other0_seen"] == 0.0  # not departed yet
    arena.step(COAST)
    seen = {name: arena.observation[0, 0, k] for k, name in enumerate(LAYOUT)}
    x = libsumo.vehicle.getPosition("van")[0] - 3.0
    assert seen["other0_seen"] == 1.0
    assert seen["other0_ahead_m"] == pytest.approx((x - 101.0) / (x - 101.0 + 20.0), abs=1e-6)
    assert seen["other0_left_m"] == pytest.approx(3.2 / (3.2 + 8.0), abs=1e-5)


def test_background__contact_is_a_collision(straight: OpenScene, arena_of: Open) -> None:
    arena = after_reset(
        arena_of(straight),
        placed(straight, (100, RIGHT_Y, 0, 12), None),
        Departure(name="van", vehicle_type="van", edges=("road",), depart_s=0.0, lane="0", position="120", speed="1"),
    )
    *before, last = play_to_the_end(arena, np.array([[[1.0, 0.0], [0.0, 0.0]]]))
    assert outcomes(arena) == ["collision", ""]
    for step, touches in ((before[-1], False), (last, True)):
        ego, _, van = bodies(step)
        assert shapely.intersects(ego, van) == touches


def test_background__is_reset_with_its_game(straight: OpenScene, arena_of: Open) -> None:
    arena, start = arena_of(straight), placed(straight, (150, RIGHT_Y, 0, 0), None)
    van = Departure(name="van", vehicle_type="van", edges=("road",), depart_s=0.3, lane="1", position="50", speed="8")
    for _ in range(2):
        after_reset(arena, start, van)
        where = []
        for _ in range(12):
            arena.step(COAST)
            assert arena.reading is not None
            where += [float(x) for x in arena.reading.x_m[0][arena.reading.present[0]]]
        assert len(where) == 9
        assert where[0] == pytest.approx(47.0)


# --- observations ------------------------------------------------------------------------------------------------


def test_drivers__have_the_observations_of_learners(merge: OpenScene, arena_of: Open) -> None:
    received: list[FloatArray] = []

    class Recording:
        takes_over = True

        def reset(self, games: IntArray) -> None:
            received.clear()

        def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
            received.append(observation.copy())
            return np.zeros((len(games), 2))

    learner = after_reset(arena_of(merge), drawn(merge, 5))
    seen = []
    for _ in range(30):
        seen.append(learner.observation[0, 1].copy())
        learner.step(COAST)
    learner.close()
    driven = after_reset(arena_of(merge, 1, None, Recording()), drawn(merge, 5))
    for _ in range(30):
        driven.step(COAST)
    np.testing.assert_array_equal(np.concatenate(received), np.array(seen))


@pytest.mark.parametrize("net", ["straight", "zipper"])
def test_soak__random_driving_in_traffic_keeps_all_invariants(tmp_path: Any, arena_of: Open, net: str) -> None:
    if net == "zipper":
        scene = build_scene(tmp_path, ZIPPER_NODES, ZIPPER_EDGES, ZIPPER, FLOW.format("wide narrow"), goal_m=50.0)
    else:
        scene = build_scene(tmp_path, others=FLOW.format("road"))
    arena, generator, ended = arena_of(scene, 4), np.random.default_rng(0), []
    waiting = list(range(4))
    for k in range(800):
        arena.reset(
            {game: drawn(scene, k, game) for game in waiting}, {game: scene.departures(k, game) for game in waiting}
        )
        running = arena.state.running.copy()
        step = arena.step(generator.normal((0.2, 0.0), (0.5, 0.3), (4, 2, 2)))
        assert arena.observation.shape == (4, 2, SIZE)
        assert arena.observation.dtype == np.float32
        assert np.abs(arena.observation).max() <= 1.0
        assert np.isfinite(step.payoff).all()
        assert (step.payoff[~running] == 0.0).all()
        assert (arena.state.outcome[arena.state.running] == Outcome.RUNNING).all()
        waiting = np.flatnonzero(~arena.state.running.any(1)).tolist()
        ended += [Outcome(int(each)).word for each in arena.state.outcome[waiting].ravel()]
    assert {"rail", "collision"} <= set(ended) <= {"rail", "collision", "goal", "timeout"}
