"""Views of planners: in the frame of the net, with exactly what the eyes see, and only for those who ask."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.shield import ShieldedDriver
from harness.drivers.sumo import SumoDriver
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView, SeenObject
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation_layout import LAYOUT, in_units
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from tests.support.repository import REPOSITORY
from tests.support.rollouts import Steady
from tests.support.scenes import LEFT_Y, RIGHT_Y, drawn, placed

Open = Any


class Watcher(Steady):
    """Keeps its pedals, and every view with the observation."""

    def __init__(self, pedals: float = 0.0, history_s: float = 0.0) -> None:
        super().__init__(pedals)
        self.history_s = history_s
        self.seen: list[tuple[int, CartesianView, FloatArray]] = []
        self._views: dict[int, CartesianView] = {}

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        self._views = dict(zip(games.tolist(), views, strict=True))

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.seen += [(game, self._views[game], row) for game, row in zip(games.tolist(), observation, strict=True)]
        return super().decide(games, observation, noise)

    def views(self, game: int = 0) -> list[CartesianView]:
        return [view for of_game, view, _ in self.seen if of_game == game]


def in_own_frame(view: CartesianView, each: SeenObject) -> FloatArray:
    """Where an object is ahead and to the left, and its velocity there, the first relative to the own speed."""
    cosine, sine = np.cos(view.heading_rad), np.sin(view.heading_rad)
    turn = np.array([(cosine, sine), (-sine, cosine)])
    place = turn @ (each.x_m - view.x_m, each.y_m - view.y_m)
    return np.array([*place, *(turn @ (each.velocity_x_mps, each.velocity_y_mps) - (view.speed_mps, 0.0))])


def observed(row: FloatArray, max_steering_rad: float) -> list[FloatArray]:
    """The same of the road users in an observation, the most urgent first."""
    entries = dict(zip(LAYOUT, in_units(row, max_steering_rad).tolist(), strict=True))
    names = ("ahead_m", "left_m", "ahead_mps", "left_mps")
    seen = [k for k in range(4) if entries[f"other{k}_seen"] > 0.5]
    return [np.array([entries[f"other{k}_{name}"] for name in names]) for k in seen]


@pytest.mark.parametrize("persona", [None, "speedy"])
def test_view__has_the_bodies_of_the_observation(persona: str | None, merge: OpenScene, arena_of: Open) -> None:
    """Of the ego, which sees everything as it is, and of a person, who estimates distances and reacts late."""
    factors = HumanFactors()
    if persona:
        factors = read_document(REPOSITORY / "personas" / f"{persona}.toml", Persona).human_factors
    player = 1 if persona else 0
    watcher = Watcher(0.05)
    arena = arena_of(merge, 1, *((SumoDriver(), watcher) if persona else (watcher, SumoDriver())))
    start = draw_initial_state(merge.start_distribution([HumanFactors(), factors], [1.0, 1.0]), "views")
    arena.reset({0: start})
    for _ in range(40):
        arena.step()
    compared = 0
    for _, view, row in watcher.seen:
        others = observed(row, float(merge.world.actuators.max_steering_rad[player]))
        assert len(others) == len(view.objects)
        for entry, each in zip(others, view.objects, strict=True):
            np.testing.assert_allclose(in_own_frame(view, each), entry, rtol=1e-3, atol=1e-3)
            compared += 1
    assert compared > 20


def test_view__is_in_the_frame_of_the_net_in_every_tile(merge: OpenScene, arena_of: Open) -> None:
    together, alone = Watcher(), Watcher()
    arena = arena_of(merge, 2, together, Steady())
    arena.reset({game: drawn(merge, "tile", game) for game in range(2)})
    for _ in range(10):
        arena.step()
    arena.close()
    arena = arena_of(merge, 1, alone, Steady())
    arena.reset({0: drawn(merge, "tile", 1)})
    for _ in range(10):
        arena.step()
    first = together.views(1)[0]
    nearest_m = np.hypot(*(first.road.route_line - (first.x_m, first.y_m)).T).min()
    assert nearest_m < 0.5
    for view, same in zip(together.views(1), alone.views(), strict=True):
        assert view.objects == same.objects
        assert (view.x_m, view.y_m, view.station_m) == (same.x_m, same.y_m, same.station_m)


def test_objects__keep_their_number_and_have_velocity_acceleration_and_turn_signal(
    straight: OpenScene, arena_of: Open
) -> None:
    watcher = Watcher()
    arena = arena_of(straight, 1, watcher, Steady(0.5))
    start = placed(straight, (100, RIGHT_Y, 0, 10), (120, LEFT_Y, 0, 10))
    van = Departure(name="van", vehicle_type="van", edges=("road",), depart_s=0.0, lane="1", position="150", speed="5")
    arena.reset({0: start}, {0: [van]})
    for _ in range(10):
        arena.step()
    views = watcher.views()
    assert [each.id for each in views[0].objects] == [0]  # the van departs in the first step
    for before, view in pairwise(views[1:]):
        assert [(each.id, each.kind) for each in view.objects] == [(0, "passenger"), (1, "passenger")]
        assert {each.turn_signal for each in view.objects} <= {"off", "left", "right"}
        for was, each in zip(before.objects, view.objects, strict=True):
            gained = each.velocity_x_mps - was.velocity_x_mps
            assert each.acceleration_x_mps2 == pytest.approx(gained / 0.1)
            assert each.x_m - was.x_m == pytest.approx(0.1 * each.velocity_x_mps, abs=0.06)
    person, seen_van = views[-1].objects
    assert person.acceleration_x_mps2 > 0.5
    assert (seen_van.length_m, seen_van.y_m) == pytest.approx((6.0, LEFT_Y))


def test_turn_signal__is_that_of_the_car_in_sumo(merge: OpenScene, arena_of: Open) -> None:
    """SUMO's driver leaves the lane that ends, and says so."""
    watcher = Watcher(0.2)
    arena = arena_of(merge, 1, watcher, SumoDriver())
    arena.reset({0: drawn(merge, "signals")})
    for _ in range(80):
        arena.step()
    signals = {each.turn_signal for view in watcher.views() for each in view.objects}
    assert "left" in signals


