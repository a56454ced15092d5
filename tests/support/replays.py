"""Games drawn by hand, their replay folders, and what SUMO shows of these."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from defusedxml import ElementTree

from harness.replay import write_replay
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY
from tests.support.scenes import run_sumo_program

STEP_S = 0.1
RAILS = (
    np.array([[0.0, -6.4], [100.0, -6.4], [130.0, -3.2], [220.0, -3.2]]),
    np.array([[0.0, 0.0], [220.0, 0.0]]),
)
SIZES = {"car": (4.6, 1.8), "van": (5.5, 2.0), "city_bus": (12.0, 2.5)}
ROUTES = """<routes>
    <vType id="car" length="4.6" width="1.8" guiShape="passenger/sedan"/>
    <vType id="van" length="5.5" width="2.0" guiShape="delivery" color="120,60,160"/>
    <vType id="city_bus" vClass="bus"/>
    <vType id="unused" length="3"/>
</routes>"""

Pose = tuple[float, float, float, float]  # x_m, y_m, heading_rad, speed_mps


def write_merge_net(folder: Path) -> Path:
    """The net of tests/data/merge, two lanes that taper into one, with other types of vehicles in its route file."""
    (folder / "merge.rou.xml").write_text(ROUTES)
    return Path(shutil.copy(REPOSITORY / "tests" / "data" / "merge" / "merge.net.xml", folder))


def drive(
    player: str, poses: Iterable[Pose], *, vehicle_type: str = "car", first_step: int = 0, outcome: str = ""
) -> pd.DataFrame:
    """Rows of a trace; `outcome` is reached with the first pose of speed 0, or else with the last."""
    frame = pd.DataFrame(list(poses), columns=["x_m", "y_m", "heading_rad", "speed_mps"])
    reached = (frame["speed_mps"] == 0.0).cummax() | (frame.index == len(frame) - 1)
    frame = frame.assign(episode=0, step=first_step + frame.index, player=player, vehicle_type=vehicle_type)
    frame = frame.assign(time_s=frame["step"] * STEP_S, acceleration_mps2=0.0, steering_rad=0.0, lapsed=False)
    return frame.assign(outcome=np.where(reached, outcome, ""))


def game(*players: pd.DataFrame) -> pd.DataFrame:
    return pd.concat(players).sort_values(["episode", "step", "player"], ignore_index=True)


def straight(x_m: float, y_m: float, speed_mps: float, steps: int) -> list[Pose]:
    return [(x_m + k * speed_mps * STEP_S, y_m, 0.0, speed_mps) for k in range(steps)]


def clean_game() -> pd.DataFrame:
    """The non-ego merges behind the ego and stays; the ego leaves, with its nose beyond the road's end."""
    merged = [min(max(k - 40, 0) / 50, 1) for k in range(170)]
    merging = [
        (20 + 1.0 * k, -4.8 + 3.2 * share, math.atan2(0.064, 1.0) if 0 < share < 1 else 0.0, 10.0)
        for k, share in enumerate(merged)
    ]
    return game(
        drive("ego", straight(35.0, -1.6, 12.0, 154), outcome="goal"),
        drive("non_ego", merging),
    )


def collision_game() -> pd.DataFrame:
    """The non-ego turns into the ego, which is beside it; both stop where they touch, turned, overlapping."""
    turning: list[Pose] = [(41 + 1.2 * k, -4.8 + 0.06 * k, 0.05, 12.0) for k in range(32)]
    wrecks = [(turning[-1][0] + 0.5, turning[-1][1] + 0.2, 0.4, 0.0)] * 12
    ego_wreck: list[Pose] = [(40 + 1.2 * 32, -1.6, -0.15, 0.0)] * 12
    return game(
        drive("ego", straight(40.0, -1.6, 12.0, 32) + ego_wreck, outcome="collision"),
        drive("non_ego", turning + wrecks, outcome="collision"),
    )


def rail_game() -> pd.DataFrame:
    """The ego spins through the left rail and lies across it; the other is shoved off the road backwards."""
    spin: list[Pose] = [(90 + 1.1 * k, -1.6 + 0.09 * k, 0.3 * k, 11.0) for k in range(30)]
    resting = [(spin[-1][0], spin[-1][1], spin[-1][2], 0.0)] * 5
    backwards: list[Pose] = [(140 - 0.8 * k, -3.0 - 0.12 * k, math.pi - 0.2, 8.0) for k in range(35)]
    return game(drive("ego", spin + resting, outcome="rail"), drive("non_ego", backwards))


