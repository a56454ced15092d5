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
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from harness.campaign.plan.stages import stage_id
from harness.campaign.storage.run_folder import RunFolder
from harness.config.toml_reading import nearest
from harness.errors import UsageError, plain
from harness.evaluation.people import people_in
from harness.evaluation.rule_book.cause_lines import causes_in_words
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import read_trace
from harness.evaluation.worst_first import FAILURES, worst_first
from harness.replay import follow_in_sumo_gui, names_in_pictures, replay_name, write_film, write_replay
from harness.replay.vehicles import legend
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


@dataclass(frozen=True, kw_only=True)
class ListedGames:
    """Games of a run, worst first: a page of them."""

    games: pd.DataFrame
    """Of episodes.csv: arm, seed, episode, an outcome per player, ego_min_ttc_s and severity; and the cause of a
    failure in words."""
    players: tuple[str, ...]
    number: int
    """Of the games on all pages."""
    pages: int


def listed_games(run: Path, chosen: GameList) -> ListedGames:
    """The chosen games of a run. Raises UsageError where no game is of an arm, a seed or an outcome."""
    folder = RunFolder(run)
    episodes = episodes_of(folder)
    causes = causes_in_words(read_csv(folder.path / "causes.csv"))
    episodes = _chosen(run, episodes, chosen)
    ordered = worst_first(episodes)
    games, pages = _page(ordered, chosen)
    players = ("ego", *people_in(episodes.columns))
    columns = ["arm", "seed", "episode", *(f"{name}_outcome" for name in players), "ego_min_ttc_s", "severity"]
    found = [causes.get((game.arm, game.seed, game.episode), "") for game in games.itertuples()]
    return ListedGames(
        games=games[columns].assign(cause=found),
        players=players,
        number=len(ordered),
        pages=pages,
    )


def game_table(run: Path, chosen: GameList) -> Table:
    """The chosen games of a run, for the terminal."""
    listed = listed_games(run, chosen)
    left = f"page {chosen.page} of {listed.pages}, {listed.number:,} games; {_OTHERS}; " if listed.pages > 1 else ""
    table = Table(
        title=Text(f"Games of {run}, worst first"),
        title_justify="left",
        caption=Text(f"{left}to watch one: harness replay RUN ARM EPISODE"),
        box=SIMPLE,
        padding=0,
    )
    for name in ("arm", "seed", "episode", *listed.players, "cause", "TTC (s)", "severity"):
        heading = name.replace("non_ego", "non-ego").replace("_", " ")
        table.add_column(heading, overflow="fold", no_wrap=name in ("arm", *listed.players))
    for game in listed.games.itertuples():
        ttc = "" if pd.isna(game.ego_min_ttc_s) else f"{game.ego_min_ttc_s:.1f}"
        severity = "" if math.isinf(game.severity) else f"{game.severity:.1f}"
        outcomes = [getattr(game, f"{name}_outcome") for name in listed.players]
        words = (game.arm, str(game.seed), str(game.episode), *outcomes, game.cause, ttc, severity)
        table.add_row(*(Text(plain(cell)) for cell in words))  # text without markup, whatever the table contains
    return table


def game_records(run: Path, chosen: GameList) -> dict[str, Any]:
    """The chosen games of a run, for JSON: a number that is not known is None."""
    listed = listed_games(run, chosen)
    known = listed.games.astype(object).where(listed.games.notna() & ~listed.games.isin([math.inf, -math.inf]), None)
    shown = {"page": chosen.page, "pages": listed.pages, "number": listed.number}
    return {"run": str(run), **shown, "games": known.to_dict("records")}


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