def test_history__has_the_views_before_for_as_long_as_the_document_asks(straight: OpenScene, arena_of: Open) -> None:
    watcher = Watcher(history_s=0.5)
    arena = arena_of(straight, 1, watcher, Steady())
    for _ in range(2):  # the second game does not remember the first
        watcher.seen.clear()
        arena.reset({0: placed(straight, (100, RIGHT_Y, 0, 10), (120, LEFT_Y, 0, 10))})
        for _ in range(8):
            arena.step()
        views = watcher.views()
        assert [len(view.history) for view in views] == [0, 1, 2, 3, 4, 5, 5, 5]
        np.testing.assert_allclose([each.time_s for each in views[-1].history], [0.2, 0.3, 0.4, 0.5, 0.6])
        assert views[-1].history[-1].x_m == views[-2].x_m


def test_planner__behind_a_shield_gets_views(straight: OpenScene, arena_of: Open) -> None:
    watcher = Watcher()
    arena = arena_of(straight, 1, ShieldedDriver(watcher, straight.world), Steady())
    arena.reset({0: placed(straight, (100, RIGHT_Y, 0, 10), (120, LEFT_Y, 0, 10))})
    arena.step()
    assert len(watcher.views()[0].objects) == 1


def test_others__get_no_view_and_no_road_is_read(straight: OpenScene, arena_of: Open) -> None:
    vars(straight).pop("cartesian_roads", None)
    arena = arena_of(straight, 1, Steady(), SumoDriver())
    arena.reset({0: placed(straight, (100, RIGHT_Y, 0, 10), (120, LEFT_Y, 0, 10))})
    arena.step()
    assert "cartesian_roads" not in vars(straight)
