"""Assessment: the same games in every arm, and an error ends only its own game."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from errno import ENOSPC
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.assessment.rollout import assess_arms, assess_batches, plays_side_by_side
from harness.assessment.seated_arm import SeatedArm
from harness.config.ego_perception import EgoPerception
from harness.config.persona import Persona
from harness.config.scene import Varies
from harness.config.toml_reading import read_document
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver
from harness.drivers.reference_drivers import REFERENCES, UPPER_BOUND, reference_driver
from harness.drivers.shield import ShieldedDriver
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Step
from harness.errors import SimulationError
from harness.evaluation.column import NUMBER
from harness.evaluation.columns import TABLES
from harness.evaluation.tables import table_of
from harness.evaluation.trace_file import SCHEMA
from harness.game.arrays import FloatArray, IntArray
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.repository import REPOSITORY
from tests.support.rollouts import RANDOM, Steady, arm, play, records, trace
from tests.support.tiny import CAREFUL, TEXTING

FOGGY = REPOSITORY / "tests" / "data" / "perception" / "foggy.toml"
MEASURED = [name for name, column in TABLES["episodes"].items() if column.dtype == NUMBER]
POSE = ["x_m", "y_m", "heading_rad", "speed_mps"]


class Failing(Steady):
    """Raises in the third step of every second game."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error, self.games, self.steps = error, 0, 0

    def reset(self, games: IntArray) -> None:
        self.games, self.steps = self.games + 1, 0

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self.steps += 1
        if self.games % 2 == 0 and self.steps == 3:
            raise self.error
        return np.zeros((len(games), 2))


def test_assess__twice_is_the_same_whatever_the_number_of_games(merge: OpenScene) -> None:
    first, second = (play(arm(merge, RANDOM, SumoDriver()), games) for games in (3, 2))
    assert records(first[:2]) == records(second)
    for one, other in zip(first, second, strict=False):
        pd.testing.assert_frame_equal(trace(one), trace(other), check_exact=True)


def test_assess__what_a_scene_varies_of_the_weather_is_in_the_row_of_the_game(merge: OpenScene) -> None:
    varies = Varies(friction=(0.3, 0.7), visibility_m=(40.0, 80.0))
    varying = replace(merge, document=merge.document.model_copy(update={"varies": varies}))
    found = [(game.record["friction"], game.record["visibility_m"]) for game in play(arm(varying, Steady(), None))]
    assert len(set(found)) == 3
    assert all(0.3 <= friction <= 0.7 and 40.0 <= visibility_m <= 80.0 for friction, visibility_m in found)
    assert "visibility_m" not in play(arm(merge, Steady(), None))[0].record


def test_assess__episodes_and_seeds_give_different_games(merge: OpenScene) -> None:
    games = [*play(arm(merge, Steady(), None)), *play(arm(merge, Steady(), None, seed=2))]
    starts = {tuple(trace(game).loc[0, POSE]) for game in games}
    assert len(starts) == 6


def test_assess__an_episode_has_the_same_start_in_every_arm(merge: OpenScene) -> None:
    drivers = [(Steady(), None), (RANDOM, SumoDriver()), (SumoDriver(), RANDOM), (None, RANDOM)]
    arms = [*(arm(merge, *each) for each in drivers), arm(merge, RANDOM, RANDOM, persona=TEXTING)]
    starts = []
    for each in arms:
        first = pd.concat([trace(game).query("step == 0") for game in play(each)])
        starts.append(first.set_index(["episode", "player"])[POSE].T.to_dict("list"))
    both_players = starts[1]
    assert set(both_players) == {(k, player) for k in range(3) for player in ("ego", "non_ego")}
    for each in starts:
        assert each == {player: both_players[player] for player in each}


