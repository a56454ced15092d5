"""A recorded game as a folder that opens with `sumo-gui -c scene.sumocfg`: no Python, no harness.

scene.sumocfg      the configuration, which names the files below
scene.net.xml      the scene's net, copied
scene.add.xml      vehicle types in the colours of the game, obstacles and buildings, traffic lights, rails, contacts
episode.fcd.xml    every pose of every vehicle
view.xml           zoom, speed, and the halts at contacts and at the end
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from xml.etree import ElementTree

import pandas as pd

from harness.files import complete_folder
from harness.replay.contacts import contacts
from harness.replay.floating_car_data import Lanes, shown_at, write_recording, write_xml
from harness.replay.gui_settings import WINDOW_PX, choose_view, view_settings
from harness.replay.scenery import painted, programmes, scenery, shapes_of
from harness.replay.vehicles import legend, types_of_vehicles
from harness.road.scene.open_scene import OpenScene
from harness.road.xml.xml_file import xml_bytes


def write_replay(
    trace: pd.DataFrame,
    scene: OpenScene,
    folder: Path,
    *,
    title: str,
    names: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Write the replay of one game on a scene to `folder`, which is replaced. The folder appears only when it is
    complete.

    `trace` is the game's rows (columns as in `traces/`), `names` are what players are called in the title, by their
    names in the trace. The same arguments give the same bytes.
    Raises ValueError for a trace with no row or with more than one game.
    """
    if trace["episode"].nunique() != 1:
        raise ValueError(f"a replay is of one game; the trace has {trace['episode'].nunique()}")
    trace = trace.astype({"player": str, "vehicle_type": str, "outcome": str})
    types = types_of_vehicles(trace, scene.routes.types_xml, scene.obstacles)
    lanes, step_s = Lanes.read(scene.net_file), scene.world.step_s
    touches = contacts(trace, types, scene.rail_lines)
    view = choose_view(trace, touches)

    folder.parent.mkdir(parents=True, exist_ok=True)
    with complete_folder(folder, replaces=True) as partial:
        (partial / "scene.net.xml").write_bytes(xml_bytes(scene.net_file))
        shown_title = f"{title}   {legend(trace, names)}"
        added = scenery(types=types, rails=scene.rail_lines, touches=touches, view=view, title=shown_title)
        added.extend((*painted(scene.stripes), *shapes_of(trace, types, scene.obstacles), *programmes(trace, step_s)))
        write_xml(added, partial / "scene.add.xml")
        write_recording(
            trace=trace[[bool(types[name].shape) for name in trace["player"]]],
            types=types,
            lanes=lanes,
            step_length_s=step_s,
            file=partial / "episode.fcd.xml",
        )
        moments = [*(contact.time_s for contact in touches), float(trace["time_s"].max())]
        halts_s = sorted({shown_at(moment, step_s) for moment in moments})
        signals = "signals" in trace and bool((trace["signals"] != "").any())
        write_xml(view_settings(view, halts_s, lanes, signals=signals), partial / "view.xml")
        # Without an end SUMO would never stop. At the end SUMO-GUI asks a question in front of the picture; the end is
        # a step beyond the last halt, so that the picture stays free until the user presses the play button.
        write_xml(_configuration(title, halts_s[-1] + 2 * step_s, step_s), partial / "scene.sumocfg")


def _configuration(title: str, end_s: float, step_length_s: float) -> ElementTree.Element:
    root = ElementTree.Element("configuration")
    about = f" {title}. SUMO's clock shows the game's time plus {step_length_s:g} s. "
    root.append(ElementTree.Comment(about.replace("--", "- -")))
    for section, options in {
        "input": {"net-file": "scene.net.xml", "additional-files": "scene.add.xml"},
        "time": {"begin": "0", "end": f"{end_s:.3f}", "step-length": f"{step_length_s:g}"},
        "processing": {
            # SUMO must place every vehicle as recorded, even where its own rules forbid it
            "collision.action": "none",
            "insertion-checks": "none",
            "ignore-route-errors": "true",
            "time-to-teleport": "-1",
        },
        # otherwise SUMO warns of jumps, hard braking and ends of routes in the recording
        "report": {"no-warnings": "true", "no-step-log": "true"},
        "device": {"device.fcd-replay.files": "episode.fcd.xml"},
        "gui_only": {
            "gui-settings-file": "view.xml",
            "start": "true",
            "window-size": ",".join(str(pixels) for pixels in WINDOW_PX),
        },
    }.items():
        parent = ElementTree.SubElement(root, section)
        for option, value in options.items():
            ElementTree.SubElement(parent, option, value=value)
    return root
