"""Recorded games as the report's player shows them: from traces and the scene they were played on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from harness.environments.recorded import recorded_game as game_of
from harness.evaluation.comparisons.preventability import TAKES_OVER
from harness.evaluation.people import judged, judged_outcomes
from harness.evaluation.strategies import Arm, counterparts
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.unplayed_games import were_played
from harness.evaluation.worst_first import choose_games, worst_first
from harness.game.arrays import FloatArray
from harness.game.roles import EGO
from harness.game.sight import TALL_WIDTH_M
from harness.replay.contacts import contacts
from harness.replay.vehicles import DrawnVehicle, presences, types_of_vehicles
from harness.reports.embedding import BACKGROUND_COLUMNS, COLUMNS, REFERENCE_COLUMNS, GameTracks, Reference, Track
from harness.reports.failing_paths import MOST_PATHS, SPAN_S, FailingPath
from harness.road.net.network import read_net
from harness.road.scene import drawing
from harness.road.scene.open_scene import OpenScene

Takeovers = Mapping[tuple[str, int, int], pd.DataFrame]
"""The rows of `takeovers.csv` by arm, seed and episode."""
_GAME = ["arm", "seed", "episode"]
TAKE_TURNS = 20  # games of an arm and seed in turn, so that a page without room for all has some of each


def recorded_games(
    episodes: pd.DataFrame,
    arms: Mapping[str, Arm],
    traces: Callable[[str, int], Path],
    scene: OpenScene,
    examples: Sequence[tuple[str, int, int]] = (),
    takeovers: Takeovers = MappingProxyType({}),
) -> Iterator[GameTracks]:
    """Every played game, those to watch first at the front. Each is read when the iterator reaches it.

    Games with a replay come first, worst first, in turns of `TAKE_TURNS` per arm and seed. Each is followed by the game
    of the same episode that it is compared with; then the rest. `arms` are the arms by name; `traces` gives the traces
    file of an arm and seed. `examples`: arm, seed and episode of games that the page refers to, which come before all
    others. `takeovers`: the courses of reference drivers.
    """
    reader = TraceReader()
    for game in watching_order(episodes, arms, examples).itertuples():
        trace = reader.read(traces(game.arm, game.seed), game.episode)
        yield tracks_of(trace, scene, game, takeovers.get((game.arm, game.seed, game.episode)))


def failing_paths(
    episodes: pd.DataFrame, arms: Mapping[str, Arm], traces: Callable[[str, int], Path], scene: OpenScene
) -> Iterator[FailingPath]:
    """The last seconds of the games that an ego fails against a person, at most `MOST_PATHS` of an arm, worst first."""
    against = [name for name, arm in arms.items() if arm.ego and arm.non_ego and not arm.is_of_a_trait]
    failed = episodes[episodes["arm"].isin(against) & (episodes["ego_failed"] == 1) & were_played(episodes)]
    reader = TraceReader()
    for game in worst_first(failed).groupby("arm", sort=False).head(MOST_PATHS).itertuples():
        trace = reader.read(traces(game.arm, game.seed), game.episode)
        yield path_of(trace, scene, game)


def path_of(trace: pd.DataFrame, scene: OpenScene, game: Any) -> FailingPath:
    """The last seconds of one game, until the ego ends; `game` is its row of `episodes`."""
    last = int(trace.loc[trace["player"] == "ego", "step"].max())
    shown = trace[trace["step"].between(last - round(SPAN_S / scene.world.step_s), last)].sort_values("step")
    players = {str(role): rows for role, rows in shown.groupby("player") if role in scene.world.roles}
    touches = contacts(trace, types_of_vehicles(trace, scene.routes.types_xml, scene.obstacles), scene.rail_lines)
    return FailingPath(
        arm=game.arm,
        persona=game.persona,
        players={role: rows[["x_m", "y_m"]].to_numpy(float) for role, rows in players.items()},
        contact_m=(touches[-1].x_m, touches[-1].y_m) if touches else None,
        seed=int(game.seed),
        episode=int(game.episode),
    )


def watching_order(
    episodes: pd.DataFrame, arms: Mapping[str, Arm], examples: Sequence[tuple[str, int, int]] = ()
) -> pd.DataFrame:
    """The rows of `episodes` that were played, in the order of `recorded_games`. Games against a person with another
    person's trait are the last, but for examples."""
    played = episodes[were_played(episodes)]
    rows = {(game.arm, game.seed, game.episode): game.Index for game in played.itertuples()}
    order: dict[Any, None] = dict.fromkeys(rows[game] for game in examples if game in rows)
    own = played[~played["arm"].isin([name for name, arm in arms.items() if arm.is_of_a_trait])]
    chosen = worst_first(choose_games(own))
    turn = chosen.groupby(["arm", "seed"]).cumcount() // TAKE_TURNS
    turn[judged_outcomes(chosen) == "goal"] = 0
    for game in chosen.loc[turn.sort_values(kind="stable").index].itertuples():
        order[game.Index] = None
        for each in counterparts(arms[game.arm]) if game.arm in arms else ():
            counterpart = rows.get((each.name, game.seed, game.episode))
            if counterpart is not None:
                order[counterpart] = None
    order |= dict.fromkeys(worst_first(own).index)
    order |= dict.fromkeys(worst_first(played).index)
    return played.loc[list(order)]


