"""The commands for runs that have ended: `harness replay`, `export`, `runs`, `serve`, `compare` and `realism`."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote

import typer

from harness.cli import messages
from harness.cli.output import (
    AsJson,
    RunPath,
    RunSeed,
    console_of_any_encoding,
    output,
    print_json,
    print_plain,
    say_unchecked,
)
from harness.errors import UsageError
from harness.wording import counted

if TYPE_CHECKING:
    from rich.table import Table

    from harness.reports.human_ranges import HumanRow


def replay(
    run: RunPath,
    arm: Annotated[str | None, typer.Argument(metavar="ARM", help="The arm, such as naive_vs_speedy.")] = None,
    episode: Annotated[int | None, typer.Argument(metavar="EPISODE", help="The number of the episode.")] = None,
    seed: RunSeed = None,
    list_games: Annotated[bool, typer.Option("--list", help="List the recorded games, worst first.")] = False,
    outcome: Annotated[
        str | None,
        typer.Option(
            metavar="OUTCOME",
            help="List only games of this outcome of the ego: collision, rail, timeout, goal, or failure for the "
            "first three.",
        ),
    ] = None,
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="The most games to list.")] = 40,
    page: Annotated[int, typer.Option(min=1, metavar="N", help="Which N rows of the list to show.")] = 1,
    film_file: Annotated[
        Path | None,
        typer.Option(
            "--film", metavar="FILE", help="Write the game as a .gif or .mp4 film instead; this needs no screen."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Watch a recorded game in SUMO-GUI. Without ARM or EPISODE, list the recorded games."""
    with output(as_json) as console:
        from harness.campaign.results.replay_game import GameList, film, game_records, game_table, played_game, watch

        listing = list_games or arm is None or episode is None
        if film_file is not None and listing:
            raise UsageError.of(
                "--film", str(film_file), "shows one game", "name the game: harness replay RUN ARM EPISODE"
            )
        if as_json and not listing:
            raise UsageError.of("--json", "", "lists games", "leave out the episode, or add --list")
        say_unchecked(run, console)
        if arm is None or episode is None or list_games:
            chosen = GameList(arm=arm, outcome=outcome, seed=seed, rows=rows, page=page)
            if as_json:
                print_json(game_records(run, chosen))
            else:
                console.print(game_table(run, chosen))
            return
        game = played_game(run, arm, episode, seed)
        if film_file is None:
            watch(game, console)
        else:
            film(game, film_file, console)


def export(
    run: RunPath,
    rest: Annotated[
        list[str],
        typer.Argument(
            metavar="ARM EPISODE DIR",
            help="The arm, the number of the episode, and a new folder for the files. With --failures, ARM may be left "
            "out, and there is no EPISODE.",
        ),
    ],
    failures: Annotated[bool, typer.Option("--failures", help="Export every game that is a failure.")] = False,
    openscenario: Annotated[
        bool, typer.Option("--openscenario", help="Write OpenSCENARIO 1.2: a NAME.xosc for each game.")
    ] = False,
    opendrive: Annotated[
        bool, typer.Option("--opendrive", help="Write OpenDRIVE 1.4: the scene's net as scene.xodr.")
    ] = False,
    csv: Annotated[
        bool, typer.Option("--csv", help="Write tables in the layout of highD: NN_tracks.csv and two more.")
    ] = False,
    seed: Annotated[
        int | None, typer.Option(help="The training seed.  [default: the first of the campaign; with --failures, all]")
    ] = None,
) -> None:
    """Export recorded games for other programs. Without a format, OpenSCENARIO and OpenDRIVE are written.

    `harness export reports/demo naive_vs_paper_speedy 3 --openscenario --opendrive game` writes one game,
    `harness export reports/demo --failures failures` all failures.
    """
    from harness.campaign.results.export_games import export_failures, export_game
    from harness.export.folder import Formats

    if not (openscenario or opendrive or csv):
        openscenario = opendrive = True
    formats = Formats(openscenario=openscenario, opendrive=opendrive, csv=csv)
    console, folder = console_of_any_encoding(), Path(rest[-1])
    if failures:
        if len(rest) > 2:
            message, remedy = "is more than an arm and a new folder", "harness export RUN [ARM] --failures DIR"
            raise UsageError.of("--failures", " ".join(rest), message, remedy)
        arm = rest[0] if len(rest) == 2 else None
        count = export_failures(run, arm, seed=seed, folder=folder, formats=formats, console=console)
    else:
        if len(rest) != 3:
            remedy = "harness export RUN ARM EPISODE DIR, or harness export RUN --failures DIR"
            raise UsageError.of("harness export", " ".join(rest), "is not an arm, an episode and a new folder", remedy)
        export_game(run, rest[0], _episode(rest[1]), seed=seed, folder=folder, formats=formats)
        count = 1
    print_plain([f"Wrote {counted(count, 'game')} to {folder}: games.csv lists them"], console)


def _episode(text: str) -> int:
    if not (text.isascii() and text.isdecimal()):
        raise UsageError.of("EPISODE", text, "is not the number of an episode", "harness replay RUN --list shows them")
    return int(text)


