"""`harness serve`: the page of a run with every recorded game, for this machine alone."""

from __future__ import annotations

import json
import shutil
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from ipaddress import ip_address
from pathlib import Path

import pytest

from harness.campaign.results import served_report
from harness.campaign.results.served_report import PAGE, ServedReport, entry_of
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.tables import table_of
from harness.reports.page_template import CONTENT_POLICY, ELSEWHERE, served_page
from tests.support.serving import read, serving
from tests.support.tiny import sumo_run


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving(ServedReport(RunFolder(sumo_run())).answer) as server:
        yield f"http://127.0.0.1:{server.server_port}"


@pytest.mark.slow
def test_serve__the_page_lists_every_game_and_may_fetch_it(address: str) -> None:
    page = read(f"{address}/")
    assert "connect-src 'self'" in page
    listed = json.loads(page.split('id="elsewhere">')[1].split("</script>")[0])
    assert ["naive_alone", "", 1, 0] in [each[:4] for each in listed]
    for arm, _, seed, episode, outcome, _, *of_the_list in listed:
        game = json.loads(read(f"{address}/games/{arm},{seed},{episode}.json"))
        assert (game["arm"], game["episode"], game["outcome"]) == (arm, episode, outcome)
        assert [game["cause"], game["severity"], game["deltaV"]] == of_the_list
        assert game["packed"]


def test_serve__the_list_has_what_its_table_shows_and_sorts_by() -> None:
    game = {"arm": "naive_vs_speedy", "persona": "speedy", "seed": 1, "episode": 3, "error": ""}
    hit = {"ego_outcome": "collision", "ego_failed": 1, "severity": 2.504, "ego_min_ttc_s": 0.0}
    hit |= {"ego_delta_v_mps": 1.25, "other_delta_v_mps": 2.51}
    reached = {"episode": 4, "ego_outcome": "goal", "ego_failed": 0, "ego_min_ttc_s": 1.234}
    rows = table_of("episodes", [game | hit, game | reached]).itertuples()
    assert [entry_of(row, {"naive_vs_speedy,1,3": "it did not brake"}) for row in rows] == [
        ["naive_vs_speedy", "speedy", 1, 3, "collision", 0.0, "it did not brake", 2.5, 2.5],
        ["naive_vs_speedy", "speedy", 1, 4, "goal", 1.23, "", 0.0, None],
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/manifest.json", {}),
        ("/games/naive_alone,1,99.json", {}),
        ("/games/../manifest.json", {}),
        ("/x", {}),
        (f"/games/naive_alone,{'9' * 5000},0.json", {}),
        ("/", {"Host": "other.example"}),  # another site that names this machine
    ],
)
def test_serve__nothing_else_is_there_and_for_another_site_nothing(
    path: str, headers: dict[str, str], address: str
) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        read(f"{address}{path}", **headers)
    assert refused.value.code == 404


@pytest.mark.slow
def test_serve__traces_that_are_missing_or_changed_are_an_error_of_their_games_alone(tmp_path: Path) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "run")
    report = ServedReport(RunFolder(run))
    (run / "traces" / "naive_alone-seed1.parquet").unlink()
    shutil.copy(run / "traces" / "speedy_alone-seed1.parquet", run / "traces" / "naive_vs_speedy-seed1.parquet")
    with serving(report.answer) as server:
        games = f"http://127.0.0.1:{server.server_port}/games"
        for arm, words in (("naive_alone", "does not contain the traces"), ("naive_vs_speedy", "is not what the")):
            with pytest.raises(urllib.error.HTTPError) as refused:
                read(f"{games}/{arm},1,0.json")
            assert refused.value.code == 500
            assert words in refused.value.read().decode()
        assert json.loads(read(f"{games}/speedy_alone,1,0.json"))["packed"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["report.html", "episodes.csv", "manoeuvres.csv"])
def test_serve__a_file_that_was_changed_is_refused_with_the_command_that_writes_it(name: str, tmp_path: Path) -> None:
    run = shutil.copytree(sumo_run(), tmp_path / "run")
    with (run / name).open("a") as file:
        file.write("<script>alert(1)</script>")
    with pytest.raises(UsageError, match=f"{name}: is missing, or is not what the campaign wrote .*harness report"):
        ServedReport(RunFolder(run))


def nothing(path: str) -> None:
    """Answers every path with 404."""


def test_serve__only_programs_of_this_machine_can_connect() -> None:
    with serving(nothing) as server:
        host, port = server.socket.getsockname()
        assert ip_address(host).is_loopback
        with pytest.raises((ConnectionRefusedError, TimeoutError)):  # this machine, by another of its addresses
            socket.create_connection(("127.0.0.2", port), timeout=1.0)


def test_serve__an_idle_connection_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert served_report.IDLE_S == 30.0
    monkeypatch.setattr(served_report, "IDLE_S", 0.05)
    with serving(nothing) as server, socket.create_connection(server.socket.getsockname(), timeout=30.0) as idle:
        idle.sendall(b"GET / HTTP/1.1\r\n")  # and no end
        assert idle.recv(1) == b""


def test_serve__every_response_forbids_the_page_to_load_anything_from_elsewhere() -> None:
    with serving(lambda path: (PAGE, b"<html></html>") if path == "/" else None) as server:
        address = f"http://127.0.0.1:{server.server_port}"
        with urllib.request.urlopen(f"{address}/") as page, pytest.raises(urllib.error.HTTPError) as missing:
            urllib.request.urlopen(f"{address}/x")
    for headers in (page.headers, missing.value.headers):
        assert headers["Content-Security-Policy"] == f"{CONTENT_POLICY}; connect-src 'self'"
        assert headers["X-Content-Type-Options"] == "nosniff"


def test_serve__a_page_of_another_version_is_refused_with_the_remedy() -> None:
    with pytest.raises(UsageError, match="harness report reports/mine"):
        served_page("<html></html>", [], "reports/mine")


def test_serve__names_of_games_are_inert() -> None:
    page = f"<meta {CONTENT_POLICY}>{ELSEWHERE.format('[]')}"
    assert "</script><img" not in served_page(page, [["</script><img>", "", 1, 0, "goal", None]], "run")


def test_serve__a_folder_that_is_no_run_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is not a run folder"):
        ServedReport(RunFolder(tmp_path))
