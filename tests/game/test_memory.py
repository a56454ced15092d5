"""What players know of each other after a reaction time, by hand and by laws that hold for every lag."""

from __future__ import annotations

import numpy as np
import pytest

from harness.game.memory import REMEMBERED_S, Memory, as_they_are
from harness.game.state import Bodies, State


def moving_east(speeds_mps: list[float], step_s: float) -> tuple[Memory, Bodies]:
    """Two players who start at x = 0 and drive at these speeds, one for each step, and a background vehicle that stands
    at x = 50."""
    memory, state = Memory(1, 2, step_s), State.empty(1, 2)
    state.present[:] = True
    memory.begin(state)
    for speed in speeds_mps:
        state = state.copy()
        state.x_m += speed * step_s
        state.speed_mps[:] = speed
        memory.remember(state)
    size, zero = np.ones((1, 3)), np.zeros((1, 3))
    x_m = np.append(state.x_m, [[50.0]], axis=1)
    speed_mps = np.append(state.speed_mps, [[0.0]], axis=1)
    return memory, Bodies(x_m, zero, zero, speed_mps, size, size, np.ones((1, 3), dtype=bool))


def test_perceived__is_where_they_would_be_had_they_moved_on() -> None:
    # 10 m/s for 5 steps of 0.1 s, 5 m, then 4 m/s for 5 steps, 2 m
    memory, bodies = moving_east([10.0] * 5 + [4.0] * 5, 0.1)
    x_m, _, _, speed_mps = memory.perceived(bodies, np.array([[0, 5]]), np.arange(1))
    assert x_m[0, 0].tolist() == pytest.approx([7.0, 7.0, 50.0])  # without a lag as it is
    assert x_m[0, 1].tolist() == pytest.approx([5.0 + 10.0 * 0.5, 7.0, 50.0])  # itself and the background as they are
    assert speed_mps[0, 1].tolist() == pytest.approx([10.0, 4.0, 0.0])


def test_perceived__of_steady_motion_is_as_it_is_for_every_lag() -> None:
    memory, bodies = moving_east([10.0] * 40, 0.1)
    for lag in range(40):
        found = memory.perceived(bodies, np.full((1, 2), lag), np.arange(1))
        assert found == pytest.approx(as_they_are(bodies, 2))


def test_memory__reaches_as_far_back_in_short_steps() -> None:
    """What is older than `REMEMBERED_S` counts as this old, however long a step is."""
    for step_s in (0.02, 0.1, 0.2):
        before = round(REMEMBERED_S / step_s) - 1  # the step itself is remembered too
        memory, bodies = moving_east([10.0] * 3 + [0.0] * before, step_s)
        speed_mps = memory.perceived(bodies, np.full((1, 2), 10 * before), np.arange(1))[3]
        assert speed_mps[0, 0, 1] == 10.0