def test_assess__lapses_depend_on_the_episode_and_not_on_the_arm(merge: OpenScene) -> None:
    arms = [play(arm(merge, ego, Steady(), persona=TEXTING), 6) for ego in (Steady(), None)]
    lapses = [
        [trace(game).query("player == 'non_ego'").set_index("step")["lapsed"] for game in games] for games in arms
    ]
    assert any(each.any() for each in lapses[0])
    for one, other in zip(*lapses, strict=True):
        both = one.index.intersection(other.index)[:20]  # before the players can influence each other
        assert one[both].equals(other[both])


# --- games side by side -----------------------------------------------------------------------------------------------


def side_by_side(assessed: SeatedArm, *batches: list[int]) -> list[str]:
    return [repr((game.played, game.trace)) for game in assess_batches(assessed, batches)]


@pytest.mark.parametrize(
    ("scene", "judged", "followed"),
    [("paper_merge", True, False), ("merge", True, True), ("red_light", False, True), ("zebra", False, False)],
)
def test_batch__has_the_bytes_of_games_alone(scene: str, judged: bool, followed: bool) -> None:
    """SUMO drives the car that follows the ego in a part of the games. It draws no random numbers."""
    opened = open_scene(scene)
    ego = reference_driver(UPPER_BOUND, opened.world) if judged else RANDOM
    assessed = arm(opened, ego, RANDOM, persona=TEXTING)
    alone = side_by_side(assessed, *([episode] for episode in range(5)))
    assert any("'follower'" in game for game in alone) == followed
    assert side_by_side(assessed, [0, 1, 2], [4, 3]) == [*alone[:3], alone[4], alone[3]]


def test_batch__has_the_bytes_of_games_alone_with_background_traffic_that_draws_no_random_numbers(
    tmp_path: Path,
) -> None:
    """A tractor that does not dawdle drives ahead of the ego."""
    assessed = arm(open_scene("cut_out"), RANDOM, RANDOM)
    assert plays_side_by_side(assessed)
    alone = side_by_side(assessed, *([episode] for episode in range(5)))
    assert all("'slow'" in game for game in alone)
    assert side_by_side(assessed, [0, 1, 2], [4, 3]) == [*alone[:3], alone[4], alone[3]]
    folder = copytree(REPOSITORY / "networks" / "cut_out", tmp_path / "cut_out")
    routes = folder / "cut_out.rou.xml"
    routes.write_text(routes.read_text().replace('sigma="0"', 'sigma="0.5"'))
    assert not plays_side_by_side(arm(open_scene(folder), RANDOM, RANDOM))


def test_batch__has_the_bytes_of_games_alone_with_perception_errors() -> None:
    """The policy sees ghosts and loses the person: the games are other ones than without errors, with their starts."""
    plain = arm(open_scene("paper_merge"), RANDOM, RANDOM)
    errors = read_document(FOGGY, EgoPerception).errors
    assessed = replace(plain, scene=replace(plain.scene, perception_errors=errors))
    alone = side_by_side(assessed, [0], [1], [2])
    assert side_by_side(assessed, [2, 0, 1]) == [alone[2], alone[0], alone[1]]
    others = []
    for with_errors, without in zip(play(assessed), play(plain), strict=True):
        one, other = trace(with_errors), trace(without)
        assert (one["ego_ghosts"] != "").any()
        lost = one.loc[one["player"] == "ego", "ego_lost"] == "non_ego"
        assert with_errors.recorded is not None
        assert with_errors.recorded.lost_by_ego(1)[: len(lost)].tolist() == lost.tolist()
        assert one.loc[0, POSE].equals(other.loc[0, POSE])
        others.append(not one[POSE].equals(other[POSE]))
    assert any(others)  # a game may end before an error matters


@pytest.mark.parametrize("ego", [RANDOM, "upper bound"])
def test_batch__has_the_bytes_of_games_alone_with_a_shield(merge: OpenScene, ego: LearnedDriver | str) -> None:
    driver = reference_driver(UPPER_BOUND, merge.world) if isinstance(ego, str) else ego
    assessed = arm(merge, ShieldedDriver(driver, merge.world), RANDOM)
    alone = side_by_side(assessed, *([episode] for episode in range(6)))
    assert plays_side_by_side(assessed)
    assert side_by_side(assessed, [0, 1, 2, 3], [5, 4]) == [*alone[:4], alone[5], alone[4]]
    if driver is RANDOM:
        assert any(trace(game)["shielded"].any() for game in play(assessed, 6))


