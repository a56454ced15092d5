"""The commands for scenes and nets: show what lanes there are, and check a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli import messages
from harness.cli.new_scene import new_scene
from harness.cli.output import console_of_any_encoding, print_plain
from harness.shipped_documents import document_at

_ROWS = 100

scene_app = typer.Typer(no_args_is_help=True, help="Make scenes from maps, and show nets and scenes.")
scene_app.command("new")(new_scene)


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
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="Most lanes to list.")] = _ROWS,
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
    from harness.cli.net_tables import conflict_table, conflict_words, lane_table
    from harness.maps.candidates import listed_conflicts
    from harness.road.net.net_file import check_net
    from harness.road.net.net_listing import edges_near, listed_junctions, listed_lane
    from harness.road.net.network import read_net
    from harness.road.scene.open_scene import open_scene

    path = document_at(path, "networks")
    folder = folder_of_scene(path)
    scene = open_scene(folder) if folder is not None else None
    net_file = scene.net_file if scene is not None else path
    if scene is None:
        check_net(net_file)
    net = read_net(net_file)
    edges = edges_near(net, net_file, near, within)
    lanes, junctions = [listed_lane(lane) for edge in edges for lane in edge.getLanes()], listed_junctions(edges)
    conflicts = listed_conflicts(net, [junction.name for junction in junctions])
    console = console_of_any_encoding()
    console.print(lane_table(lanes[:rows]), markup=False, highlight=False)
    if conflicts:
        console.print()
        console.print(conflict_table(conflicts[:rows]), markup=False, highlight=False)
    for what, count in (("lanes", len(lanes)), ("conflicts", len(conflicts))):
        if count > rows:
            print_plain([messages.rows_left_out(count - rows, what)], console)
    if html is not None:
        from harness.cli.net_drawing import drawing_of
        from harness.reports.net_page import write_net_page

        title = scene.document.name if scene is not None else path.name
        places = ((k, each.place, conflict_words(each)) for k, each in enumerate(conflicts, start=1))
        write_net_page(drawing_of(title, lanes, junctions, places, scene), html)
        print_plain([f"Page: {html}"], console)


def check_scene(folder: Path) -> list[str]:
    """Check one scene, as a campaign that names it does; the lines to print. Raises UsageError with every problem."""
    from harness.road.scene.load_check import check_loads
    from harness.road.scene.open_scene import open_scene

    scene = open_scene(folder)
    check_loads(scene)
    return [f"{folder} is in order.", *messages.scene_lines(scene), *scene.warnings]


def folder_of_scene(path: Path) -> Path | None:
    """The folder of a scene that a path names: the folder itself, or the one of its scene.toml; None for others."""
    from harness.config.scene import SCENE_FILE

    if path.name == SCENE_FILE:
        return path.parent
    return path if path.is_dir() else None
