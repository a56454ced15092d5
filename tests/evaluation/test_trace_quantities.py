from __future__ import annotations

import numpy as np
import pytest

from harness.campaign.results.recorded_games import recorded_games
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_quantities import drove_in, series_of
from harness.game.roles import ROLES
from harness.traffic.scene import open_scene
from tests.support.tiny import learned_run, sumo_run
from tests.support.traces import drawn

SIZES_M = dict.fromkeys((*ROLES, "other"), (4.6, 1.8))


def test_series__gap_and_time_to_a_slower_leader(merge):
    trace = drawn(ego=([20.0, 21.5], 15.0, -1.6, {}), non_ego=([40.0, 41.0], 10.0, -1.6, {}))
    series = series_of(trace, merge.world, SIZES_M)
    assert series.leader_gap_m[:, 0] == pytest.approx([15.4, 14.9])
    assert series.time_to_collision_s[:, 0] == pytest.approx([15.4 / 5, 14.9 / 5])
    assert np.isinf(series.leader_gap_m[:, 1]).all()


def test_series__a_road_user_that_sumo_drives_is_a_leader_too(merge):
    trace = drawn(ego=([20.0], 15.0, -1.6, {}), other=([30.0], 15.0, -1.6, {}))
    series = series_of(trace, merge.world, SIZES_M)
    assert series.leader_gap_m[0, 0] == pytest.approx(5.4)
    assert np.isinf(series.time_to_collision_s[0, 0])
    assert np.isnan(series.leader_gap_m[0, 1])


def test_series__what_is_after_the_end_is_not_driven(merge):
    trace = drawn(
        ego=([20.0, 21.0, 22.0], 10.0, -1.6, {1: "rail", 2: "rail"}), non_ego=([40.0, 41.0], 10.0, -4.8, {1: "goal"})
    )
    assert drove_in(trace, ROLES).tolist() == [[True, True], [True, True], [False, False]]
    assert np.isnan(series_of(trace, merge.world, SIZES_M).leader_gap_m[2]).all()


@pytest.mark.slow
@pytest.mark.parametrize("run", [learned_run, sumo_run])
def test_series__are_what_the_records_were_made_of(run):
    folder = run()
    episodes = read_csv(folder / "episodes.csv").set_index(["arm", "episode"])
    scene = open_scene(folder / "scene")
    traces = folder / "traces"
    games = list(
        recorded_games(episodes.reset_index(), {}, lambda arm, seed: traces / f"{arm}-seed{seed}.parquet", scene)
    )
    assert len(games) == len(episodes)
    for game in games:
        row = episodes.loc[(game.arm, game.episode)]
        assert game.steps * game.step_s == pytest.approx(row["duration_s"])
        for player in game.players:
            assert player.outcome == row[f"{player.name}_outcome"]
        for player in game.players:
            if player.name == "ego":  # step 0 is before the first decision: no record has it
                soonest, gaps = player.time_to_collision_s[1:], player.leader_gap_m[1:]
                soonest, gaps = soonest[np.isfinite(soonest)], gaps[np.isfinite(gaps)]
                least = soonest.min() if len(soonest) else np.nan
                mean = gaps.mean() if len(gaps) else np.nan
                assert least == pytest.approx(row["ego_min_ttc_s"], abs=1e-9, nan_ok=True)
                assert mean == pytest.approx(row["ego_trailing_distance_m"], abs=1e-9, nan_ok=True)
