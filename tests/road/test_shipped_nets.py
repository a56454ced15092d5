"""The nets of the installed SUMO, which the harness did not draw: each opens, or is refused for a reason that is right.

Property of every net: a car that follows the centre line of a lane or of a connection touches no rail.
`python -m benchmarks.nets` prints a line for each net; `python -m benchmarks.nets FOLDER` takes those of a folder.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import sumo

from benchmarks.nets import shipped_nets, survey

FOR_OTHERS = {"racing/spreewaldring.net.xml": "vip", "rail/net.net.xml": "rail", "rail_demo/net.net.xml": "rail"}
"""Nets without a lane for cars, and what their lanes are for."""
NETS = shipped_nets()


def label(path: Path) -> str:
    return f"{path.parent.name}/{path.name}"


def test_shipped_nets__are_found() -> None:
    assert len(NETS) >= 28, sumo.SUMO_HOME
    assert {label(path) for path in NETS} >= set(FOR_OTHERS)


@pytest.mark.parametrize("path", NETS, ids=label)
def test_shipped_nets__every_one_opens_and_has_no_phantom_rail(path: Path) -> None:
    found = survey(path, routes=10)
    assert not found.crashed
    assert not found.phantom
    expected = FOR_OTHERS.get(label(path))
    assert found.refused == (f"has no lane that cars may use: its lanes are for {expected}" if expected else "")
    assert expected or found.paths > 0