def takeovers_of(table: pd.DataFrame) -> Takeovers:
    return {(str(arm), int(seed), int(episode)): rows for (arm, seed, episode), rows in table.groupby(_GAME)}


def tracks_of(trace: pd.DataFrame, scene: OpenScene, game: Any, takeover: pd.DataFrame | None = None) -> GameTracks:
    """One game's trace as tracks; `game` is its row of `episodes`, `takeover` the course of a reference driver."""
    types = types_of_vehicles(trace, scene.routes.types_xml, scene.obstacles)
    recorded = game_of(trace, scene)
    measures = {name: getattr(recorded.quantities, name) for name in ("leader_gap_m", "time_to_collision_s")}
    by_name = {str(name): rows.sort_values("step") for name, rows in trace.groupby("player", sort=True)}
    players = []
    for place, role in enumerate(scene.world.roles):
        if role in by_name:
            rows = by_name.pop(role)
            steps = rows["step"].to_numpy()
            seen = {name: np.where(recorded.drove, each, np.nan)[steps, place] for name, each in measures.items()}
            track = _track(role, rows.assign(**seen), types[role], list(COLUMNS))
            ended = rows[rows["outcome"] != ""].head(1)
            if len(ended):
                track = replace(track, outcome=ended["outcome"].iloc[0], ended_step=int(ended["step"].iloc[0]))
            players.append(track)
    of_background = list(COLUMNS)[:BACKGROUND_COLUMNS]
    return GameTracks(
        arm=game.arm,
        persona=game.persona,
        seed=int(game.seed),
        episode=int(game.episode),
        step_s=scene.world.step_s,
        steps=int(trace["step"].max()),
        outcome=judged(game._asdict())[1],
        severity=float(np.nan_to_num(game.severity)),
        delta_v_mps=delta_v_of(game),
        players=players,
        background=[
            _track(name, piece, types[name], of_background)
            for name, rows in by_name.items()
            for piece in presences(rows)
        ],
        reference=None if takeover is None else _reference(takeover, types),
        perceived=_perceived(trace, scene.world.roles[EGO]),
        touches=[(contact.time_s, contact.x_m, contact.y_m) for contact in contacts(trace, types, scene.rail_lines)],
    )


def delta_v_of(game: Any) -> float | None:
    """The greater change of velocity in the collision of a row of `episodes`; None without one."""
    known = [each for each in (game.ego_delta_v_mps, game.other_delta_v_mps) if np.isfinite(each)]
    return max(known, default=None)


def _perceived(trace: pd.DataFrame, ego: str) -> list[tuple[int, list[str], int]]:
    found = list[tuple[int, list[str], int]]()
    if not {"ego_lost", "ego_ghosts"} <= {*trace.columns}:
        return found
    rows = trace.loc[trace["player"] == ego, ["step", "ego_lost", "ego_ghosts"]].sort_values("step")
    for step, lost, ghosts in rows.itertuples(index=False):
        said = (lost.split(), len(ghosts.split("; ")) if ghosts else 0)
        if not found or found[-1][1:] != said:
            found.append((int(step), *said))
    return found


def _reference(takeover: pd.DataFrame, types: Mapping[str, DrawnVehicle]) -> Reference:
    shown = list(COLUMNS)[:REFERENCE_COLUMNS]
    tracks = [
        _track(str(role), rows.sort_values("step"), types[str(role)], shown)
        for role, rows in takeover.groupby("player", sort=False)
    ]
    return Reference(driver=TAKES_OVER[takeover["driver"].iloc[0]], players=tracks)


def _track(name: str, rows: pd.DataFrame, drawn: DrawnVehicle, columns: Sequence[str]) -> Track:
    return Track(
        name=name,
        size_m=(drawn.length_m, drawn.width_m),
        first_step=int(rows["step"].iloc[0]),
        columns={column: rows[column].to_numpy(float) for column in columns},
    )


def scene_drawing(scene: OpenScene) -> dict[str, Any]:
    """The parts of a scene that the page's player draws, in the scene's coordinates (m), for `road.js`."""
    net = read_net(scene.net_file)
    lines = {
        "laneMarks": drawing.lane_marks(net),
        "edgeLines": drawing.edge_lines(net),
        "rails": scene.rail_lines,
        "goal": drawing.goal_lines(scene, net),
        "buildings": scene.obstacles.outlines,
        "stripes": scene.stripes,
    }
    return {
        "surfaces": [list(map(_points, rings)) for rings in drawing.surfaces(net)],
        **{name: list(map(_points, each)) for name, each in lines.items()},
        "hidingObstacles": [each.name for each in scene.obstacles.each if each.hides],
        "tallWidth": TALL_WIDTH_M if scene.world.hiding.vehicles else None,
    }


def _points(line: FloatArray) -> list[list[float]]:
    return np.round(line, 2).tolist()
