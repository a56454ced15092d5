"""The commands for scenes and nets: show what lanes there are, and check a scene."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import wording

if TYPE_CHECKING:
    from harness.traffic.scene import OpenScene

_ROWS = 100
_STARTS = 60  # drawn for each player

scene_app = typer.Typer(no_args_is_help=True, help="Show the lanes of a SUMO net, or of a scene with its players.")


@scene_app.command("show")
def show_scene(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="NET_OR_SCENE", help="A .net.xml or .net.xml.gz, a scene.toml, or its folder.", show_default=False
        ),
    ],
    near: Annotated[
        str | None,
        typer.Option(metavar="EDGE", help="Only lanes near this edge, the nearest first.", show_default=False),
    ] = None,
    within: Annotated[float, typer.Option(min=0.0, metavar="M", help="Distance in metres that is near.")] = 100.0,
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="Most lanes to list.")] = _ROWS,
    html: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Also write a page that draws the net to scale and opens offline.", show_default=False
        ),
    ] = None,
) -> None:
    """List the lanes of a net: id, length, speed limit, permissions, the junctions at both ends, and the edges to which
    each lane leads: straight on (s), to the right (r, R), to the left (l, L) or back (t).

    The page shows junctions and signals, too, and for a scene the players' routes, starts and goals.
    """
    from rich.console import Console
    from rich.table import Table

    from harness.traffic.net_file import check_net
    from harness.traffic.net_listing import edges_near, listed_junctions, listed_lanes
    from harness.traffic.network import read_net

    scene = _scene_of(path)
    net_file = scene.net_file if scene is not None else path
    if scene is None:
        check_net(net_file)
    net = read_net(net_file)
    edges = edges_near(net, net_file, near, within)
    lanes = listed_lanes(edges)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("lane", "length m", "limit m/s", "width m", "for", "from", "to", "leads to"):
        table.add_column(name, justify="left" if name.isalpha() or name == "leads to" else "right", overflow="fold")
    for lane in lanes[:rows]:
        numbers = (f"{lane.length_m:.1f}", f"{lane.limit_mps:.2f}", f"{lane.width_m:.1f}")
        ends = (lane.start_junction, lane.end_junction, "\n".join(lane.leads_to))
        table.add_row(lane.name, *numbers, lane.permissions, *ends)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # the terminal may not have every character
    console = Console()
    console.print(table, markup=False, highlight=False)
    if len(lanes) > rows:
        console.print(wording.lanes_left_out(len(lanes) - rows), markup=False, highlight=False, soft_wrap=True)
    if html is not None:
        from harness.cli.net_drawing import drawing_of
        from harness.reports.net_page import write_net_page

        title = scene.document.name if scene is not None else path.name
        write_net_page(drawing_of(title, lanes, listed_junctions(edges), scene, starts=_STARTS), html)
        console.print(wording.page_written(html), highlight=False, markup=False, soft_wrap=True)


def check_scene(folder: Path) -> list[str]:
    """Check one scene, as a campaign that names it does; the lines to print. Raises UsageError with every problem."""
    from harness.traffic.load_check import check_loads
    from harness.traffic.scene import open_scene

    scene = open_scene(folder)
    check_loads(scene)
    return [wording.in_order(folder), *wording.scene_lines(scene)]


def folder_of_scene(path: Path) -> Path | None:
    """The folder of a scene that a path names: the folder itself, or the one of its scene.toml; None for others."""
    from harness.config.scene import SCENE_FILE

    if path.name == SCENE_FILE:
        return path.parent
    return path if path.is_dir() else None


def _scene_of(path: Path) -> OpenScene | None:
    from harness.traffic.scene import open_scene

    folder = folder_of_scene(path)
    return open_scene(folder) if folder is not None else None
