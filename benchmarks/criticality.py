"""Compare time to collision and time headway of recorded games with commonroad-crime, on the road of the merge.

commonroad-crime pins an old protobuf and is no dependency of the harness: it has an environment of its own.

    python -m benchmarks.criticality export RUN STAGE FILE       # in the harness's environment: 50 games of an arm
    python benchmarks/criticality.py compare FILE                # in that of commonroad-crime
"""

from __future__ import annotations

import json
import logging
import math
import statistics
import sys
from pathlib import Path
from typing import Any

GAMES, EVERY = 50, 5
LANES_M = {1: -4.8, 2: -1.6}
"""Centres of the lanes of networks/paper_merge, which are 3.2 m wide."""
EGO, OTHER = 100, 101


def export(run: Path, stage: str, file: Path) -> None:
    """Write both players' motion, and the ego's time to collision and gap, of the first games of an arm."""
    import numpy as np

    from harness.environments.recorded import recorded_game
    from harness.evaluation.trace_file import TraceReader
    from harness.road.scene.open_scene import open_scene

    scene = open_scene(run / "scene")
    games, reader = [], TraceReader()
    for episode in range(GAMES):
        trace = reader.read(run / "traces" / f"{stage}.parquet", episode)
        game = recorded_game(trace[trace["player"].isin(scene.world.roles)], scene)
        q, kinds = game.quantities, game.body_kinds[: len(scene.world.roles)]
        steps = int(np.flatnonzero(game.drove.all(1))[-1]) + 1
        poses = np.stack([q.state.x_m, q.state.y_m, q.state.heading_rad, q.state.speed_mps], axis=-1)
        games.append(
            {
                "sizes": [(kind.length_m, kind.width_m) for kind in kinds],
                "poses": poses[:steps].tolist(),
                "ttc_s": q.time_to_collision_s[:steps, 0].tolist(),
                "headway_s": q.time_gap_s[:steps, 0].tolist(),
            }
        )
    file.write_text(json.dumps(games), encoding="utf-8")


def compare(file: Path) -> None:
    """Print at how many moments both have a value, and how much the values differ."""
    logging.disable(logging.CRITICAL)
    rows = [row for game in json.loads(file.read_text(encoding="utf-8")) for row in _moments(game)]
    print(f"{len(rows)} moments of {GAMES} games")
    for place, name in enumerate(("time to collision", "time headway")):
        theirs, ours = ([row[place][side] for row in rows] for side in (0, 1))
        both = [(a, b) for a, b in zip(theirs, ours, strict=True) if math.isfinite(a) and math.isfinite(b)]
        counts = [sum(map(math.isfinite, values)) for values in (theirs, ours)]
        differences = [abs(a - b) for a, b in both]
        text = f"median {statistics.median(differences):.2f} s, most {max(differences):.2f} s" if both else "-"
        print(f"{name}: commonroad-crime {counts[0]}, harness {counts[1]}, both {len(both)}; difference: {text}")


def _moments(game: dict[str, Any]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """At each compared step the time to collision and the headway, of commonroad-crime and of the harness."""
    from commonroad_crime.data_structure.configuration import (  # type: ignore[import-not-found]
        CriMeConfiguration,
    )
    from commonroad_crime.measure import THW, TTC  # type: ignore[import-not-found]

    configuration = CriMeConfiguration()
    configuration.update(ego_id=EGO, sce=_scenario(game))
    measures = [TTC(configuration), THW(configuration)]
    rows = []
    for step in range(1, len(game["poses"]) - 1, EVERY):
        theirs = [measure.compute(OTHER, step, verbose=False) for measure in measures]
        theirs = [math.inf if value is None or math.isnan(value) else float(value) for value in theirs]
        rows.append(((theirs[0], game["ttc_s"][step]), (theirs[1], game["headway_s"][step])))
    return rows


def _scenario(game: dict[str, Any]) -> Any:
    import numpy as np
    from commonroad.scenario.lanelet import Lanelet, LaneletNetwork  # type: ignore[import-not-found]
    from commonroad.scenario.scenario import Scenario, ScenarioID  # type: ignore[import-not-found]

    stations = np.linspace(-20.0, 260.0, 141)
    lines = {
        lane: [np.stack([stations, np.full_like(stations, y_m + side)], 1) for side in (1.6, 0.0, -1.6)]
        for lane, y_m in LANES_M.items()
    }
    network = LaneletNetwork()
    network.add_lanelet(Lanelet(*lines[1], 1, adjacent_left=2, adjacent_left_same_direction=True))
    network.add_lanelet(Lanelet(*lines[2], 2, adjacent_right=1, adjacent_right_same_direction=True))
    scenario = Scenario(dt=0.1, scenario_id=ScenarioID(map_name="Merge"))
    scenario.add_objects(network)
    scenario.add_objects([_car(EGO, game, 0), _car(OTHER, game, 1)])
    scenario.assign_obstacles_to_lanelets()
    return scenario


def _car(number: int, game: dict[str, Any], player: int) -> Any:
    """A car without acceleration, so that its time to collision is that of constant velocity."""
    import numpy as np
    from commonroad.geometry.shape import Rectangle  # type: ignore[import-not-found]
    from commonroad.prediction.prediction import TrajectoryPrediction  # type: ignore[import-not-found]
    from commonroad.scenario.obstacle import DynamicObstacle, ObstacleType  # type: ignore[import-not-found]
    from commonroad.scenario.state import CustomState, InitialState  # type: ignore[import-not-found]
    from commonroad.scenario.trajectory import Trajectory  # type: ignore[import-not-found]

    states = []
    for step, players in enumerate(game["poses"]):
        x, y, heading, speed = players[player]
        motion = {"velocity": speed * math.cos(heading), "velocity_y": speed * math.sin(heading)}
        still = {"acceleration": 0.0, "acceleration_y": 0.0}
        states.append({"position": np.array([x, y]), "orientation": heading, "time_step": step, **motion, **still})
    begin = {name: value for name, value in states[0].items() if not name.endswith("_y")}
    first = InitialState(**begin, yaw_rate=0.0, slip_angle=0.0)
    first.velocity_y, first.acceleration_y = states[0]["velocity_y"], 0.0
    shape = Rectangle(*game["sizes"][player])
    course = Trajectory(1, [CustomState(**state) for state in states[1:]])
    return DynamicObstacle(number, ObstacleType.CAR, shape, first, TrajectoryPrediction(course, shape))


if __name__ == "__main__":
    if sys.argv[1:2] == ["export"] and len(sys.argv) == 5:
        export(Path(sys.argv[2]), sys.argv[3], Path(sys.argv[4]))
    elif sys.argv[1:2] == ["compare"] and len(sys.argv) == 3:
        compare(Path(sys.argv[2]))
    else:
        sys.exit(__doc__)