def _page(games: pd.DataFrame, chosen: GameList) -> tuple[pd.DataFrame, int]:
    """The games of the page, and the number of pages."""
    rows = chosen.rows or max(len(games), 1)
    first = (chosen.page - 1) * rows
    return games.iloc[first : first + rows], max(-(-len(games) // rows), 1)


@dataclass(frozen=True, kw_only=True)
class FoundGame:
    """A recorded game with its replay folder."""

    replay: Path
    trace: pd.DataFrame
    title: str
    names: Mapping[str, str]
    """What players are called, by their names in the trace."""
    step_length_s: float


@dataclass(frozen=True, kw_only=True)
class PlayedGame:
    """A recorded game: its trace, and the scene that it was played on."""

    name: str
    title: str
    record: pd.DataFrame
    """Its row of `episodes.csv`."""
    trace: pd.DataFrame
    scene: OpenScene


def played_game(run: Path, arm: str, episode: int, seed: int | None) -> PlayedGame:
    """The game of an arm and episode; `seed` None is the first training seed.

    Raises UsageError if there is no such game, or it could not be played.
    """
    folder = RunFolder(run)
    chosen_seed = folder.manifest()["seeds"][0] if seed is None else seed
    games = games_of_arm(run, episodes_of(folder), arm)
    found = games[(games["episode"] == episode) & (games["seed"] == chosen_seed)]
    if found.empty:
        raise UsageError.of(
            run,
            f"{arm} {episode}",
            f"has no such game of seed {chosen_seed}",
            f"episodes are {games['episode'].min()} to {games['episode'].max()}",
        )
    if found.iloc[0]["error"]:
        raise UsageError.of(run, f"{arm} {episode}", f"could not be played: {found.iloc[0]['error']}", "choose another")
    traces = traces_of(folder, arm, chosen_seed, episode)
    scene = open_scene(folder.scene)
    trace = read_trace(traces, episode)
    if trace.empty:
        raise UsageError.of(traces, "", f"has no trace of episode {episode}", "run the campaign again")
    return PlayedGame(
        name=replay_name(arm, chosen_seed, episode),
        title=f"{arm}, seed {chosen_seed}, episode {episode}",
        record=found,
        trace=trace,
        scene=scene,
    )


def traces_of(folder: RunFolder, arm: str, seed: int, episode: int) -> Path:
    """The traces file of an arm and seed. Raises UsageError, which names the episode, if the folder lacks it."""
    traces = folder.traces(stage_id(arm, seed))
    if not traces.is_file():
        raise UsageError.of(
            folder.path,
            f"{arm} {episode}",
            "was recorded, but this folder does not contain the traces",
            f"watch it in {folder.path / 'report.html'}, or run campaign {folder.manifest()['name']!r} again",
        )
    return traces


@contextmanager
def found_game(run: Path, arm: str, episode: int, seed: int | None) -> Iterator[FoundGame]:
    """A game with a temporary replay folder, made from its trace. The folders under `replays/` are not opened here: a
    changed configuration there could make SUMO read and write any file.

    Raises UsageError if there is no such game, or it could not be played.
    """
    game = played_game(run, arm, episode, seed)
    scene, names = game.scene, names_in_pictures(game.record.iloc[0]["persona"])
    with TemporaryDirectory(prefix="harness-replay-") as scratch:
        replay = Path(scratch) / game.name
        write_replay(
            game.trace,
            scene.net_file,
            scene.route_files,
            replay,
            title=game.title,
            step_length_s=scene.world.step_s,
            names=names,
            rails=scene.rail_lines,
            obstacles=scene.obstacles,
            stripes=scene.stripes,
        )
        yield FoundGame(
            replay=replay, trace=game.trace, title=game.title, names=names, step_length_s=scene.world.step_s
        )


def watch(game: FoundGame, console: Console) -> None:
    """Show a game in SUMO-GUI until its user closes it. Raises UsageError if there is no screen or no SUMO-GUI."""
    message = (
        f"SUMO-GUI plays {game.replay} at half of real time and follows the ego ({legend(game.trace, game.names)}). It "
        "halts at a contact and at the end; the play button continues. This command ends when SUMO-GUI is closed."
    )
    follow_in_sumo_gui(game.replay, lambda: console.print(message, highlight=False, markup=False, soft_wrap=True))


def film(game: FoundGame, file: Path, console: Console) -> None:
    """Write a game as a film, with a progress bar. Raises UsageError for a missing program."""
    columns = (TextColumn("filming"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("filming", total=None)
        pictures = write_film(
            game.replay,
            game.trace,
            file,
            title=game.title,
            step_length_s=game.step_length_s,
            names=game.names,
            on_progress=lambda done, total: bar.update(task, completed=done, total=total),
        )
    console.print(f"Wrote {file}: {pictures} pictures.", highlight=False, markup=False, soft_wrap=True)


def episodes_of(folder: RunFolder) -> pd.DataFrame:
    """The rows of `episodes.csv`. Raises UsageError unless the folder is one of a run."""
    folder.manifest()
    return read_csv(folder.path / "episodes.csv")


def games_of(run: Path, episodes: pd.DataFrame, arm: str | None, seed: int | None) -> pd.DataFrame:
    """The rows of an arm and of a training seed; None is every one. Raises UsageError if there are none."""
    if arm is not None:
        episodes = games_of_arm(run, episodes, arm)
    if seed is not None:
        seeds = sorted(set(episodes["seed"]))
        if seed not in seeds:
            raise UsageError.of(run, f"seed {seed}", "has no games", f"seeds are {', '.join(map(str, seeds))}")
        episodes = episodes[episodes["seed"] == seed]
    return episodes


def games_of_arm(run: Path, episodes: pd.DataFrame, arm: str) -> pd.DataFrame:
    """The rows of an arm. Raises UsageError if there is none."""
    arms = sorted(set(episodes["arm"]))
    if arm not in arms:
        raise UsageError.of(run, arm, "has no such arm", nearest(arm, arms or ["(no arm is done yet)"]))
    return episodes[episodes["arm"] == arm]
