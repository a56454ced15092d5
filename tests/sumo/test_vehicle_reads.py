"""Vehicles near a player, and the step in which to read the others again."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from harness.game.state import NOTICED_M
from harness.sumo.vehicle_reads import NearSearch, _near

STEP_S, FASTEST_MPS = 0.1, 40.0


def look(distances_m: list[float], speed_mps: float = 60.0) -> tuple[list[int], list[int]]:
    """Indices of the near vehicles, each 4 m long, and the steps in which all are due again.

    The vehicles are east of the first player of the second game, and the current step is 100.
    """
    count = len(distances_m)
    fronts = np.column_stack((np.array(distances_m), np.full(count, 500.0)))
    due_in = np.full((2, count), 100)
    table = (np.full((2, count), 4.0), np.full((2, count), speed_mps), np.array([0.0, 500.0]))
    players = (np.zeros((2, 2)), np.zeros((2, 2)), np.array([[True, True], [True, False]]))
    search = NearSearch(due_in, *table, *players, FASTEST_MPS, 100, STEP_S, 50, False)
    near = _near(search, np.arange(count, 2 * count), fronts)
    assert (fronts[:, 1] == 0.0).all()  # without the offset of the tile
    assert (due_in[0] == 100).all()  # the other game is unchanged
    return near.tolist(), due_in[1].tolist()


def test_near__vehicles_are_due_in_the_next_step_and_others_when_they_may_have_come_near() -> None:
    # near within the distance and a length; 60 + 40 m/s close 10 m a step: 35 m take more than 3 steps; 50 at most
    found = look([10.0, NOTICED_M + 4.0, NOTICED_M + 4.1, NOTICED_M + 4.0 + 35.0, 1e6])
    assert found == ([0, 1], [101, 101, 101, 103, 150])


@given(distances=st.lists(st.floats(0.0, 3000.0), min_size=1, max_size=20), speed=st.floats(1.0, 60.0))
def test_near__no_vehicle_is_missed_at_any_closing_speed(distances: list[float], speed: float) -> None:
    """A waiting vehicle is not within the distance one step before it is due."""
    near, due = look(distances, speed)
    for k, each in enumerate(distances):
        if k not in near:
            assert each - (due[k] - 101) * STEP_S * (speed + FASTEST_MPS) > NOTICED_M
