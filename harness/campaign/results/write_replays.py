"""Writing the replays of a run: games to open in SUMO-GUI, those to watch first."""

from __future__ import annotations

import shutil

import pandas as pd
from rich.console import Console
from rich.progress import track

from harness.campaign.results.replay_game import read_game
from harness.campaign.results.shown_work import say
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import worst_first
from harness.replay import choose_games
from harness.road.scene.open_scene import OpenScene

WRITING_REPLAYS = "writing replays"


def write_replays(folder: RunFolder, scene: OpenScene, episodes: pd.DataFrame, console: Console) -> list[str]:
    """Write the replays of the games to watch first, remove all others, and return their names."""
    folder.replays.mkdir(exist_ok=True)
    names, reader = [], TraceReader()
    say(console, WRITING_REPLAYS)
    chosen = list(worst_first(choose_games(episodes)).itertuples())
    for row in track(chosen, WRITING_REPLAYS, console=console, transient=True, disable=not console.is_terminal):
        game = read_game(row, folder.traces_of_arm(row.arm, row.seed), reader, scene)
        game.write_replay(folder.replays / game.name)
        names.append(game.name)
    for old in folder.replays.iterdir():
        if old.is_dir() and old.name not in names:
            shutil.rmtree(old)
    return names
