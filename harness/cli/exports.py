"""`harness export`: recorded games as files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli import wording
from harness.errors import UsageError


def export(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge.", show_default=False)
    ],
    rest: Annotated[
        list[str],
        typer.Argument(
            metavar="ARM EPISODE DIR",
            help="The arm, the number of the episode, and a new folder for the files. With --failures, ARM may be left "
            "out, and there is no EPISODE.",
            show_default=False,
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
        int | None,
        typer.Option(
            help="The training seed.  [default: the first of the campaign; with --failures, all]", show_default=False
        ),
    ] = None,
) -> None:
    """Export recorded games for other programs. Without a format, OpenSCENARIO and OpenDRIVE are written.

    `harness export reports/merge naive_vs_speedy 3 --openscenario --opendrive game` writes one game,
    `harness export reports/merge --failures failures` all failures.
    """
    from rich.console import Console

    from harness.campaign.results.export_games import Failures, export_failures, export_game
    from harness.export import Formats

    if not (openscenario or opendrive or csv):
        openscenario = opendrive = True
    formats = Formats(openscenario=openscenario, opendrive=opendrive, csv=csv)
    console, folder = Console(), Path(rest[-1])
    if failures:
        if len(rest) > 2:
            raise UsageError.of("--failures", " ".join(rest), *wording.EXPORT_FAILURES)
        chosen = Failures(arm=rest[0] if len(rest) == 2 else None, seed=seed)
        count = export_failures(run, chosen, folder, formats, console)
    else:
        if len(rest) != 3:
            raise UsageError.of("harness export", " ".join(rest), *wording.EXPORT_A_GAME)
        export_game(run, rest[0], _episode(rest[1]), seed, folder, formats)
        count = 1
    console.print(wording.exported(count, folder), highlight=False, markup=False, soft_wrap=True)


def _episode(text: str) -> int:
    if not (text.isascii() and text.isdecimal()):
        raise UsageError.of("EPISODE", text, *wording.NO_EPISODE)
    return int(text)
