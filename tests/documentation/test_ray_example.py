"""The example of docs/scaling.md, two machines on one, runs as it is written there."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.repository import REPOSITORY
from tests.support.tiny import BY_SUMO, PATIENCE_S, end, numbers, sumo_run, write_campaign

PAGE = REPOSITORY / "docs" / "scaling.md"


def example() -> str:
    """The commands below the heading "Try it on one machine"."""
    section = PAGE.read_text(encoding="utf-8").partition("### Try it on one machine")[2]
    (commands,) = re.findall(r"```sh\n(.*?)```", section.partition("\n### ")[0], re.DOTALL)
    return str(commands)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.mark.slow
def test_example__two_machines_on_one_give_the_numbers_of_one(tmp_path: Path) -> None:
    """Another port, a tiny campaign, and no `ray stop`: that would end the clusters of other tests as well."""
    run = tmp_path / "run"
    changes = {
        "6379": str(free_port()),
        "campaigns/demo.toml": str(write_campaign(tmp_path, **BY_SUMO)),
        "reports/demo-ray": str(run),
        "ray stop\n": "",
        "--num-cpus=1": "--num-cpus=1 --object-store-memory=80000000 --disable-usage-stats",
    }
    script = example()
    for written, here in changes.items():
        assert written in script
        script = script.replace(written, here)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    shell = subprocess.Popen(
        ["bash", "-e", "-c", script],
        stdout=(tmp_path / "printed").open("w"),
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PATH": path},
        start_new_session=True,
    )
    try:
        shell.wait(PATIENCE_S)
    finally:
        end(shell)
    assert shell.returncode == 0, (tmp_path / "printed").read_text()
    assert numbers(run) == numbers(sumo_run())