def busy_game() -> pd.DataFrame:
    """Others appear in the middle of the game: at the start, close behind, and inside the junction."""
    return game(
        drive("ego", straight(30.0, -1.6, 10.0, 80), outcome="timeout"),
        drive("flow.0", straight(2.4, -1.6, 13.0, 60), vehicle_type="van", first_step=15),
        drive("flow.1", straight(6.0, -4.8, 9.0, 40), vehicle_type="city_bus", first_step=21),
        drive("bus|2: late", straight(108.0, -1.6, 9.0, 50), vehicle_type="car", first_step=30),
        drive("leaves.inside", straight(90.0, -1.6, 12.0, 22), first_step=3),
        drive("brief", straight(60.0, -4.8, 9.0, 1), vehicle_type="DEFAULT_VEHTYPE", first_step=40),
    )


GAMES = {"clean": clean_game, "collision": collision_game, "rail": rail_game, "busy": busy_game}


def write(trace: pd.DataFrame, net: Path, folder: Path, **changes: object) -> Path:
    opened = open_scene(REPOSITORY / "tests" / "data" / "merge")
    routes = replace(opened.routes, types_xml=ROUTES)
    scene = replace(opened, folder=net.parent, routes=routes, rail_lines=RAILS)
    write_replay(trace, scene, folder, **{"title": "test game", **changes})  # type: ignore[arg-type]
    return folder


def play(folder: Path) -> tuple[pd.DataFrame, str]:
    """What SUMO reports of a replay, one row per vehicle and step, and what it complained of."""
    output = folder.parent / "played.xml"
    options = ["-c", str(folder / "scene.sumocfg"), "--precision", "6", "--fcd-output", str(output)]
    complaints = run_sumo_program("sumo", [*options, "--fcd-output.attributes", "id,x,y,angle,type,speed"], folder)
    rows = [
        {"label_s": float(step.get("time")), **vehicle.attrib}
        for step in ElementTree.parse(output).getroot()
        for vehicle in step
    ]
    played = pd.DataFrame(rows)
    played[["x", "y", "angle", "speed"]] = played[["x", "y", "angle", "speed"]].astype(float)
    return played.rename(columns={"id": "player"}), complaints


def without_the_held_picture(played: pd.DataFrame, last_step: int) -> pd.DataFrame:
    """SUMO's frames without that after the last step, which shows the same places as the last step."""
    pose = ["x", "y", "angle"]
    last, held = (played[played["step"] == step].set_index("player")[pose] for step in (last_step, last_step + 1))
    pd.testing.assert_frame_equal(held.sort_index(), last.sort_index())
    return played[played["step"] <= last_step]


def assert_plays(folder: Path, trace: pd.DataFrame, lengths_m: Mapping[str, float]) -> None:
    """SUMO shows every frame of the trace and no other: place to 1e-3 m, heading to 0.1 degrees."""
    played, printed = play(folder)
    assert printed == ""

    # the first frame of each vehicle is SUMO putting it into the simulation, a step before it was there
    played["step"] = np.rint(played["label_s"] / STEP_S).astype(int) - 1
    entering = played.groupby("player")["step"].idxmin()
    expected_entries = trace.groupby("player")["step"].min() - 1
    assert played.loc[entering].set_index("player")["step"].to_dict() == expected_entries.to_dict()
    played = played.drop(index=entering)
    played = without_the_held_picture(played, int(trace["step"].max()))

    both = trace.merge(played, on=["player", "step"], how="outer", indicator=True)
    assert (both["_merge"] == "both").all(), both[both["_merge"] != "both"]
    length = both["vehicle_type"].map(lengths_m).fillna(5.0)
    front_x = both["x_m"] + 0.5 * length * np.cos(both["heading_rad"])
    front_y = both["y_m"] + 0.5 * length * np.sin(both["heading_rad"])
    assert np.abs(both["x"] - front_x).max() <= 1e-3
    assert np.abs(both["y"] - front_y).max() <= 1e-3
    compass = 90.0 - np.degrees(both["heading_rad"])
    assert np.abs((both["angle"] - compass + 180.0) % 360.0 - 180.0).max() <= 0.1
    # who leaves early does so with a jump that SUMO needs and nobody sees
    last_step = both.groupby("player")["step"].transform("max")
    stays = (both["step"] < last_step) | (last_step == both["step"].max())
    assert np.abs(both["speed"] - both["speed_mps"])[stays].max() <= 1e-3
