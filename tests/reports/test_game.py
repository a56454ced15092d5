"""The report's section on the game: its numbers are those of the CSV files, its sentences match the findings."""

from __future__ import annotations

import csv
import math
import re

import pandas as pd
import pytest

from harness.evaluation.column import POINTS, SHARE
from harness.evaluation.game_theory.empirical_game import equilibria
from harness.evaluation.tables import columns_of, table_of, write_csv
from harness.reports.game import CAPTIONS, equilibrium_sentences, game_section, selection_sentences
from harness.reports.game_links import GameLinks
from harness.reports.heatmaps import IN_EQUILIBRIUM, OPENS_A_GAME, views
from tests.support.chromium import COLOURS, contrast, rgb, unfold
from tests.support.game_tables import findings
from tests.support.pages import Page, campaign, drawn_with, plain, rendered

NO_LINKS = GameLinks(embedded=(), episodes=table_of("episodes"))


@pytest.fixture(scope="module")
def found():
    return findings(seeds=(1, 2))


def page_of(game, seeds=(1,)):
    """A report with little more than the section on the game."""
    arguments = campaign(personas=(), seeds=seeds)
    return rendered(**arguments | {"training": arguments["training"][:0]}, game=game)


@pytest.fixture(scope="module")
def html(found):
    return page_of(found, seeds=(1, 2))


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


# --- numbers ---