def serve(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge, or a folder of run folders.")
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="The port; 0 takes a free one.")] = 8000,
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in the default browser.")] = False,
) -> None:
    """Show the report of a run with all of its recorded games, also those that its file has no room for.

    Of a folder of run folders, such as reports/: an index of all runs, those that are going on with the time left, each
    with its report, and comparisons of runs of one ego. The report of a run that is published as its tables is made
    from them, without games. The page is at http://127.0.0.1:8000 for this machine alone, until Ctrl-C.
    """
    import webbrowser

    from harness.campaign.results.served_report import server_of
    from harness.campaign.results.served_runs import served

    console = console_of_any_encoding()
    with console.status(messages.reading(run)):
        answer = served(run).answer
    try:
        server = server_of(answer, port)
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError.of("--port", str(port), f"can't be opened: {reason}", "another port, or 0") from error
    with server:
        address = f"http://127.0.0.1:{server.server_port}/"
        console.print(f"The report is at {address} until Ctrl-C.", highlight=False, soft_wrap=True)
        if open_browser:
            webbrowser.open(address)
        server.serve_forever()


def runs(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder that the run folders are in.")] = Path(
        "reports"
    ),
    search: Annotated[
        str, typer.Option(metavar="TEXT", help="Only runs whose name, ego, scene or a persona contains this text.")
    ] = "",
    as_json: AsJson = False,
) -> None:
    """List the runs in a folder, the latest first: how far each is, whether its bounds are kept, and the worst arms.

    `harness serve FOLDER` shows the same list as a page with a link to each report.
    """
    with output(as_json) as console:
        from harness.campaign.results.run_index import runs_in
        from harness.reports.index_page import record_of, terminal_table

        found = [run for run in runs_in(folder) if run.matches(search)]
        if as_json:
            print_json([record_of(run) for run in found])
        elif found:
            console.print(terminal_table(found))
            print_plain([f"The pages of the runs, and comparisons: harness serve {shlex.quote(str(folder))}"], console)
        else:
            print_plain([f"{folder}: there is no run" + (f" that contains {search!r}" if search else "")], console)


def compare(
    folders: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Two run folders or more, from the first to the last.")
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The page.  [default: compare.html in the last folder]")
    ] = None,
) -> None:
    """Compare runs in their order, each with the one before it, game by game.

    Failures, near misses, harm to others and speed of every arm that both have; the failures over all runs; and which
    of them were fixed, are new or came back.
    """
    from harness.campaign.results.compare_runs import compare_runs
    from harness.files import check_new_file, write_atomically
    from harness.reports import comparison_terminal as terminal
    from harness.reports.comparison_page import BETTER, WORSE

    console, page = console_of_any_encoding(), out or folders[-1] / "compare.html"
    check_new_file(page)
    comparison = compare_runs(folders, [_address(each, page) for each in folders])
    write_atomically(page, comparison.page().encode())
    for run in folders:
        say_unchecked(run, console)
    print_plain(terminal.run_lines(comparison), console)
    if comparison.histories:
        print_plain(["", "Failures"], console)
        console.print(terminal.history_table(comparison, console.width), highlight=False)
    for number, transition in enumerate(comparison.transitions, 1):
        print_plain(["", f"{number} to {number + 1}, {transition.after.label}: {transition.headline}"], console)
        changed = terminal.difference_table(transition.rows)
        if changed.row_count:
            console.print(changed, highlight=False)
        if left := len(transition.rows) - sum(row.verdict in (BETTER, WORSE) for row in transition.rows):
            print_plain([f"{left} figures are neither better nor worse: the page has them"], console)
        if transition.counts:
            print_plain(["Games that changed"], console)
            console.print(terminal.change_table(transition), highlight=False)
    print_plain([f"Comparison: {page}"], console)


def _address(run: Path, page: Path) -> str:
    """The address of a run's report on a page; empty without one."""
    report = run / "report.html"
    return (
        quote(Path(os.path.relpath(report.absolute(), page.absolute().parent)).as_posix()) if report.is_file() else ""
    )


def realism(run: RunPath, as_json: AsJson = False) -> None:
    """Compare how the egos and the people of a run drive with published figures of people.

    The median over a player's games, and the middle 90 % of them, beside the range of people: changes of lane, gaps,
    speed, braking, steering, red lights, and crashes per kilometre alone.
    """
    with output(as_json) as console:
        from harness.campaign.results.read_run import result_table
        from harness.campaign.storage.run_folder import RunFolder
        from harness.evaluation.tables import rows_in_json
        from harness.reports.human_ranges import comparable, headline, human_rows

        table = result_table(RunFolder(run), "realism")
        say_unchecked(run, console)
        if as_json:
            print_json(rows_in_json(table))
            return
        console.print(_beside_people(human_rows(table)))
        left = len(table) - len(comparable(table))
        more = f"Not comparable: {left} more figures; realism.csv in the run folder has them all, with their sources."
        print_plain([headline(table), *([more] if left else [])], console)


def _beside_people(rows: Sequence[HumanRow]) -> Table:
    from rich.box import SIMPLE

    from harness.reports.text_table import add_text_row, text_table

    headings = ("player", "figure", "games", "value (90 % of the games)", "people", "")
    table = text_table(headings, box=SIMPLE, pad_edge=True, padding=(0, 1, 0, 0), header_style="bold")
    last = ""
    for row in rows:
        player, last = "" if row.player == last else row.player, row.player
        words = (player, row.figure, str(row.games), row.measured, row.people, row.realistic)
        add_text_row(table, *words, style="red" if row.is_outside else None)
    return table
