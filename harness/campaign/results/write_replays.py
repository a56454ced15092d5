"""Writing the replays of a run: games to open in SUMO-GUI, those to watch first."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import track

from harness.campaign.plan.stages import stage_id
from harness.campaign.results.shown_work import say
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import worst_first
from harness.replay import choose_games, names_in_pictures, replay_name, write_replay
from harness.road.scene.open_scene import OpenScene

WRITING_REPLAYS = "writing replays"


def write_replays(folder: RunFolder, scene: OpenScene, episodes: pd.DataFrame, console: Console) -> list[str]:
    chosen = worst_first(choose_games(episodes))
    folder.replays.mkdir(exist_ok=True)
    names = [replay_name(game.arm, game.seed, game.episode) for game in chosen.itertuples()]
    games = list(zip(chosen.itertuples(), names, strict=True))
    reader = TraceReader()
    say(console, WRITING_REPLAYS)
    for game, name in track(games, WRITING_REPLAYS, console=console, transient=True, disable=not console.is_terminal):
        write_replay(
            reader.read(folder.traces(stage_id(game.arm, game.seed)), game.episode),
            scene.net_file,
            scene.route_files,
            folder.replays / name,
            title=f"{game.arm}, seed {game.seed}, episode {game.episode}",
            step_length_s=scene.world.step_s,
            names=names_in_pictures(game.persona),
            rails=scene.rail_lines,
            obstacles=scene.obstacles,
            stripes=scene.stripes,
        )
    _drop_stale(folder.replays, set(names))
    return names


def _drop_stale(replays: Path, names: set[str]) -> None:
    for old in replays.iterdir():
        if old.is_dir() and old.name not in names:
            shutil.rmtree(old)
