"""Whatever is wrong with a document or a run folder, it is said once, with file and key, and nothing else happens."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hostile.bad_documents import CAMPAIGNS, PERSONAS, POLICIES, SCENES
from tests.hostile.bad_roads import NETS, ROUTE_FILES
from tests.hostile.bad_run_folders import LIST, REPORT, RUNS
from tests.hostile.inputs import CHECK, Bad, Desk, all_at_release, traces_of, write_run

DOCUMENTS = [*CAMPAIGNS, *PERSONAS, *SCENES, *NETS, *ROUTE_FILES, *POLICIES]


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Desk:
    return Desk(tmp_path, monkeypatch, capsys)


def test_project__is_in_order_before_it_is_spoiled(desk: Desk) -> None:
    assert desk.run(CHECK).code == 0


@pytest.mark.parametrize("bad", all_at_release(DOCUMENTS))
def test_document__that_is_wrong(bad: Bad, desk: Desk) -> None:
    desk.refuses(bad)


def test_run__is_in_order_before_it_is_spoiled(desk: Desk) -> None:
    write_run(desk.folder)
    assert desk.run(LIST).code == 0
    before = traces_of(desk.folder)
    said = desk.run(REPORT)
    assert said.code == 0, said.err
    assert traces_of(desk.folder) == before, "a report from the same folder is the same"


@pytest.mark.parametrize("bad", all_at_release(RUNS))
def test_run__that_is_wrong(bad: Bad, desk: Desk) -> None:
    write_run(desk.folder)
    desk.refuses(bad)
