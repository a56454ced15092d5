"""Recorded games of a run folder as files of other programs."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from harness.campaign.results.read_run import episodes_of
from harness.campaign.results.replay_game import PlayedGame, games_of, played_game, read_game, traces_of
from harness.campaign.results.shown_work import progress_bar
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.people import judged, judged_outcomes
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import FAILURES, worst_first
from harness.export.exported_game import ExportedGame, exported_game
from harness.export.folder import Formats, check_export, write_games
from harness.road.scene.open_scene import open_scene


def export_game(run: Path, arm: str, episode: int, *, seed: int | None, folder: Path, formats: Formats) -> None:
    """Export one game. Raises UsageError if there is no such game or trace, or the folder can't be used."""
    check_export(folder, formats)
    game = played_game(run, arm, episode, seed)
    write_games(iter([_exported(game)]), game.scene, folder, formats, title=RunFolder(run).manifest()["name"])


def export_failures(
    run: Path, arm: str | None, *, seed: int | None, folder: Path, formats: Formats, console: Console
) -> int:
    """Export every game of an arm and seed (None: of all) in which the judged player fails, worst first; the number of
    games.

    Raises UsageError if there is none, its traces are missing, or the folder can't be used.
    """
    check_export(folder, formats)
    source = RunFolder(run)
    episodes = games_of(run, episodes_of(source), arm, seed)
    failures = worst_first(episodes[judged_outcomes(episodes).isin(FAILURES)])
    if failures.empty:
        remedy = "export a game: harness export RUN ARM EPISODE DIR"
        raise UsageError.of(run, arm or "", "has no failures", remedy)
    arms = failures.drop_duplicates(["arm", "seed"]).itertuples()
    traces = {(row.arm, row.seed): traces_of(source, row.arm, row.seed, row.episode) for row in arms}
    scene, reader = open_scene(source.scene), TraceReader()
    games = (_exported(read_game(row, traces[row.arm, row.seed], reader, scene)) for row in failures.itertuples())
    with progress_bar("exporting", console) as on_progress:
        return write_games(
            games,
            scene,
            folder,
            formats,
            title=source.manifest()["name"],
            on_game=lambda done: on_progress(done, len(failures)),
        )


def _exported(game: PlayedGame) -> ExportedGame:
    return exported_game(
        game.trace,
        game.scene,
        name=game.name,
        arm=game.record.arm,
        seed=game.record.seed,
        episode=game.record.episode,
        outcome=judged(game.record._asdict())[1],
    )
