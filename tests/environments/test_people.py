"""Games with three people: who takes part, what is recorded, and what the environments call them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness import DrivingEnv, ParallelDrivingEnv, UsageError
from harness.assessment.rollout import Game
from harness.assessment.seated_arm import SeatedArm
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.environments.vector_env import ArenaVecEnv, JoinedVecEnv
from harness.evaluation.columns import TABLES
from harness.evaluation.people import COLLIDED_WITH, columns_for
from harness.evaluation.tables import typed
from harness.game.arrays import FloatArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.rollouts import Steady, play, seated, trace
from tests.support.scenes import LEFT_Y, RIGHT_Y, THREE_PEOPLE, build_scene, placed
from tests.support.tiny import CAREFUL

ROLES = ["ego", "non_ego", "non_ego_2", "non_ego_3"]
Open = Callable[..., Arena]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("scenes") / "three", places=THREE_PEOPLE)


def played(scene: OpenScene, *drivers: Any, episodes: int = 1) -> list[Game]:
    careful = read_document(CAREFUL, Persona)
    return play(SeatedArm(name="any", scene=scene, drivers=seated(drivers, (careful,) * 4), seed=1), episodes)


def table(games: list[Game]) -> pd.DataFrame:
    rows = pd.DataFrame([{"arm": "any", "persona": "", "seed": 1, **game.record} for game in games])
    return typed(rows.reindex(columns=list(columns_for(3, TABLES["episodes"]))))


def test_game__has_a_track_and_a_record_of_each_player(scene: OpenScene) -> None:
    (game,) = played(scene, *[SumoDriver()] * 4)
    assert sorted(set(trace(game)["player"])) == ROLES
    (row,) = table([game]).to_dict("records")
    assert [row[f"{role}_outcome"] for role in ROLES] == ["goal"] * 4
    assert all(row[f"{role}_mean_speed_mps"] > 10.0 for role in ROLES)
    assert all(np.isfinite(row[f"{role}_payoff"]) for role in ROLES)


def test_game__names_the_person_that_the_ego_collided_with(scene: OpenScene) -> None:
    (game,) = played(scene, Steady(1.0), SumoDriver(), Steady(-0.2), SumoDriver())
    (row,) = table([game]).to_dict("records")
    assert (row["ego_outcome"], row[COLLIDED_WITH]) == ("collision", "non_ego_2")
    assert [row[f"{role}_outcome"] for role in ROLES[1:]] == ["goal", "collision", "goal"]


def test_game__people_without_an_ego_drive_one_at_a_time(scene: OpenScene) -> None:
    games = played(scene, None, *[Steady(0.3)] * 3, episodes=4)
    assert [set(trace(game)["player"]) for game in games] == [{role} for role in (*ROLES[1:], ROLES[1])]
    rows = table(games)
    assert (rows["ego_outcome"] == "").all()
    assert rows["non_ego_2_outcome"].tolist() == ["", "goal", "", ""]
    assert rows["non_ego_2_payoff"].notna().tolist() == [False, True, False, False]


def test_start__players_that_are_sometimes_absent_are_absent_together(scene: OpenScene) -> None:
    starts = scene.start_distribution([HumanFactors()] * 4, [1.0, 0.5, 0.5, 0.5])
    present = np.array([draw_initial_state(starts, "test", game).present for game in range(200)])
    assert present[:, 0].all()
    assert (present[:, 1] == present[:, 2]).all()
    assert (present[:, 1] == present[:, 3]).all()
    assert 0.35 < present[:, 1].mean() < 0.65


def test_step__quantities_of_four_players(scene: OpenScene, arena_of: Open) -> None:
    # The ego, at 15 m/s, follows person 2, at 10 m/s, 20 m ahead; persons 1 and 3 are side by side with them.
    arena = arena_of(scene, 1)
    poses = [(40.0, RIGHT_Y, 0.0, 15.0), (40.0, LEFT_Y, 0.0, 8.0), (60.0, RIGHT_Y, 0.0, 10.0), (60.0, LEFT_Y, 0.0, 8.0)]
    arena.reset({0: placed(scene, *poses)})
    q = arena.step(np.zeros((1, 4, 2))).quantities
    moved_m = q.state.x_m[0] - [40.0, 40.0, 60.0, 60.0]
    gap_m = 20.0 + moved_m[2] - moved_m[0] - 4.6
    closing_mps = q.state.speed_mps[0, 0] - q.state.speed_mps[0, 2]
    assert moved_m == pytest.approx([1.5, 0.8, 1.0, 0.8], abs=0.02)
    assert q.leader_gap_m[0, 0] == pytest.approx(gap_m)
    assert q.leader_gap_m[0, 1] == pytest.approx(20.0 - 4.6, abs=1e-6)
    assert np.isinf(q.leader_gap_m[0, 2:]).all()
    assert q.time_to_collision_s[0, 0] == pytest.approx(gap_m / closing_mps)
    assert np.isinf(q.time_to_collision_s[0, 1])
    # across the lanes: 3.2 m between the centres, 1.8 m of car
    assert q.vehicle_clearance_m[0] == pytest.approx([1.4] * 4)


def test_parallel_environment__has_an_agent_for_each_player(scene: OpenScene) -> None:
    environment = ParallelDrivingEnv(scene, non_ego_persona=[CAREFUL] * 3)
    try:
        assert environment.possible_agents == ROLES
        environment.reset(seed=1)
        for _ in range(3):
            seen, payoffs, *_ = environment.step({agent: np.zeros(2, np.float32) for agent in environment.agents})
        assert list(seen) == list(payoffs) == ROLES
    finally:
        environment.close()


def test_parallel_environment__personas_that_do_not_match_the_people_are_refused(scene: OpenScene) -> None:
    with pytest.raises(UsageError, match="2 personas for 3 people"):
        ParallelDrivingEnv(scene, non_ego_persona=[CAREFUL] * 2)


def test_environment__the_learner_may_be_any_person(scene: OpenScene) -> None:
    environment = DrivingEnv(scene, player="non_ego_3", other="sumo")
    try:
        observation, info = environment.reset(seed=1)
        assert info["station_m"] > 50.0  # person 3 starts 60 to 70 m along the road
        assert np.abs(observation).max() <= 1.0
    finally:
        environment.close()
    with pytest.raises(UsageError, match="there is no player 'non_ego_4'"):
        DrivingEnv(scene, player="non_ego_4")


def test_joined_environment__is_its_arenas_one_after_the_other(scene: OpenScene) -> None:
    starts = scene.start_distribution([HumanFactors()] * 4, [1.0] * 4)

    def of_place(learner: int, games: int) -> ArenaVecEnv:
        seats = [Seat(None) if player == learner else Seat(SumoDriver()) for player in range(4)]
        return ArenaVecEnv(Arena(scene, games, seats), learner, starts, "test", learner)

    def steps_of(environment: Any) -> list[FloatArray]:
        seen = [environment.reset()]
        for _ in range(5):
            environment.step_async(np.full((environment.num_envs, 2), 0.5))
            seen.append(environment.step_wait()[0])
        environment.close()
        return seen

    joined = steps_of(JoinedVecEnv([of_place(1, 2), of_place(3, 1)]))
    alone = [steps_of(of_place(1, 2)), steps_of(of_place(3, 1))]
    for step, first, second in zip(joined, *alone, strict=True):
        np.testing.assert_array_equal(step, np.concatenate([first, second]))


def test_scene__people_that_can_not_all_stand_on_one_lane_are_refused(tmp_path: Path) -> None:
    places = THREE_PEOPLE | {
        "non_ego_3": ("road", "road_0", "[60.0, 60.1]"),
        "non_ego_2": ("road", "road_0", "[60.0, 62.0]"),
    }
    with pytest.raises(UsageError) as refused:
        build_scene(tmp_path / "crowded", places=places)
    assert "scene.toml: non_ego_3: non_ego_2 and non_ego_3 overlap in 200 of 200 drawn starts" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_scene__people_that_sometimes_start_in_one_another_are_a_warning(scene: OpenScene, tmp_path: Path) -> None:
    assert scene.warnings == []
    starts = {"non_ego_2": ("road", "road_0", "[60.0, 80.0]"), "non_ego_3": ("road", "road_0", "[70.0, 90.0]")}
    places = THREE_PEOPLE | starts
    (warning,) = build_scene(tmp_path / "narrow", places=places).warnings
    counted = re.match(r"warning: non_ego_2 and non_ego_3 overlap in (\d+) of 200 drawn starts", warning)
    assert counted
    # b - a is spread as a triangle from -10 to 30 m; it is below a car's 4.6 m in 0.23 of the draws.
    assert int(counted[1]) == pytest.approx(0.23 * 200, abs=20)


def test_scene__a_mistake_in_a_start_names_the_person(scene: OpenScene, tmp_path: Path) -> None:
    written = (scene.folder / "scene.toml").read_text(encoding="utf-8")
    for name in ("n.net.xml", "n.rou.xml"):
        (tmp_path / name).write_bytes((scene.folder / name).read_bytes())
    file = tmp_path / "scene.toml"
    file.write_text(written.replace('vehicle = "non_ego_3"', 'vehicle = "non_ego_9"'), encoding="utf-8")
    with pytest.raises(UsageError, match=r"non_ego_3\.vehicle: n\.rou\.xml has no vehicle 'non_ego_9'"):
        open_scene(tmp_path)
