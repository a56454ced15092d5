"""The traffic lights of a replay: SUMO shows them in every frame as they were in the game."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as Xml

import pandas as pd
from defusedxml import ElementTree

from harness.replay import write_replay
from harness.replay.scenery import programmes
from harness.road.scene.open_scene import open_scene
from tests.support.replays import STEP_S, drive, straight
from tests.support.repository import REPOSITORY
from tests.support.scenes import run_sumo_program

LEFT_ACROSS = REPOSITORY / "networks" / "left_across"


def light_of(net: Path) -> tuple[str, int]:
    """The id of a net's first traffic light, and the number of its links."""
    logic = ElementTree.parse(net).getroot().find("tlLogic")
    return logic.get("id"), len(logic.find("phase").get("state"))


def changing(light: str, links: int) -> pd.DataFrame:
    """A game of 6 s in which the light changes after 0.1 s, in several steps in turn, and not at the end."""
    states = ["r", "G", "y", "r", "u", "g"]
    until = [1, 7, 8, 9, 30, 60]
    texts = [f"{light}={states[next(k for k, end in enumerate(until) if step < end)] * links}" for step in range(60)]
    drawn = drive("ego", straight(-110.0, -1.6, 8.0, 60), outcome="timeout")
    return drawn.assign(signals=texts)


def shown(folder: Path, light: str) -> dict[int, str]:
    """The state that SUMO shows of a light in each of its steps, as it writes it at the step's end."""
    events = Xml.Element("additional")
    output = folder.parent / "lights.xml"
    Xml.SubElement(events, "timedEvent", {"type": "SaveTLSStates", "source": light, "dest": str(output)})
    file = folder.parent / "events.add.xml"
    Xml.ElementTree(events).write(file)
    options = ["-c", str(folder / "scene.sumocfg"), "--additional-files", f"{folder / 'scene.add.xml'},{file}"]
    assert run_sumo_program("sumo", options, folder) == ""
    found = {}
    for each in ElementTree.parse(output).getroot():
        found[round(float(each.get("time")) / STEP_S)] = each.get("state")
    return found


def write(recorded: pd.DataFrame, folder: Path) -> Path:
    write_replay(recorded, open_scene(LEFT_ACROSS), folder, title="lights")
    return folder


def test_replay__each_frame_has_the_lights_of_the_trace(tmp_path: Path) -> None:
    light, links = light_of(LEFT_ACROSS / "left_across.net.xml")
    drawn = changing(light, links)
    states = shown(write(drawn, tmp_path / "replay"), light)
    texts = dict(zip(drawn["step"], drawn["signals"], strict=True))
    assert {
        step: f"{light}={states[step + 1]}" for step in texts
    } == texts  # SUMO shows the game's step k in its step k + 1


def test_replay__without_recorded_lights_keeps_the_nets(tmp_path: Path) -> None:
    light, _ = light_of(LEFT_ACROSS / "left_across.net.xml")
    drawn = drive("ego", straight(-110.0, -1.6, 8.0, 60), outcome="timeout")
    states = shown(write(drawn, tmp_path / "replay"), light)
    first = ElementTree.parse(LEFT_ACROSS / "left_across.net.xml").getroot().find("tlLogic/phase").get("state")
    assert set(states.values()) == {first}


def test_programmes__one_for_each_light_with_a_phase_for_each_state() -> None:
    drawn = drive("ego", straight(0.0, 0.0, 8.0, 4)).assign(signals=["a=b=Gr x=r", "a=b=Gr x=r", "a=b=ry x=r", ""])
    first, second = programmes(pd.concat([drawn, drawn.assign(player="non_ego")]), STEP_S)
    assert (first.get("id"), second.get("id")) == ("a=b", "x")
    assert [(each.get("duration"), each.get("state")) for each in first] == [("0.300", "Gr"), ("3600.000", "ry")]
    assert [each.get("state") for each in second] == ["r"]
