"""Every link of a report, published or new, leads to a part of its page or to a game that the page contains."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import pytest

from harness.reports.embedding import key
from tests.support.pages import blank_figures, campaign, recordings, rendered
from tests.support.repository import REPOSITORY

PUBLISHED = sorted((REPOSITORY / "reports").glob("*/report.html"))


def dead_links(page: str, folder: Path | None = None) -> list[str]:
    """The addresses of a page that lead nowhere. A page stands alone: without its `folder` no file is beside it."""
    recorded = re.search(r'<script type="application/json" id="recorded">(.*?)</script>', page, flags=re.DOTALL)
    games = json.loads(recorded[1])["games"] if recorded else []
    alive = {f"#{name}" for name in re.findall(r'\sid="([^"]+)"', page)}
    playable = {f"#game={key(game['arm'], game['seed'], game['episode'])}" for game in games}
    outside_scripts = re.sub(r"<script\b.*?</script>", "", page, flags=re.DOTALL)
    links = {html.unescape(link) for link in re.findall(r'<a\b[^>]*\shref="([^"]*)"', outside_scripts)}
    assert links
    beside = {each.name for each in folder.iterdir()} if folder is not None else set()
    return sorted(link for link in links - alive - beside if link.partition("&")[0] not in playable)


def test_links__of_a_new_report_are_alive() -> None:
    arguments = campaign(personas=["speedy"], games=12)
    assert dead_links(rendered(**arguments, **recordings(arguments))) == []


def test_links__to_games_that_the_page_does_not_contain_are_not_made() -> None:
    arguments = campaign(personas=["speedy"], games=12)
    with blank_figures():
        page = rendered(**arguments)
    assert "#game=" not in re.sub(r"<script\b.*?</script>", "", page, flags=re.DOTALL)
    assert dead_links(page) == []


@pytest.mark.parametrize("file", PUBLISHED, ids=lambda file: file.parent.name)
def test_links__of_a_published_report_are_alive(file: Path) -> None:
    assert dead_links(file.read_text(encoding="utf-8"), file.parent) == []


def test_links__a_dead_one_is_seen() -> None:
    page = '<p id="a"><a href="#a">a</a><a href="#b">b</a><a class="x" href="beside.csv">c</a></p>'
    assert dead_links(page) == ["#b", "beside.csv"]
