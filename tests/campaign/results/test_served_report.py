"""`harness serve`: the page of a run with every recorded game, for this machine alone."""

from __future__ import annotations

import json
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.campaign.results.served_report import ServedReport, server_of
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.reports.page_template import CONTENT_POLICY, ELSEWHERE, served_page
from tests.support.tiny import sumo_run


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    server = server_of(ServedReport(RunFolder(sumo_run())), 0)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def read(address: str, **headers: str) -> str:
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
        text: str = answer.read().decode()
        return text


@pytest.mark.slow
def test_serve__the_page_lists_every_game_and_may_fetch_it(address: str) -> None:
    page = read(f"{address}/")
    assert "connect-src 'self'" in page
    listed = json.loads(page.split('id="elsewhere">')[1].split("</script>")[0])
    assert ["naive_alone", "", 1, 0] in [each[:4] for each in listed]
    for arm, _, seed, episode, outcome, _ in listed:
        game = json.loads(read(f"{address}/games/{arm},{seed},{episode}.json"))
        assert (game["arm"], game["episode"], game["outcome"]) == (arm, episode, outcome)
        assert game["packed"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/manifest.json", {}),
        ("/games/naive_alone,1,99.json", {}),
        ("/games/../manifest.json", {}),
        ("/x", {}),
        ("/", {"Host": "other.example"}),  # another site that names this machine
    ],
)
def test_serve__nothing_else_is_there_and_for_another_site_nothing(
    path: str, headers: dict[str, str], address: str
) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        read(f"{address}{path}", **headers)
    assert refused.value.code == 404


def test_serve__a_page_of_another_version_is_refused_with_the_remedy() -> None:
    with pytest.raises(UsageError, match="harness report reports/mine"):
        served_page("<html></html>", [], "reports/mine")


def test_serve__names_of_games_are_inert() -> None:
    page = f"<meta {CONTENT_POLICY}>{ELSEWHERE.format('[]')}"
    assert "</script><img" not in served_page(page, [["</script><img>", "", 1, 0, "goal", None]], "run")


def test_serve__a_folder_without_a_report_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"report\.html"):
        ServedReport(RunFolder(tmp_path))
