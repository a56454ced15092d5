"""The commands for scenes and nets: make scenes of a map, show what lanes there are, and check a scene."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import messages
from harness.cli.output import console_of_any_encoding, print_plain
from harness.errors import FAILED, UsageError, plain
from harness.shipped_documents import document_at

if TYPE_CHECKING:
    from rich.console import Console

    from harness.maps.game_plans import GamePlan
    from harness.maps.open_map import OpenMap

_MOST_TRIED = 10  # conflicts, until one is in order

scene_app = typer.Typer(no_args_is_help=True, help="Make scenes from maps, and show nets and scenes.")


@scene_app.command("show")
def show_scene(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="NET_OR_SCENE",
            help="A .net.xml or .net.xml.gz, a scene.toml or its folder, or the name of a shipped scene.",
        ),
    ],
    near: Annotated[
        str | None, typer.Option(metavar="EDGE", help="Only lanes near this edge, the nearest first.")
    ] = None,
    within: Annotated[float, typer.Option(min=0.0, metavar="M", help="Distance in metres that is near.")] = 100.0,
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="Most lanes to list.")] = 100,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Also write a page that draws the net to scale and opens offline."),
    ] = None,
) -> None:
    """List the lanes of a net: id, length, speed limit, permissions, the junctions at both ends, and the edges to which
    each lane leads: straight on (s), to the right (r, R), to the left (l, L) or back (t). A second table lists the
    conflicts at the junctions: which connections cross or merge, and which of them has priority.

    The page shows junctions, signals and the numbers of conflicts, too, and for a scene the players' routes, starts and
    goals.
    """
    from harness.cli.net_views import conflict_table, conflict_words, lane_table
    from harness.maps.candidates import listed_conflicts
    from harness.road.net.net_file import check_net
    from harness.road.net.net_listing import edges_within
    from harness.road.net.network import nodes_of, read_net
    from harness.road.scene.open_scene import open_scene

    path = document_at(path, "networks")
    folder = folder_of_scene(path)
    scene = open_scene(folder) if folder is not None else None
    net_file = scene.net_file if scene is not None else path
    warnings = scene.warnings if scene is not None else check_net(net_file).warnings
    net = read_net(net_file)
    edges = edges_within(net, net_file, near, within)
    lanes = [lane for edge in edges for lane in edge.getLanes()]
    conflicts = listed_conflicts(net, [node.getID() for node in nodes_of(edges)])
    console = console_of_any_encoding()
    console.print(lane_table(lanes[:rows]), markup=False, highlight=False)
    if conflicts:
        console.print()
        console.print(conflict_table(conflicts[:rows]), markup=False, highlight=False)
    for what, count in (("lanes", len(lanes)), ("conflicts", len(conflicts))):
        if count > rows:
            print_plain([messages.rows_left_out(count - rows, what)], console)
    print_plain(warnings, console)
    if html is not None:
        from harness.cli.net_views import drawing_of
        from harness.reports.net_page import write_net_page

        title = scene.document.name if scene is not None else path.name
        places = ((k, each.place, conflict_words(each)) for k, each in enumerate(conflicts, start=1))
        write_net_page(drawing_of(title, edges, places, scene), html)
        print_plain([f"Page: {html}"], console)


def check_scene(folder: Path) -> list[str]:
    """Check one scene as a campaign that names it does, and drive its routes. Returns the lines to print.

    Raises UsageError with every problem.
    """
    from harness.assessment.route_trial import try_routes
    from harness.road.scene.load_check import check_loads
    from harness.road.scene.open_scene import open_scene

    scene = open_scene(folder)
    check_loads(scene)
    trials = try_routes(scene)
    found = [f"warning: {trial.sentence()}" for trial in trials if trial.failure]
    return [f"{folder} is in order.", *messages.scene_lines(scene), *scene.warnings, *found]


def folder_of_scene(path: Path) -> Path | None:
    """The folder of a scene that a path names: the folder itself, or the one of its scene.toml; None for others."""
    from harness.config.scene import SCENE_FILE

    if path.name == SCENE_FILE:
        return path.parent
    return path if path.is_dir() else None


@scene_app.command("new")
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
            help="Make the scene of this conflict.  [default: the first one that a rule-based driver can drive]",
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
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="Most conflicts to list.")] = 40,
    left_hand: Annotated[
        bool, typer.Option("--left-hand", help="Traffic in the OpenStreetMap file keeps to the left.")
    ] = False,
    routes: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The map's own traffic: a .rou.xml, whose routes are cut to the scene's net."
        ),
    ] = None,
    whole_net: Annotated[
        bool, typer.Option("--whole-net", help="Scenes get the whole net and traffic, not the part near the players.")
    ] = False,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write a page that draws the map with the conflicts.")
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder that gets networks/NAME and campaigns/NAME.toml.")
    ] = Path(),
) -> None:
    """Make scenes from a map: the places where the ways of two road users cross or merge, found in its right of way.

    Lists these conflicts with their numbers, the best question first, and writes a scene of one of them, or of each:
    the net, the players' routes, starts from which they meet, goals, and a campaign. A rule-based driver first drives
    both routes alone; a conflict with a route that it can't drive makes no scene.
    """
    from harness.cli.scene_writing import check_new
    from harness.maps.open_map import open_map

    if conflict is not None and every:
        raise UsageError.of("harness scene new", "--all", "--conflict and --all exclude each other", "give one of them")
    if not only_list:
        check_new(name, [] if every else [name], out)
    console = console_of_any_encoding()
    with tempfile.TemporaryDirectory(prefix="harness-map-") as folder:
        with console.status(messages.reading(source)) as status:
            opened = open_map(
                source,
                Path(folder),
                left_hand=left_hand,
                routes=routes,
                whole_net=whole_net,
                show=status.update,
            )
        plans = _wanted(opened, kind, near, within)
        chosen = {name: plans[:_MOST_TRIED] if conflict is None else [_numbered(opened, conflict)]}
        if every:
            chosen = {f"{name}_{plan.number}": [plan] for plan in plans}
            check_new(name, [] if only_list else list(chosen), out)
        _show(opened, plans[:rows], console)
        if len(plans) > rows:
            print_plain([messages.rows_left_out(len(plans) - rows, "conflicts")], console)
        if html is not None:
            _write_page(opened, plans, html)
            print_plain([f"Page: {html}"], console)
        if not only_list:
            _write(opened, chosen, out, console)


@scene_app.command("vary")
def vary_scene(
    path: Annotated[
        Path, typer.Argument(metavar="SCENE", help="A scene's folder or scene.toml, or the name of a shipped scene.")
    ],
    roads: Annotated[int, typer.Option(min=1, max=1000, metavar="N", help="Number of roads.")] = 10,
    seed: Annotated[
        int, typer.Option(min=0, metavar="K", help="Seed of the first road; the others have the seeds after it.")
    ] = 1,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder that gets a scene for each road.")] = Path(),
) -> None:
    """Make variants of a scene on other roads: is an ego that learned on one road able to drive another?

    Each road has other lengths, lane widths, speed limits, bends and angles between roads, drawn by its seed. Players,
    traffic and right of way are those of the scene. A road that a rule-based driver can't drive is drawn again.
    """
    from harness.cli.scene_varying import check_variable, words_of, write_variant
    from harness.files import make_folder
    from harness.road.scene.open_scene import open_scene

    scene, seeds = open_scene(folder_of_scene(document_at(path, "networks")) or path), range(seed, seed + roads)
    make_folder(out)
    check_variable(scene, seeds, out)
    console, folders = console_of_any_encoding(), []
    for each in seeds:
        with console.status(f"road {each}: making and driving it"):
            written = write_variant(scene, each, out)
        folders.append(str(written.folder))
        again = f" ({len(written.discarded)} drawn before can't be driven)" if written.discarded else ""
        print_plain([f"wrote {written.folder}: {words_of(written.variation)}{again}"], console)
    print_plain([f"Next: harness league --ego EGO --scenes {','.join(folders)}"], console)


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


def _numbered(opened: OpenMap, number: int) -> GamePlan:
    if not 1 <= number <= len(opened.plans):
        remedy = f"choose one from 1 to {len(opened.plans)}: --list lists them"
        raise UsageError.of("--conflict", str(number), "there is no conflict of this number", remedy)
    return opened.plans[number - 1]


def _show(opened: OpenMap, plans: Sequence[GamePlan], console: Console) -> None:
    from harness.cli.net_views import plan_table

    console.print(plan_table([(plan, opened.place_of(plan)) for plan in plans]), highlight=False)
    counts = Counter(plan.candidate.kind.value for plan in opened.plans)
    print_plain(["in all: " + ", ".join(f"{count} {kind}" for kind, count in counts.items())], console)
    print_plain(opened.notes, console)
    print_plain([f"left out: {count} ({reason})" for reason, count in sorted(opened.left_out.items())], console)


def _write_page(opened: OpenMap, plans: Sequence[GamePlan], file: Path) -> None:
    from harness.cli.net_views import drawing_of, plan_priority
    from harness.reports.net_page import write_net_page

    places = []
    for plan in plans:
        text = f"{plan.candidate.kind.value}, {opened.place_of(plan)}; priority: {plan_priority(plan)}"
        places.append((plan.number, plan.candidate.place, text))
    write_net_page(drawing_of(opened.source.name, opened.net.getEdges(withInternal=False), places), file)


def _write(opened: OpenMap, chosen: Mapping[str, Sequence[GamePlan]], out: Path, console: Console) -> None:
    from harness.cli.scene_writing import files_of, write_scenes

    with console.status("making scenes") as status:
        written, problems = write_scenes(
            opened, chosen, out, lambda plan: status.update(f"conflict {plan.number}: making and driving the scene")
        )
    print_plain([str(problem) for problem in problems], console)
    for name, plan in written.items():
        scene, campaign = files_of(name, out)
        print_plain([f"conflict {plan.number}, {plain(opened.place_of(plan))}: wrote {scene} and {campaign}"], console)
    print_plain([f"Next: harness campaign {files_of(next(iter(written)), out)[1]} --quick"], console)
    if len(written) < len(chosen):
        raise typer.Exit(FAILED)
