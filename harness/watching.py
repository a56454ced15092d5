"""Finding a recorded game in a run folder and opening it in SUMO-GUI."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import pandas as pd
from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from harness.documents.reading import nearest
from harness.errors import UsageError
from harness.replay import open_in_sumo_gui, replay_name, worst_first, write_replay
from harness.rounds import stage_id
from harness.run_folder import RunFolder
from harness.tables import read_csv
from harness.trace_file import read_trace
from harness.traffic.opening import open_scene


def game_table(run: Path, arm: str | None) -> Table:
    """The games of a run, or of one arm of it, worst first."""
    episodes = _episodes(RunFolder(run))
    if arm is not None:
        episodes = _of_arm(run, episodes, arm)
    table = Table(
        title=Text(f"Games of {run}, worst first"),
        title_justify="left",
        caption="watch one: harness replay RUN ARM EPISODE",
        box=SIMPLE,
        padding=0,
    )
    for name in ("arm", "seed", "episode", "ego", "non-ego", "least TTC (s)", "duration (s)"):
        table.add_column(name, overflow="fold", no_wrap=name == "arm")
    for game in worst_first(episodes).itertuples():
        seconds = ("" if pd.isna(value) else f"{value:.1f}" for value in (game.ego_min_ttc_s, game.duration_s))
        table.add_row(game.arm, str(game.seed), str(game.episode), game.ego_outcome, game.non_ego_outcome, *seconds)
    return table


def watch(run: Path, arm: str, episode: int, seed: int | None) -> tuple[Path, subprocess.Popen[bytes]]:
    """Open a game in SUMO-GUI; one that has no replay folder yet gets one from its trace.

    Raises UsageError if there is no such game, it could not be played, or there is no screen.
    """
    folder = RunFolder(run)
    chosen_seed = folder.manifest()["seeds"][0] if seed is None else seed
    games = _of_arm(run, _episodes(folder), arm)
    found = games[(games["episode"] == episode) & (games["seed"] == chosen_seed)]
    if found.empty:
        raise UsageError.of(
            run,
            f"{arm} {episode}",
            f"has no such game of seed {chosen_seed}",
            f"episodes go from {games['episode'].min()} to {games['episode'].max()}",
        )
    if found.iloc[0]["error"]:
        raise UsageError.of(run, f"{arm} {episode}", f"could not be played: {found.iloc[0]['error']}", "choose another")
    replay = folder.replays / replay_name(arm, chosen_seed, episode)
    if not replay.is_dir():
        replay = Path(tempfile.mkdtemp(prefix="harness-replay-")) / replay.name
        scene = open_scene(folder.scene)
        write_replay(
            read_trace(folder.traces(stage_id(arm, chosen_seed)), episode),
            scene.net_file,
            scene.routes.path,
            replay,
            title=f"{arm}, seed {chosen_seed}, episode {episode}",
            step_length_s=scene.world.step_s,
            rails=scene.rail_lines,
        )
    return replay, open_in_sumo_gui(replay)


def _episodes(folder: RunFolder) -> pd.DataFrame:
    folder.manifest()
    return read_csv(folder.path / "episodes.csv")


def _of_arm(run: Path, episodes: pd.DataFrame, arm: str) -> pd.DataFrame:
    arms = sorted(set(episodes["arm"]))
    if arm not in arms:
        raise UsageError.of(run, arm, "has no such arm", nearest(arm, arms or ["(no arm is done yet)"]))
    return episodes[episodes["arm"] == arm]
