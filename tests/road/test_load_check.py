"""The load check in separate processes: complaints and crashes of SUMO become error messages."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import sumo

from harness.errors import UsageError
from harness.road.scene import load_check
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.scenes import CARS, build_scene

VAN = '<vehicle id="van" type="van" depart="3" departPos="80" departSpeed="9"><route edges="road"/></vehicle>'


def complaint(scene: OpenScene) -> str:
    with pytest.raises(UsageError) as raised:
        load_check.check_loads(scene)
    (problem,) = raised.value.problems
    assert problem.remedy
    return str(problem)


def fake_sumo(folder: Path, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace SUMO by a shell script."""
    program = folder / "home" / "bin" / "sumo"
    program.parent.mkdir(parents=True, exist_ok=True)
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setattr(sumo, "SUMO_HOME", str(folder / "home"))


def test_scene__a_valid_one_passes(merge: OpenScene, tmp_path: Path) -> None:
    load_check.check_loads(merge)
    flow = '<flow id="vans" type="van" begin="0" period="3" departLane="random"><route edges="road"/></flow>'
    load_check.check_loads(build_scene(tmp_path, others=VAN + flow))


def test_net__a_refused_one_is_named_with_the_place(repository: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(repository / "tests" / "data" / "merge", tmp_path / "merge")
    net = folder / "merge.net.xml"
    net.write_text(net.read_text().replace('type="dead_end"', 'type="roundabout"', 1))
    message = complaint(open_scene(folder))
    assert message.startswith(f"{net}: line ")
    assert "roundabout" in message


def test_background__refused_vehicles_are_named(tmp_path: Path) -> None:
    ship = VAN.replace('type="van"', 'type="ship"')
    scene = build_scene(tmp_path, cars=CARS + '<vType id="ship" vClass="ship"/>', others=ship)
    text = scene.net_file.read_text()
    scene.net_file.write_text(text.replace("<lane ", '<lane allow="passenger" '))
    message = complaint(open_scene(tmp_path))
    assert str(scene.routes.path) in message
    assert "'van'" in message


@pytest.mark.parametrize(("script", "expected"), [("kill -SEGV $$", "died of SIGSEGV"), ("exit 3", "exit code 3")])
def test_sumo__a_crash_is_a_message(
    script: str, expected: str, merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_sumo(tmp_path, script, monkeypatch)
    assert expected in complaint(merge)


def test_sumo__is_ended_after_a_time_limit(merge: OpenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake_sumo(tmp_path, f"echo $$ >> {tmp_path}/pids; exec sleep 600", monkeypatch)
    monkeypatch.setattr(load_check, "PATIENCE_S", 0.5)
    assert "did not finish" in complaint(merge)
    for pid in (tmp_path / "pids").read_text().split():
        assert not Path(f"/proc/{pid}").exists()
