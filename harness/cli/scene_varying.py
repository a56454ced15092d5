"""Writing variants of a scene: the same players and question on roads of other lengths, widths, limits and shapes."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from math import degrees, radians
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from harness.assessment.route_trial import check_routes
from harness.cli.new_documents import check_free
from harness.config.scene import SCENE_FILE
from harness.config.toml_reading import parse_toml
from harness.errors import Problem, UsageError
from harness.files import new_folder
from harness.game.roles import EGO
from harness.maps.varied_road import RoadVariation, Warp, vary_net, vary_route_file, warp_of
from harness.road.net.network import lane_line, read_net
from harness.road.scene.cartesian_road import route_line_of
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import OpenScene, open_scene

_ATTEMPTS = 10


class VariedScene(NamedTuple):
    """A variant that was written: its folder, how its road differs, and why draws before it were discarded."""

    folder: Path
    variation: RoadVariation
    discarded: tuple[str, ...]


def name_of_variant(scene: OpenScene, seed: int) -> str:
    """The name of a variant of a scene, and of its folder."""
    return f"{scene.document.name}_road{seed}"


def check_variable(scene: OpenScene, seeds: Sequence[int], out: Path) -> None:
    """Raise UsageError if a scene can't be varied, or its variants can't be written to a folder."""
    files = (scene.document.net, scene.document.routes, *scene.document.additional)
    if packed := [scene.folder / each for each in files if each.lower().endswith(".gz")]:
        message, remedy = "is compressed, and only plain files are varied", "unpack it, and name the plain file"
        raise UsageError(Problem(str(path), "", message, remedy) for path in packed)
    paths = (out / name_of_variant(scene, seed) for seed in seeds)
    check_free(paths, "choose another --seed, or --out another folder")


def write_variant(scene: OpenScene, seed: int, out: Path) -> VariedScene:
    """Write the variant of a scene that a seed draws. A road that a rule-based driver can't drive is drawn again.

    Raises UsageError if no draw can be driven or the folder can't be written.
    """
    name, problems = name_of_variant(scene, seed), list[str]()
    with TemporaryDirectory(prefix="harness-road-") as scratch:
        for attempt in range(_ATTEMPTS):
            variation = RoadVariation.drawn("road", scene.document.name, seed, attempt)
            folder = Path(scratch) / str(attempt) / name
            folder.mkdir(parents=True)
            try:
                _write(scene, name, variation, folder)
                varied = open_scene(folder)
                check_loads(varied)
                check_routes(varied, "choose another --seed")
            except UsageError as error:
                problems.append("; ".join(problem.message for problem in error.problems))
                continue
            with new_folder(out / name) as copy:
                shutil.copytree(folder, copy, dirs_exist_ok=True)
            return VariedScene(out / name, variation, tuple(problems))
    message = f"none of {_ATTEMPTS} roads of seed {seed} can be driven: {problems[-1]}"
    raise UsageError.of(scene.folder, "", message, "choose another --seed, or another scene")


def _write(scene: OpenScene, name: str, variation: RoadVariation, folder: Path) -> None:
    net, document = read_net(scene.net_file), scene.document
    lanes = [lane for edge in net.getEdges(withInternal=False) for lane in edge.getLanes()]
    points = np.concatenate([lane_line(lane) for lane in lanes])
    fastest_mps = max(lane.getSpeed() for lane in lanes)
    warp = warp_of(variation, route_line_of(scene.world, EGO), points, fastest_mps)
    vary_net(scene.net_file, folder / document.net, warp, variation)
    for file in (document.routes, *document.additional):
        vary_route_file(scene.folder / file, folder / file, variation)
    varied = read_net(folder / document.net)
    lengths = {each.getID(): each.getLength() for each in net.getEdges(withInternal=False)}
    stretched = {each: varied.getEdge(each).getLength() / length_m for each, length_m in lengths.items()}
    table = parse_toml((scene.folder / SCENE_FILE).read_text(encoding="utf-8"))
    keys = _varied_keys({**table, "name": name}, stretched, warp, variation)
    header = f"# {document.name} on another road: {words_of(variation)}.\n"
    (folder / SCENE_FILE).write_text(header + tomli_w.dumps(keys), encoding="utf-8")


def words_of(variation: RoadVariation) -> str:
    """How a road differs from that of its scene."""
    shares = f"lengths × {variation.length_share:.2f}, lane widths × {variation.width_share:.2f}, "
    side = "left" if variation.bend_mps2 > 0.0 else "right"
    bend = f"limits × {variation.limit_share:.2f}, bend of {abs(variation.bend_mps2):.1f} m/s² to the {side}, "
    return f"{shares}{bend}angles {variation.angle_deg:+.0f}°"


# --- the document --------------------------------------------------------------------------------------------------


def _varied_keys(
    keys: dict[str, Any], stretched: Mapping[str, float], warp: Warp, variation: RoadVariation
) -> dict[str, Any]:
    """The keys of scene.toml with places on the varied road. `stretched` are the factors of the edges' lengths."""
    if "goal" in keys:
        keys["goal"] = _on_edge(keys["goal"], keys["goal"]["edge"], stretched)
    for player in (keys["ego"], *keys["non_ego"]):
        _vary_player(player, stretched, warp, variation)
    for obstacle in keys.get("obstacle", ()):
        _vary_obstacle(obstacle, stretched, warp)
    return keys


