"""Recorded games of a run folder as files of other programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.campaign.results.replay_game import episodes_of, games_of, played_game, traces_of
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.people import judged_outcomes
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import FAILURES, worst_first
from harness.export import ExportedGame, Formats, check_folder, check_formats, exported_game, write_games
from harness.replay import replay_name
from harness.road.scene.open_scene import OpenScene, open_scene


@dataclass(frozen=True, kw_only=True)
class ChosenFailures:
    """Which failures of a run to export: None stands for all arms, or seeds."""

    arm: str | None = None
    seed: int | None = None


def export_game(run: Path, arm: str, episode: int, *, seed: int | None, folder: Path, formats: Formats) -> None:
    """Export one game. Raises UsageError if there is no such game or trace, or the folder can't be used."""
    check_formats(formats)
    check_folder(folder)
    game = played_game(run, arm, episode, seed)
    exported = _exported(game.record, game.trace, game.scene)
    write_games(iter([exported]), game.scene, folder, formats, title=RunFolder(run).manifest()["name"])


def export_failures(run: Path, chosen: ChosenFailures, *, folder: Path, formats: Formats, console: Console) -> int:
    """Export every game in which the judged player fails, worst first; the number of games.

    Raises UsageError if there is none, its traces are missing, or the folder can't be used.
    """
    check_formats(formats)
    check_folder(folder)
    source = RunFolder(run)
    games = _failures(run, episodes_of(source), chosen)
    for (arm, seed), rows in games.groupby(["arm", "seed"], sort=False):
        traces_of(source, arm, int(seed), int(rows["episode"].iloc[0]))
    scene = open_scene(source.scene)
    columns = (TextColumn("exporting"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("exporting", total=len(games))
        return write_games(
            _each(source, games, scene),
            scene,
            folder,
            formats,
            title=source.manifest()["name"],
            on_game=lambda done: bar.update(task, completed=done),
        )


def _failures(run: Path, episodes: pd.DataFrame, chosen: ChosenFailures) -> pd.DataFrame:
    """The rows of the failures, worst first."""
    episodes = games_of(run, episodes, chosen.arm, chosen.seed)
    failures = episodes[judged_outcomes(episodes).isin(FAILURES)]
    if failures.empty:
        raise UsageError.of(
            run, chosen.arm or "", "has no failures", "export a game: harness export RUN ARM EPISODE DIR"
        )
    return worst_first(failures)


def _each(source: RunFolder, games: pd.DataFrame, scene: OpenScene) -> Iterator[ExportedGame]:
    reader = TraceReader()
    for row in games.index:
        game = games.loc[[row]]
        arm, seed, episode = game["arm"].iloc[0], int(game["seed"].iloc[0]), int(game["episode"].iloc[0])
        traces = traces_of(source, arm, seed, episode)
        trace = reader.read(traces, episode)
        if trace.empty:
            raise UsageError.of(traces, "", f"has no trace of episode {episode}", "run the campaign again")
        yield _exported(game, trace, scene)


def _exported(game: pd.DataFrame, trace: pd.DataFrame, scene: OpenScene) -> ExportedGame:
    """A game from its row of `episodes.csv`."""
    arm, seed, episode = game["arm"].iloc[0], int(game["seed"].iloc[0]), int(game["episode"].iloc[0])
    return exported_game(
        trace,
        scene,
        name=replay_name(arm, seed, episode),
        arm=arm,
        seed=seed,
        episode=episode,
        outcome=str(judged_outcomes(game).iloc[0]),
    )
