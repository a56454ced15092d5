"""Find a recorded game in a run folder and show it in SUMO-GUI or as a film."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from harness.campaign.results.read_run import episodes_of
from harness.campaign.results.shown_work import progress_bar
from harness.campaign.storage.run_folder import RunFolder
from harness.config.toml_reading import nearest
from harness.errors import UsageError
from harness.evaluation.people import people_in
from harness.evaluation.rule_book.causes import causes_in_words
from harness.evaluation.tables import read_csv, rows_in_json
from harness.evaluation.trace_file import TraceReader
from harness.evaluation.worst_first import FAILURES, replay_name, worst_first
from harness.game.roles import role_in_words
from harness.replay import follow_in_sumo_gui, legend, names_in_pictures, write_film, write_replay
from harness.reports.text_table import add_text_row, text_table
from harness.road.scene.open_scene import OpenScene, open_scene

_OTHERS = "--page, --rows, --outcome and ARM choose others"
FAILURE = "failure"
"""Stands for every outcome that is a failure."""


@dataclass(frozen=True, kw_only=True)
class GameList:
    """Which games of a run to list: None leaves out a condition."""

    arm: str | None = None
    outcome: str | None = None
    """Of the ego; `failure` stands for every failure."""
    seed: int | None = None
    rows: int | None = None
    """The most games of a page of the list; None: all."""
    page: int = 1


def _listed(run: Path, chosen: GameList) -> tuple[pd.DataFrame, int, int]:
    """A page of the chosen games of a run, worst first, with the causes of failures in words; the number of games on
    all pages, and of pages. Raises UsageError where no game is of an arm, a seed or an outcome."""
    folder = RunFolder(run)
    ordered = worst_first(_chosen(run, episodes_of(folder), chosen))
    causes = causes_in_words(read_csv(folder.result("causes.csv")))
    rows = chosen.rows or max(len(ordered), 1)
    pages = max(-(-len(ordered) // rows), 1)
    if chosen.page > pages:
        raise UsageError.of("--page", str(chosen.page), "there is no such page", f"the last one is {pages}")
    games = ordered.iloc[(chosen.page - 1) * rows : chosen.page * rows]
    outcomes = [f"{name}_outcome" for name in ("ego", *people_in(games.columns))]
    found = [causes.get((game.arm, game.seed, game.episode), "") for game in games.itertuples()]
    games = games[["arm", "seed", "episode", *outcomes, "ego_min_ttc_s", "severity"]].assign(cause=found)
    return games, len(ordered), pages


def game_table(run: Path, chosen: GameList) -> Table:
    games, number, pages = _listed(run, chosen)
    players = ("ego", *people_in(games.columns))
    left = f"page {chosen.page} of {pages}, {number:,} games; {_OTHERS}; " if pages > 1 else ""
    columns = ("arm", "seed", "episode", *players, "cause", "TTC (s)", "severity")
    headings = [role_in_words(name) for name in columns]
    table = text_table(
        headings,
        whole={*headings} - {"arm", "cause"},
        title=f"Games of {run}, worst first",
        caption=f"{left}severity orders the games: docs/columns.md; to watch one: harness replay RUN ARM EPISODE",
        box=SIMPLE,
        padding=0,
        pad_edge=True,
    )
    for game in games.itertuples():
        ttc = "" if pd.isna(game.ego_min_ttc_s) else f"{game.ego_min_ttc_s:.1f}"
        severity = "" if math.isinf(game.severity) else f"{game.severity:.1f}"
        outcomes = [getattr(game, f"{name}_outcome") for name in players]
        add_text_row(table, game.arm, str(game.seed), str(game.episode), *outcomes, game.cause, ttc, severity)
    return table


def game_records(run: Path, chosen: GameList) -> dict[str, Any]:
    """The chosen games of a run, for JSON: a number that is not known is None."""
    games, number, pages = _listed(run, chosen)
    shown = {"page": chosen.page, "pages": pages, "number": number}
    return {"run": str(run), **shown, "games": rows_in_json(games)}


def _chosen(run: Path, episodes: pd.DataFrame, chosen: GameList) -> pd.DataFrame:
    """The games that fulfil the conditions. Raises UsageError where one is of no game."""
    episodes = games_of(run, episodes, chosen.arm, chosen.seed)
    if chosen.outcome is not None:
        known = sorted({*FAILURES, *episodes["ego_outcome"], FAILURE} - {""})
        if chosen.outcome not in known:
            raise UsageError.of(run, chosen.outcome, "is no outcome", nearest(chosen.outcome, known))
        wanted = FAILURES if chosen.outcome == FAILURE else (chosen.outcome,)
        episodes = episodes[episodes["ego_outcome"].isin(wanted)]
    return episodes


@dataclass(frozen=True, kw_only=True)
class PlayedGame:
    """A recorded game: its row of `episodes.csv`, its trace, and the scene that it was played on."""

    record: Any
    trace: pd.DataFrame
    scene: OpenScene

    @property
    def name(self) -> str:
        return replay_name(self.record.arm, self.record.seed, self.record.episode)

    @property
    def title(self) -> str:
        return f"{self.record.arm}, seed {self.record.seed}, episode {self.record.episode}"

    @property
    def names(self) -> Mapping[str, str]:
        """What players are called, by their names in the trace."""
        return names_in_pictures(self.record.persona)

    def write_replay(self, folder: Path) -> None:
        write_replay(self.trace, self.scene, folder, title=self.title, names=self.names)


def played_game(run: Path, arm: str, episode: int, seed: int | None) -> PlayedGame:
    """The game of an arm and episode; `seed` None is the first training seed.

    Raises UsageError if there is no such game, or it could not be played.
    """
    folder = RunFolder(run)
    record, traces = find_game(folder, arm, episode, seed)
    return read_game(record, traces, TraceReader(), open_scene(folder.scene))


def find_game(folder: RunFolder, arm: str, episode: int, seed: int | None) -> tuple[Any, Path]:
    """The row of `episodes.csv` of a game, and the file with its trace. Arguments and errors are those of
    `played_game`."""
    run = folder.path
    chosen_seed = folder.manifest()["seeds"][0] if seed is None else seed
    games = games_of(run, episodes_of(folder), arm, None)
    found = games[(games["episode"] == episode) & (games["seed"] == chosen_seed)]
    if found.empty:
        message = f"has no such game of seed {chosen_seed}"
        seeds = ", ".join(map(str, sorted(games["seed"].unique())))
        remedy = f"episodes are {games['episode'].min()} to {games['episode'].max()}, training seeds {seeds}"
        raise UsageError.of(run, f"{arm} {episode}", message, remedy)
    (record,) = found.itertuples()
    if record.error:
        raise UsageError.of(run, f"{arm} {episode}", f"could not be played: {record.error}", "choose another")
    return record, traces_of(folder, arm, chosen_seed, episode)


def read_game(record: Any, traces: Path, reader: TraceReader, scene: OpenScene) -> PlayedGame:
    """The game of a row of `episodes.csv`. Raises UsageError if its traces lack it."""
    return PlayedGame(record=record, trace=reader.read(traces, int(record.episode)), scene=scene)


def traces_of(folder: RunFolder, arm: str, seed: int, episode: int) -> Path:
    """The traces file of an arm and seed. Raises UsageError if the folder lacks it, which names the episode, and if it
    is not what the campaign wrote."""
    traces = folder.traces_of_arm(arm, seed)
    if not traces.is_file():
        raise UsageError.of(
            folder.path,
            f"{arm} {episode}",
            "was recorded, but this folder does not contain the traces",
            f"watch it in {folder.path / 'report.html'}, or run campaign {folder.manifest()['name']!r} again",
        )
    folder.check_games(arm, seed)
    return traces


@contextmanager
def replay_of(game: PlayedGame) -> Iterator[Path]:
    """A temporary replay folder, made from the trace. The folders under `replays/` are not opened here: a changed
    configuration there could make SUMO read and write any file."""
    with TemporaryDirectory(prefix="harness-replay-") as scratch:
        game.write_replay(Path(scratch) / game.name)
        yield Path(scratch) / game.name


def watch(game: PlayedGame, console: Console) -> None:
    """Show a game in SUMO-GUI until its user closes it. Raises UsageError if there is no screen."""
    with replay_of(game) as replay:
        message = (
            f"SUMO-GUI plays {replay} at half of real time and follows the ego ({legend(game.trace, game.names)}). It "
            "halts at a contact and at the end; the play button continues. This command ends when SUMO-GUI is closed."
        )
        follow_in_sumo_gui(replay, lambda: console.print(message, highlight=False, markup=False, soft_wrap=True))


def film(game: PlayedGame, file: Path, console: Console) -> None:
    """Write a game as a film, with a progress bar. Raises UsageError for a missing program."""
    with replay_of(game) as replay, progress_bar("filming", console) as on_progress:
        pictures = write_film(
            replay,
            game.trace,
            file,
            title=game.title,
            step_length_s=game.scene.world.step_s,
            names=game.names,
            on_progress=on_progress,
        )
    console.print(f"Wrote {file}: {pictures} pictures.", highlight=False, markup=False, soft_wrap=True)


def games_of(run: Path, episodes: pd.DataFrame, arm: str | None, seed: int | None) -> pd.DataFrame:
    """The rows of an arm and of a training seed; None is every one. Raises UsageError if there are none."""
    if arm is not None:
        arms = sorted(set(episodes["arm"]))
        if arm not in arms:
            raise UsageError.of(run, arm, "has no such arm", nearest(arm, arms))
        episodes = episodes[episodes["arm"] == arm]
    if seed is not None:
        seeds = sorted(set(episodes["seed"]))
        if seed not in seeds:
            raise UsageError.of(run, f"seed {seed}", "has no games", f"seeds are {', '.join(map(str, seeds))}")
        episodes = episodes[episodes["seed"] == seed]
    return episodes