def _vary_player(player: dict[str, Any], stretched: Mapping[str, float], warp: Warp, variation: RoadVariation) -> None:
    if "lane" in player:
        player.update(_on_edge(player, _edge_of(player["lane"]), stretched))
    if "goal" in player:
        player["goal"] = _on_edge(player["goal"], player["goal"]["edge"], stretched)
    if "route_m" in player:
        player["route_m"] = _times(player["route_m"], variation.length_share)
    if "way" in player:
        player["way"] = _warped(player["way"], warp)
    else:
        player["speed_mps"] = _times(player["speed_mps"], variation.limit_share)


def _vary_obstacle(obstacle: dict[str, Any], stretched: Mapping[str, float], warp: Warp) -> None:
    if "outline" in obstacle:
        obstacle["outline"] = _warped(obstacle["outline"], warp)
    elif "lane" in obstacle:
        obstacle.update(_on_edge(obstacle, _edge_of(obstacle["lane"]), stretched))
    else:
        x_m, y_m, heading = (float(np.mean(obstacle[name])) for name in ("x_m", "y_m", "heading_deg"))
        ((x, y),) = warp(np.array([[x_m, y_m]])).tolist()
        moved = {
            "x_m": x - x_m,
            "y_m": y - y_m,
            "heading_deg": degrees(warp.heading_of(x_m, y_m, radians(heading))) - heading,
        }
        for key, change in moved.items():
            obstacle[key] = _each(obstacle[key], lambda value, change=change: value + change)


def _edge_of(lane: str) -> str:
    return lane.rpartition("_")[0]


def _on_edge(place: dict[str, Any], edge: str, stretched: Mapping[str, float]) -> dict[str, Any]:
    """A table with a position along an edge, stretched as the edge."""
    if "position_m" not in place:
        return place
    return {**place, "position_m": _times(place["position_m"], stretched[edge])}


def _times(value: Any, factor: float) -> Any:
    return _each(value, lambda each: each * factor)


def _each(value: Any, change: Any) -> Any:
    """A number, or a range, with each number changed."""
    return [round(change(each), 2) for each in value] if isinstance(value, list) else round(change(value), 2)


def _warped(points: Sequence[Sequence[float]], warp: Warp) -> list[list[float]]:
    return [[round(x, 2), round(y, 2)] for x, y in warp(np.array(points, dtype=float)).tolist()]
