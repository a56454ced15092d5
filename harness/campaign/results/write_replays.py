"""Writing the replays of a run: the games to watch first, each as a folder that SUMO-GUI opens."""

from __future__ import annotations

import shutil

import pandas as pd
from rich.console import Console

from harness.campaign.results.replay_game import read_game
from harness.campaign.results.shown_work import progress_bar, say
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import choose_games, worst_first
from harness.road.scene.open_scene import OpenScene

WRITING_REPLAYS = "writing replays"


def write_replays(folder: RunFolder, scene: OpenScene, episodes: pd.DataFrame, console: Console) -> list[str]:
    """Write the replays of the games to watch first, remove all others, and return their names."""
    folder.replays.mkdir(exist_ok=True)
    names, reader = [], TraceReader()
    say(console, WRITING_REPLAYS)
    chosen = worst_first(choose_games(episodes))
    with progress_bar(WRITING_REPLAYS, console) as on_progress:
        for done, row in enumerate(chosen.itertuples(), start=1):
            game = read_game(row, folder.traces_of_arm(row.arm, row.seed), reader, scene)
            game.write_replay(folder.replays / game.name)
            names.append(game.name)
            on_progress(done, len(chosen))
    for old in folder.replays.iterdir():
        if old.is_dir() and old.name not in names:
            shutil.rmtree(old)
    return names
