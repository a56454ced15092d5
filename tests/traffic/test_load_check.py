"""SUMO loads a scene in processes of their own: what it says, or that it dies, is a message."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import sumo

from harness.errors import UsageError
from harness.traffic import load_check
from harness.traffic.scene import OpenScene, open_scene
from tests.support.scenes import CARS, build_scene

VAN = '<vehicle id="van" type="van" depart="3" departPos="80" departSpeed="9"><route edges="road"/></vehicle>'


def complaint(scene: OpenScene) -> str:
    with pytest.raises(UsageError) as raised:
        load_check.check_loads(scene)
    (problem,) = raised.value.problems
    assert problem.remedy
    return str(problem)


def other_sumo(folder: Path, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A SUMO that does what the script says."""
    for name in ("sumo", "netconvert"):
        program = folder / "home" / "bin" / name
        program.parent.mkdir(parents=True, exist_ok=True)
        program.write_text(f"#!/bin/sh\n{script}\n")
        program.chmod(0o755)
    monkeypatch.setattr(sumo, "SUMO_HOME", str(folder / "home"))


def test_scene__in_order_passes(merge: OpenScene, tmp_path: Path) -> None:
    load_check.check_loads(merge)
    flow = '<flow id="vans" type="van" begin="0" period="3" departLane="random"><route edges="road"/></flow>'
    load_check.check_loads(build_scene(tmp_path, others=VAN + flow))


def test_net__that_sumo_refuses_is_named_with_the_place(repository: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(repository / "tests" / "data" / "merge", tmp_path / "merge")
    net = folder / "merge.net.xml"
    net.write_text(net.read_text().replace('type="dead_end"', 'type="roundabout"', 1))
    said = complaint(open_scene(folder))
    assert said.startswith(f"{net}: line ")
    assert "roundabout" in said


def test_others__that_sumo_refuses_are_named(tmp_path: Path) -> None:
    ship = VAN.replace('type="van"', 'type="ship"')
    scene = build_scene(tmp_path, cars=CARS + '<vType id="ship" vClass="ship"/>', others=ship)
    text = scene.net_file.read_text()
    scene.net_file.write_text(text.replace("<lane ", '<lane allow="passenger" '))
    said = complaint(open_scene(tmp_path))
    assert str(scene.routes.path) in said
    assert "'van'" in said


@pytest.mark.parametrize(("script", "said"), [("kill -SEGV $$", "died of it (SIGSEGV)"), ("exit 3", "exit code 3")])
def test_sumo__that_dies_is_a_message(
    script: str, said: str, merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other_sumo(tmp_path, script, monkeypatch)
    assert said in complaint(merge)


def test_sumo__that_does_not_end_is_ended(merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other_sumo(tmp_path, f"echo $$ >> {tmp_path}/pids; exec sleep 600", monkeypatch)
    monkeypatch.setattr(load_check, "PATIENCE_S", 0.5)
    assert "did not finish" in complaint(merge)
    for pid in (tmp_path / "pids").read_text().split():
        assert not Path(f"/proc/{pid}").exists()