@pytest.mark.parametrize("scene", ["paper_merge", "merge"])
def test_batch__of_more_games_than_tiles(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tile plays one game after the other, with a follower or without, and stands still at the end."""
    assessed = arm(open_scene(scene), RANDOM, RANDOM)
    alone = side_by_side(assessed, *([episode] for episode in range(7)))
    monkeypatch.setattr("harness.assessment.rollout.SIDE_BY_SIDE", 2)
    assert side_by_side(assessed, [*range(7)]) == alone


def test_arms__side_by_side_have_the_bytes_of_each_arm_alone(merge: OpenScene) -> None:
    """The arms have different drivers of the ego, with a reaction time and without, and share those of the person."""
    first = arm(merge, RANDOM, RANDOM, persona=TEXTING)
    judges = [reference_driver(each, merge.world) for each in REFERENCES]
    egos = [mixture_of(judge, read_document(CAREFUL, Persona)) for judge in judges]
    arms = [first, *(replace(first, drivers=(ego, first.drivers[1])) for ego in egos)]
    alone = [side_by_side(each, *([episode] for episode in range(5))) for each in arms]
    assert len({*map(tuple, alone)}) == len(arms)
    for batches in ([[0, 1, 2, 3, 4]], [[0], [1, 2], [3, 4]]):
        played = [[repr((game.played, game.trace)) for game in games] for games in assess_arms(arms, batches)]
        assert [list(each) for each in zip(*played, strict=True)] == alone


def test_arms__that_can_not_share_a_simulation_are_refused(merge: OpenScene) -> None:
    first = arm(merge, RANDOM, RANDOM)
    for other in (arm(merge, RANDOM, None), arm(merge, SumoDriver(), RANDOM)):
        with pytest.raises(ValueError, match=r"takes part|SUMO"):
            list(assess_arms([first, other], [[0]]))
    shielded = arm(merge, ShieldedDriver(RANDOM, merge.world), RANDOM)
    with pytest.raises(ValueError, match="shield"):
        list(assess_arms([first, shielded], [[0]]))


def test_batch__drivers_of_others_and_sumo_play_alone(merge: OpenScene) -> None:
    assert not plays_side_by_side(arm(merge, Steady(), RANDOM))
    assert not plays_side_by_side(arm(merge, ShieldedDriver(Steady(), merge.world), RANDOM))
    assert not plays_side_by_side(arm(merge, RANDOM, SumoDriver()))
    assert plays_side_by_side(arm(open_scene("zebra"), RANDOM, SumoDriver()))  # an ordinary walker


def test_batch__an_error_ends_only_its_game(merge: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    """After an error among games side by side each is played again alone."""
    assessed = arm(open_scene("paper_merge"), RANDOM, RANDOM)
    alone, starts = side_by_side(assessed, [0], [1], [2]), list[int]()

    def failing(name: str) -> Callable[..., FloatArray]:
        decide = getattr(LearnedDriver, name)

        def fail(driver: LearnedDriver, *inputs: FloatArray) -> FloatArray:
            if starts[-1] == 1 or len(starts) == 3:
                raise RuntimeError("out of ideas")
            return decide(driver, *inputs)

        return fail

    for name in ("decide", "decide_apart"):
        monkeypatch.setattr(LearnedDriver, name, failing(name))
    games = list(assess_batches(assessed, [[0, 1, 2]], starts.append))
    assert starts == [0, 1, 2, 0, 1, 2]
    assert [game.played["error"] for game in games] == ["", "RuntimeError: out of ideas", ""]
    assert [repr((game.played, game.trace)) for game in games[::2]] == alone[::2]


# --- records ----------------------------------------------------------------------------------------------------------


def test_record__cells_of_an_absent_player_are_empty(merge: OpenScene) -> None:
    for drivers, absent, there in (((SumoDriver(), None), "non_ego", "ego"), ((None, SumoDriver()), "ego", "non_ego")):
        (game,) = play(arm(merge, *drivers), 1)
        assert game.record[f"{absent}_outcome"] == ""
        assert all(game.record[name] is None for name in MEASURED if name.startswith(f"{absent}_"))
        assert game.record[f"{there}_outcome"] != ""
        assert game.record[f"{there}_mean_speed_mps"] > 0.0
        assert game.record["ego_failed"] in ((0, 1) if there == "ego" else (None,))


def test_record__the_ego_failed_unless_it_reached_the_goal(merge: OpenScene) -> None:
    games = [*play(arm(merge, SumoDriver(), None), 2), *play(arm(merge, RANDOM, None), 2)]
    outcomes = {game.record["ego_outcome"] for game in games}
    assert "goal" in outcomes
    assert outcomes & {"rail", "timeout"}
    for game in games:
        assert game.record["ego_failed"] == int(game.record["ego_outcome"] != "goal")
        assert (game.record["ego_time_to_goal_s"] is not None) == (game.record["ego_outcome"] == "goal")


def test_record__agrees_with_the_trace(merge: OpenScene) -> None:
    for game in play(arm(merge, Steady(), SumoDriver()), 3):
        recorded, frame = game.record, trace(game)
        ego = frame[(frame["player"] == "ego") & (frame["step"] > 0)]
        ended = ego.index[ego["outcome"] != ""]
        drove = ego.loc[: ended[0]]
        assert recorded["ego_outcome"] == drove["outcome"].iloc[-1]
        assert recorded["ego_mean_speed_mps"] == pytest.approx(drove["speed_mps"].mean())
        assert recorded["ego_max_deceleration_mps2"] == pytest.approx(max(0.0, -drove["acceleration_mps2"].min()))
        if recorded["ego_outcome"] == "goal":
            assert recorded["ego_time_to_goal_s"] == pytest.approx(drove["time_s"].iloc[-1])
        assert recorded["duration_s"] == pytest.approx(frame["time_s"].max())


def test_records__make_a_table_of_episodes(merge: OpenScene) -> None:
    games = play(arm(merge, Failing(KeyError("x")), None), 2)
    rows = [{**game.record, "arm": "naive_alone", "persona": "", "seed": 1} for game in games]
    table = table_of("episodes", rows)
    assert table["ego_failed"].isna().tolist() == [False, True]
    assert table["ego_outcome"].tolist()[1] == "error"


# --- errors -----------------------------------------------------------------------------------------------------------

ERRORS = [RuntimeError("out of ideas"), OSError("gone"), SimulationError("died")]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_assess__an_exception_of_a_driver_ends_only_its_game(error: Exception, merge: OpenScene) -> None:
    games = play(arm(merge, Failing(error), SumoDriver()), 4)
    without_errors = play(arm(merge, Steady(), SumoDriver()), 4)
    assert [game.record["ego_outcome"] == "error" for game in games] == [False, True, False, True]
    for game in games[1::2]:
        assert game.record["error"] == f"{type(error).__name__}: {error}"
        assert game.record["non_ego_outcome"] == "error"
        assert game.trace is None
        assert set(game.record) == {"episode", "ego_outcome", "non_ego_outcome", "error"}
    assert [game.record["episode"] for game in games] == [0, 1, 2, 3]
    assert records(games[::2]) == records(without_errors[::2])


def test_assess__a_full_disk_is_raised_and_is_no_game_in_error(merge: OpenScene) -> None:
    with pytest.raises(OSError, match="No space left"):
        play(arm(merge, Failing(OSError(ENOSPC, "No space left on device")), SumoDriver()), 2)


def test_assess__an_interrupt_is_raised(merge: OpenScene) -> None:
    class Interrupted(Steady):
        def decide(self, *_: Any) -> FloatArray:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        play(arm(merge, Interrupted(), None))
    assert len(play(arm(merge, Steady(), None), 1)) == 1  # SUMO was closed


# --- the log --------------------------------------------------------------------------------------------------------


def test_trace__has_every_step_of_every_player(merge: OpenScene) -> None:
    for episode, game in enumerate(play(arm(merge, Steady(), SumoDriver()), 3)):
        frame = trace(game)
        assert list(frame.columns) == SCHEMA.names
        assert set(frame["episode"]) == {episode}
        assert np.array_equal(frame["time_s"], frame["step"] * merge.world.step_s)
        for player, rows in frame.groupby("player"):
            steps = rows["step"].tolist()
            assert steps == list(range(len(steps)))  # from the start, without a gap
            outcome = game.record[f"{player}_outcome"]
            reached = rows.index[rows["outcome"] != ""]
            assert set(rows.loc[reached, "outcome"]) == {outcome}
            if outcome == "goal":
                assert len(reached) == 1  # then it is removed
                assert rows["outcome"].iloc[-1] == "goal"
            else:
                assert steps[-1] == frame["step"].max()
                wreck = rows.loc[reached[1:]]
                assert (wreck["speed_mps"] == 0.0).all()
                assert len(wreck[["x_m", "y_m", "heading_rad"]].drop_duplicates()) <= 1
        assert frame["step"].max() * merge.world.step_s == pytest.approx(game.record["duration_s"])
        assert frame.equals(frame.sort_values(["step", "player"], kind="stable"))


def test_trace__vehicle_types_are_those_of_the_route_file(merge: OpenScene) -> None:
    (game,) = play(arm(merge, Steady(), SumoDriver()), 1)
    kinds = trace(game).groupby("player")["vehicle_type"].unique()
    assert {player: kind.tolist() for player, kind in kinds.items()} == {
        "ego": [merge.vehicle(0).vehicle_type],
        "non_ego": [merge.vehicle(1).vehicle_type],
    }


def test_assess__metrics_that_need_a_steering_angle_are_empty_for_sumo(merge: OpenScene) -> None:
    (game, *_) = play(arm(merge, SumoDriver(), SumoDriver()), 1)
    assert game.record["ego_max_lateral_acceleration_mps2"] is None
    assert game.trace is not None
    assert set(game.trace["steering_rad"]) == {0.0}  # otherwise lane changes would be reported as swerves


def test_assess__of_sumo_s_drivers_the_one_behind_a_parked_van_waits_for_the_other() -> None:
    for game in play(arm(open_scene("oncoming_bypass"), SumoDriver(), SumoDriver())):
        assert (game.record["ego_outcome"], game.record["non_ego_outcome"]) == ("goal", "goal")
        courses = trace(game)
        beside = courses[courses["x_m"].between(195.0, 205.0)].groupby("player")["time_s"]
        assert beside.max()["ego"] < beside.min()["non_ego"]


@pytest.mark.parametrize("scene", ["merge", "red_light", "roundabout", "zebra"])
def test_log__has_every_quantity_of_the_live_game(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    live: list[Step] = []
    step = Arena.step
    monkeypatch.setattr(Arena, "step", lambda arena: live.append(step(arena)) or live[-1])
    (game,) = play(arm(open_scene(scene), Steady(), SumoDriver() if scene == "merge" else Steady()), 1)
    recorded = game.recorded
    assert recorded is not None
    names = [
        "speed_mps",
        "leader_gap_m",
        "time_to_collision_s",
        "lateral_acceleration_mps2",
        "goal_m",
        "front_m",
        "gap_s",
        "passed_red_s",
        "wrong_way",
        "advanced_m",
        "speed_over_permitted",
        "clearance_m",
        "lateral_offset_m",
    ]
    for t, now in enumerate(live, start=1):
        drove = now.drove[0]
        assert drove.tolist() == recorded.drove[t].tolist()
        assert now.payoff[0] == pytest.approx(recorded.payoff[t], abs=0.0)
        for name in names:
            found = getattr(recorded.quantities, name)[t, drove]
            assert getattr(now.quantities, name)[0, drove].tolist() == found.tolist(), (t, name)