@pytest.mark.parametrize("name", CAPTIONS)
def test_section__the_numbers_are_those_of_the_csv_file(name, found, page, tmp_path):
    write_csv(getattr(found, name), tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        assert page.cells(name) == list(csv.reader(file))


def test_section__every_number_that_is_read_is_the_exact_one_rounded(found, page):
    checked = 0
    for name in CAPTIONS:
        headings, columns = [cell["exact"] for cell in page.tables[name][0]], columns_of(getattr(found, name).columns)
        for row in page.tables[name][1:]:
            for column, cell in zip(headings, row, strict=True):
                if cell["exact"] in (None, "") or column in ("p_value", "p_holm"):
                    continue
                scaled = columns[column].unit in (SHARE, POINTS)
                read = float(cell["text"].replace("\N{MINUS SIGN}", "-").replace(",", ""))
                exact = float(cell["exact"]) * (100 if scaled else 1)
                assert read == pytest.approx(exact, abs=0.0501 if scaled else 0.00501), column
                checked += 1
    assert checked > 500


def test_heat_map__has_the_tables_number_in_every_cell(found):
    first = found.crossplay[found.crossplay["seed"] == 2]
    (mean, _, second) = game_section(found, NO_LINKS)["views"]
    assert (mean["label"], second["label"]) == ("mean over 2 seeds", "seed 2")
    failures, ego, non_ego = (each["figure"] for each in second["maps"])
    for row in first.to_dict("records"):
        between = f"{row['ego']} against {row['non_ego']} "
        assert f"{between}{row['failure_rate'] * 100:g} %" in failures
        assert f"{between}{row['ego_payoff']:.1f}" in ego
        payoff = "–" if math.isnan(row["non_ego_payoff"]) else f"{row['non_ego_payoff']:.1f}"
        assert f"{between}{payoff}" in non_ego
        assert f">{row['failure_rate'] * 100:g} %<" in failures  # and not only for those who can't see it
    naive = found.crossplay[(found.crossplay["ego"] == "naive") & (found.crossplay["non_ego"] == "speedy")]
    assert f"naive against speedy {naive['ego_payoff'].mean():.1f}" in mean["maps"][1]["figure"]


def test_heat_map__a_cell_links_to_the_worst_of_its_games(found):
    games = campaign(personas=["speedy"])["episodes"]
    games = games[games["arm"] == "naive_vs_speedy"].head(3)
    outcomes, severity = ["goal", "collision", "goal"], [0.0, 300.0, 0.0]
    episodes = games.assign(seed=[1, 1, 2], episode=[0, 7, 3], ego_outcome=outcomes, severity=severity)
    worst = "naive_vs_speedy,1,7"
    mean, first, second = views(found.crossplay, found.equilibria, GameLinks(embedded={worst}, episodes=episodes))
    for view in (mean, first):
        assert f'href="#game={worst}"' in view["maps"][0]["figure"]
        assert OPENS_A_GAME in view["maps"][0]["caption"]
    assert "#game=" not in second["maps"][0]["figure"]  # the page does not contain the game
    assert OPENS_A_GAME not in second["maps"][0]["caption"]


def test_heat_map__has_a_personas_strategies_side_by_side(found):
    rows = found.crossplay[found.crossplay["seed"] == 1]
    rows = pd.concat([rows[rows["non_ego"] != "speedy_round2"], rows[rows["non_ego"] == "speedy_round2"]])
    figure = views(rows, found.equilibria, NO_LINKS)[0]["maps"][0]["figure"]
    names = re.findall(r">(speedy|speedy_round2|distracted|sumo)</text>", figure)
    assert names == ["speedy", "speedy_round2", "distracted", "sumo"]


def test_heat_map__frames_what_an_equilibrium_plays(found):
    solved = found.equilibria[(found.equilibria["seed"] == 2) & (found.equilibria["number"] == 1)]
    players = solved[(solved["solution"] == "nash") & (solved["share"] > 0.001)].groupby(["game", "role"])["player"]
    played = players.apply(list)
    pairs = {
        f"{ego} against {non_ego}"
        for game in ("speedy", "distracted")
        for ego in played[game, "ego"]
        for non_ego in played[game, "non_ego"]
    }
    (mean, _, second) = game_section(found, NO_LINKS)["views"]
    for each in second["maps"]:
        assert set(re.search(r"In equilibrium: ([^\"]*)", each["figure"])[1].split("; ")) == pairs
        assert drawn_with("stroke-width:1.6", each["figure"]) == len(pairs)
        assert IN_EQUILIBRIUM in each["caption"]
    assert all("In equilibrium" not in each["figure"] + each["caption"] for each in mean["maps"])


# --- where there is nothing ---


def test_section__is_there_only_where_a_run_has_such_tables(html):
    without = page_of(None)
    assert 'id="game"' in html
    assert 'href="#game"' in html
    assert 'id="game"' not in without
    assert 'href="#game"' not in without


# --- words ---


def test_words__of_an_equilibrium_name_shares_failures_and_payoff():
    cells = pd.DataFrame(
        {
            "seed": 1,
            "ego": ["naive", "naive", "retrained", "retrained"],
            "non_ego": ["speedy", "speedy_round2"] * 2,
            "persona": "speedy",
            "failure_rate": [0.4, 0.0, 0.0, 0.2],
            "ego_payoff": [1.0, -1.0, -1.0, 1.0],
            "non_ego_payoff": [-1.0, 1.0, 1.0, -1.0],
        }
    )
    found = equilibria(cells)
    (_, against, (nash,)), (_, everyone, (safest,)) = equilibrium_sentences(found)
    assert (against, everyone) == ("speedy", "all")
    assert plain(nash) == (
        "In equilibrium the ego plays 50 % naive + 50 % retrained, the speedy driver 50 % speedy + 50 % "
        "speedy_round2: the ego fails in 15 % of games and earns 0.00."
    )
    assert plain(safest) == (
        "The safest choice of egos is 33.3 % naive + 66.7 % retrained: in the worst case it fails in 13.3 % of games, "
        "against speedy, speedy_round2. The safest single ego is retrained, with 20 % in the worst case."
    )
    (_, _, (nash,)), (_, _, (safest,)) = equilibrium_sentences(found.assign(held_out_failure_rate=0.2))
    assert "the ego fails in 15 % of games (20 % in games that did not choose it) and earns 0.00." in plain(nash)
    assert plain(safest).startswith(
        "The safest choice of egos is 33.3 % naive + 66.7 % retrained: in the worst case it fails in 13.3 % of games "
        "(20 % in games that did not choose it), against speedy, speedy_round2."
    )


# --- in a browser ---


@pytest.fixture(scope="module")
def report(html, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(html, encoding="utf-8")
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_browser__numbers_stand_out_from_the_darkest_cell(opened, scheme):
    page = opened(color_scheme=scheme)
    for selector in ("#game .sentence", "#game .induced", "#game figcaption", "#game .heat svg text", "#game dd"):
        assert contrast(*page.locator(selector).first.evaluate(COLOURS)) >= 4.5, selector
    ink, ground = page.locator("#game .heat svg text").first.evaluate(COLOURS)
    cells = page.locator("#game .heat svg path").evaluate_all(
        """cells => cells.map(cell => getComputedStyle(cell)).filter(style => style.fill !== "none")
          .map(style => [style.fill, Number(style.opacity) * Number(style.fillOpacity)])"""
    )
    worst = min(
        contrast(
            ink, [part * opacity + behind * (1 - opacity) for part, behind in zip(rgb(fill), rgb(ground), strict=True)]
        )
        for fill, opacity in cells
        if opacity < 1
    )
    assert 4.5 <= worst < 21


def test_browser__a_seed_is_chosen_by_keyboard_or_mouse(opened):
    page = opened()
    unfold(page)
    shown = page.locator("#game .maps:visible .figure-title").first
    assert shown.inner_text() == "Failure rate of the ego (%), mean over 2 seeds"
    page.get_by_label("seed 2", exact=True).check()
    assert shown.inner_text() == "Failure rate of the ego (%), seed 2"
    page.keyboard.press("ArrowLeft")
    assert shown.inner_text() == "Failure rate of the ego (%), seed 1"


# --- selections ---


def candidate(name: str, payoff: float, role: str = "ego", round_: int = 4, chosen: bool = False) -> dict[str, object]:
    strategy = f"retrained_anna_round{round_}" if role == "ego" else f"anna_round{round_}"
    cells = {"candidate": name, "payoff": payoff, "role": role, "round": round_, "chosen": chosen, "strategy": strategy}
    return {"persona": "anna", "seed": 1, "episodes": 100, "alone": 25, "left_out": 0, **cells}


def test_selection__is_told_with_what_the_answer_and_the_best_other_policy_earned() -> None:
    table = table_of(
        "selections",
        [
            candidate("anna", 3.0, "non_ego", 3),
            candidate("anna_round3_answer", 4.5, "non_ego", 3, chosen=True),
            candidate("naive", 1.0),
            candidate("retrained_anna", 7.25, chosen=True),
            candidate("retrained_anna_round4_answer", 6.0),
        ],
    )
    assert selection_sentences(table) == [
        (
            1,
            "Round 3, the anna driver: the new answer is taken. In 100 games, 25 of them alone, it earned 4.50 on "
            "average, the best policy before it, anna, 3.00.",
        ),
        (
            1,
            "Round 4, the ego against anna: the new answer is rejected. In 100 games, 25 of them alone, it earned 6.00 "
            "on average, retrained_anna 7.25: the player goes on with this policy.",
        ),
    ]
