"""A run folder is read as anybody's: whatever somebody has done to it, nothing else is read, written or run."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.bad_run_folders import LIST, REPORT, RUNS
from tests.hostile.inputs import Bad, Desk, traces_of, write_run


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Desk:
    desk = Desk(tmp_path, monkeypatch, capsys)
    write_run(tmp_path)
    return desk


def test_run__is_in_order_before_it_is_spoiled(desk: Desk) -> None:
    assert desk.run(LIST).code == 0
    before = traces_of(desk.folder)
    said = desk.run(REPORT)
    assert said.code == 0, said.err
    assert traces_of(desk.folder) == before, "a report from the same folder is the same"


@pytest.mark.parametrize("bad", RUNS, ids=repr)
def test_run__that_is_wrong(bad: Bad, desk: Desk) -> None:
    desk.refuses(bad)
