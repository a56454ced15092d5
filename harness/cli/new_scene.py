"""`harness scene new`: from a map to scenes and campaigns that run as they are."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import messages
from harness.cli.output import console_of_any_encoding, print_plain
from harness.errors import FAILED, UsageError, plain

if TYPE_CHECKING:
    from rich.console import Console

    from harness.maps.game_plans import GamePlan
    from harness.maps.open_map import OpenMap

_ROWS = 40


def new_scene(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The name of the scene and of its campaign.")],
    source: Annotated[
        Path,
        typer.Option(
            "--from",
            metavar="FILE",
            help="A map: .net.xml of SUMO, .osm of OpenStreetMap or .xodr of OpenDRIVE; each may be compressed (.gz).",
        ),
    ],
    conflict: Annotated[
        int | None,
        typer.Option(
            metavar="K",
            help="Make the scene of this conflict.  [default: the first one without traffic lights, if there is one]",
        ),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Make a scene of each conflict that is listed: NAME_1, NAME_2 and so on.")
    ] = False,
    only_list: Annotated[bool, typer.Option("--list", help="List the conflicts, and make no scene.")] = False,
    kind: Annotated[str | None, typer.Option(metavar="KIND", help="Only conflicts of this kind.")] = None,
    near: Annotated[
        str | None, typer.Option(metavar="EDGE", help="Only conflicts at junctions near this edge.")
    ] = None,
    within: Annotated[float, typer.Option(min=0.0, metavar="M", help="Distance in metres that is near.")] = 100.0,
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="Most conflicts to list.")] = _ROWS,
    left_hand: Annotated[
        bool, typer.Option("--left-hand", help="Traffic in the OpenStreetMap file keeps to the left.")
    ] = False,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write a page that draws the map with the conflicts.")
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder that gets networks/NAME and campaigns/NAME.toml.")
    ] = Path(),
) -> None:
    """Make scenes from a map: the places where the ways of two road users cross or merge, found in its right of way.

    Lists these conflicts with their numbers, and writes a scene of one of them, or of each: the net, the players'
    routes, starts from which they meet, goals, and a campaign.
    """
    from harness.cli.scene_writing import check_new
    from harness.maps.open_map import open_map

    if conflict is not None and every:
        raise UsageError.of("harness scene new", "--all", "--conflict and --all exclude each other", "give one of them")
    if not only_list:
        check_new(name, [] if every else [name], out)
    console = console_of_any_encoding()
    with tempfile.TemporaryDirectory(prefix="harness-map-") as folder:
        with console.status(messages.reading(source)):
            opened = open_map(source, Path(folder), left_hand=left_hand)
        plans = _wanted(opened, kind, near, within)
        chosen = {name: _numbered(opened, conflict, plans)}
        if every:
            chosen = {f"{name}_{plan.number}": plan for plan in plans}
            check_new(name, [] if only_list else list(chosen), out)
        _show(opened, plans[:rows], console)
        if len(plans) > rows:
            print_plain([messages.rows_left_out(len(plans) - rows, "conflicts")], console)
        if html is not None:
            _write_page(opened, plans, html)
            print_plain([f"Page: {html}"], console)
        if not only_list:
            _write(opened, chosen, out, console)


def _wanted(opened: OpenMap, kind: str | None, near: str | None, within_m: float) -> list[GamePlan]:
    plans = opened.near(near, within_m)
    if near is not None and not plans:
        raise UsageError.of("--near", near, "there is no conflict near this edge", "give a larger --within")
    if kind is None:
        return plans
    kinds = list(dict.fromkeys(plan.candidate.kind.value for plan in plans))
    if kind not in kinds:
        raise UsageError.of("--kind", kind, "is no kind of conflict of this map", f"its kinds are {', '.join(kinds)}")
    return [plan for plan in plans if plan.candidate.kind.value == kind]


def _numbered(opened: OpenMap, number: int | None, plans: Sequence[GamePlan]) -> GamePlan:
    """The plan of a number; without one, the first of `plans` without signals, which take long to learn, if any."""
    if number is None:
        return next((plan for plan in plans if not plan.candidate.with_signals), plans[0])
    if not 1 <= number <= len(opened.plans):
        remedy = f"choose one from 1 to {len(opened.plans)}: --list lists them"
        raise UsageError.of("--conflict", str(number), "there is no conflict of this number", remedy)
    return opened.plans[number - 1]


def _show(opened: OpenMap, plans: Sequence[GamePlan], console: Console) -> None:
    from harness.cli.net_tables import plan_table

    console.print(plan_table([(plan, opened.place_of(plan)) for plan in plans]), highlight=False)
    counts = Counter(plan.candidate.kind.value for plan in opened.plans)
    print_plain(["in all: " + ", ".join(f"{count} {kind}" for kind, count in counts.items())], console)
    print_plain([f"left out: {count} ({reason})" for reason, count in sorted(opened.left_out.items())], console)


def _write_page(opened: OpenMap, plans: Sequence[GamePlan], file: Path) -> None:
    from harness.cli.net_drawing import drawing_of
    from harness.cli.net_tables import plan_priority
    from harness.reports.net_page import write_net_page

    places = []
    for plan in plans:
        text = f"{plan.candidate.kind.value}, {opened.place_of(plan)}; priority: {plan_priority(plan)}"
        places.append((plan.number, plan.candidate.place, text))
    write_net_page(drawing_of(opened.source.name, *opened.listed(), places), file)


def _write(opened: OpenMap, chosen: dict[str, GamePlan], out: Path, console: Console) -> None:
    from harness.cli.scene_writing import files_of, write_scenes

    with console.status("making and checking scenes"):
        written, problems = write_scenes(opened, chosen, out)
    for each in written:
        (scene, campaign), plan = files_of(each, out), chosen[each]
        print_plain([f"conflict {plan.number}, {plain(opened.place_of(plan))}: wrote {scene} and {campaign}"], console)
    print_plain([str(problem) for problem in problems], console)
    print_plain([f"Next: harness campaign {files_of(written[0], out)[1]} --quick"], console)
    if problems:
        raise typer.Exit(FAILED)
