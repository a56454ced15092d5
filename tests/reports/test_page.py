from __future__ import annotations

import csv
import math
import re

import pandas as pd
import pytest

from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.research_questions import INCOMPETENT, Verdict
from harness.evaluation.tables import write_csv
from harness.evaluation.worst_first import worst_first
from harness.replay.selection import choose_games, replay_name
from harness.reports import page as page_module
from harness.reports.differences import CHANCE, NO_T_STATISTIC, effect, speed_sentence
from harness.reports.numbers import duration, number, p_number, p_text, percent, signed
from harness.reports.page import REPLAYS_SHOWN
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import NO_ROUND_2, answer
from tests.support.incompetent import cannot_drive
from tests.support.pages import (
    Page,
    blank_figures,
    campaign,
    recomputed,
    recordings,
    rendered,
    with_errors,
)


@pytest.fixture(scope="module")
def small():
    return campaign()


@pytest.fixture(scope="module")
def html(small):
    return rendered(**small)


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


# --- numbers ---


@pytest.mark.parametrize("name", ["comparisons", "summary"])
def test_page__the_numbers_are_those_of_the_csv_file(name, small, page, tmp_path):
    write_csv(small[name], tmp_path / "table.csv")
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        assert page.cells(name) == list(csv.reader(file))


def test_page__every_link_leads_to_a_part_of_the_page(page):
    """A published page stands alone: what lies beside it in the run folder is not there."""
    links = {attributes["href"] for tag, attributes in page.tags if tag == "a"}
    ids = {attributes["id"] for _, attributes in page.tags if "id" in attributes}
    assert links
    assert {link for link in links if not link.startswith("#game=") and link.removeprefix("#") not in ids} == set()


def test_page__a_table_too_long_for_a_page_is_left_to_its_file(small, monkeypatch):
    monkeypatch.setattr(page_module, "MOST_ROWS", 10)
    with blank_figures():
        page = Page(rendered(**small))
    assert "episodes" not in page.tables
    assert f"{len(small['episodes'])} games are too many for a page" in page.text


# --- words ---

NOT_PLAYED = "Not played: retrained_vs_speedy."


def answered(question, rows, arguments):
    """The answer about the speedy driver where these are the comparisons of a campaign."""
    return answer(RunTables(**arguments | {"comparisons": pd.DataFrame(rows)}), question, "speedy")


def text_of(arguments):
    """The page's text without the learning curves, which take long."""
    return Page(without_curves(arguments)).text


def without_curves(arguments):
    with blank_figures():
        return rendered(**arguments | {"training": arguments["training"][:0]})


def verdict_texts(arguments):
    """(label, sentence) of every answer on the page, in order."""
    html = without_curves(arguments)
    found = re.findall(r'class="answer">.*?<span>(.*?)</span>.*?class="sentence">(.*?)</p>', html, flags=re.DOTALL)
    plain = [[re.sub(r"\s+", " ", part.replace("&#39;", "'").replace("&lt;", "<")) for part in pair] for pair in found]
    return [(label, sentence.replace("\N{NO-BREAK SPACE}", " ")) for label, sentence in plain]


def test_words__not_significant_is_never_a_no():
    rq1, rq2 = verdict_texts(campaign(personas=["speedy"], failing={"naive": 0.05, "retrained": 0.2}))
    assert rq1[0] == "RQ1: not shown"
    assert f"fails in 3 of 60 games against the speedy driver and in 0 of 60 alone: {CHANCE}" in rq1[1]
    assert rq2[0] == "RQ2: not shown"
    assert f"the retrained ego fails in 12 of 60 games, the naive ego in 3 of 60: {CHANCE}" in rq2[1]


def test_words__significant_before_holm_only_is_not_a_yes():
    arguments = campaign(personas=["speedy"], failing={"naive": 0.1})
    failure = arguments["comparisons"].index[0]
    arguments["comparisons"].loc[failure, "p_holm"] = 0.025
    arguments["comparisons"].loc[failure, "verdict"] = Verdict.BEFORE_HOLM_ONLY.value
    rq1, _ = verdict_texts(arguments)
    assert rq1[0] == "RQ1: only before Holm's correction"
    assert "significantly more often without correction, but not after Holm's correction" in rq1[1]
    assert "p = 0.025 after Holm's correction" in text_of(arguments).replace("\N{NO-BREAK SPACE}", " ")


def test_words__all_differences_equal_names_mcnemars_p_and_never_says_significant():
    rq1, _ = verdict_texts(campaign(personas=["speedy"], failing={"naive": 1}))
    assert rq1[0] == "RQ1: no t statistic"
    assert NO_T_STATISTIC.format(pairs=60) in rq1[1]
    assert "McNemar's exact test gives p < 0.0001. This is below the campaign's significance" in rq1[1]
    assert "significantly" not in rq1[1]


def test_words__an_arm_that_was_not_played_is_named():
    arguments = campaign(personas=["speedy"])
    rq1, rq2 = verdict_texts(with_errors(arguments, arguments["episodes"]["arm"] == "retrained_vs_speedy"))
    assert rq1[0] == "RQ1: yes"
    assert rq2 == ("RQ2: not answered", NOT_PLAYED)


def test_words__a_stage_that_is_not_done_leaves_its_question_not_answered():
    arguments = without_arm(campaign(personas=["speedy"]), "retrained_vs_speedy", seeds=[1])
    assert verdict_texts(arguments)[1] == ("RQ2: not answered", NOT_PLAYED)
    arguments = without_arm(campaign(personas=["speedy"], seeds=(1, 2)), "retrained_vs_speedy", seeds=[2])
    assert verdict_texts(arguments)[1][0] == "RQ2: yes in 1 of 2 seeds"
    assert f"Seed 2: not answered. {NOT_PLAYED}" in text_of(arguments)


def without_arm(arguments, arm, seeds):
    """The campaign with a failed arm: it has neither games nor comparisons."""
    rows, compared = arguments["episodes"], arguments["comparisons"]
    lost = (compared["question"] == "RQ2") & compared["seed"].isin(seeds)
    arguments["episodes"] = rows[~((rows["arm"] == arm) & rows["seed"].isin(seeds))]
    arguments["comparisons"] = compared[~lost]
    arguments["summary"] = summarise(arguments["episodes"])
    for seed in seeds:
        arguments["manifest"]["stages"][f"{arm}-seed{seed}"] |= {"status": "failed", "message": "it died"}
    return arguments


def test_words__without_retraining_round_2_was_not_played():
    arguments = campaign(personas=["speedy"], retrained=False)
    rq1, rq2 = verdict_texts(arguments)
    assert rq1[0] == "RQ1: yes"
    assert rq2[1] == NO_ROUND_2
    assert "retrained vs" not in without_curves(arguments)


def test_words__several_seeds_are_counted_and_shown_each():
    arguments = campaign(personas=["speedy"], seeds=(1, 2, 3))
    episodes = arguments["episodes"]
    tame = (episodes["arm"] == "naive_vs_speedy") & (episodes["seed"] == 2)
    episodes.loc[tame, ["ego_failed"]] = 0
    episodes.loc[tame, ["ego_outcome"]] = "goal"
    rq1, rq2 = verdict_texts(recomputed(arguments))
    assert rq1[0] == "RQ1: yes in 2 of 3 seeds"
    assert rq1[1].startswith("In 2 of 3 training seeds the speedy driver makes the naive ego fail significantly more")
    assert rq2[0] == "RQ2: yes in 2 of 3 seeds"
    text = text_of(arguments)
    assert "Seed 1: yes." in text
    assert "Seed 2: no difference." in text


@pytest.mark.parametrize("question", ["RQ1", "RQ2"])
@pytest.mark.parametrize("verdict", list(Verdict))
def test_words__only_significant_is_a_yes(verdict, question, small):
    row = {
        "question": question,
        "persona": "speedy",
        "seed": 1,
        "verdict": verdict.value,
        "pairs": 60,
        "pairs_left_out": 0,
    }
    row |= {"p_value": 0.004, "p_holm": 0.02, "mcnemar_p": 0.004, "reason": "the speedy driver can't drive this scene"}
    row |= {"mean_difference": 0.3, "ci_low": 0.1, "ci_high": 0.5}
    rows = [row | {"metric": metric} for metric in ("failure", "mean_speed")]
    found = answered(question, rows, small)
    yes = verdict is Verdict.SIGNIFICANT
    assert (found.label == "yes") == yes
    assert (found.tone != "open") == yes
    assert found.sentence.endswith(".")
    if verdict in INCOMPETENT:  # no number of the games is an answer
        assert (found.label, found.tone, found.speed) == (verdict.value, "open", "")
        assert found.sentence == "The speedy driver can't drive this scene."
        return
    assert found.speed.endswith(".")
    for text in (found.sentence, found.speed):
        if verdict in (Verdict.NO_DIFFERENCE, Verdict.ALL_EQUAL, Verdict.NOT_ENOUGH_PAIRS):
            assert "significantly" not in text
    if verdict is Verdict.NOT_SIGNIFICANT:
        assert CHANCE in found.sentence


SPEEDS = {"mean_speed_mps": 13.5}


@pytest.mark.parametrize(
    ("question", "mean", "half_width", "p_value", "words"),
    [
        ("RQ2", -0.6, 0.1, 1.0, "slower"),  # one-tailed p = 1: what the question asks for is not so, the reverse is
        ("RQ2", 0.6, 0.1, 1e-6, "faster"),
        ("RQ1", 0.6, 0.1, 1e-6, "slower"),
        ("RQ1", 0.6, 1.0, 0.2, CHANCE),
        ("RQ1", 0.02, 0.01, 0.0002, "no relevant difference (less than 0.25 m/s)"),
    ],
)
def test_speed__is_judged_in_both_directions_and_by_its_size(question, mean, half_width, p_value, words):
    row = {"question": question, "verdict": Verdict.NOT_SIGNIFICANT.value, "pairs": 100, "mean_difference": mean}
    row |= {"ci_low": mean - half_width, "ci_high": mean + half_width, "p_value": p_value}
    text = speed_sentence(row, SPEEDS, SPEEDS, 0.01).replace("\N{NO-BREAK SPACE}", " ")
    assert text == f"Average speed: 13.50 m/s instead of 13.50 m/s: {words}."


def test_words__one_seed_of_several_is_enough_for_harm_but_not_for_mended():
    arguments = campaign(personas=["speedy"], seeds=(1, 2))
    arguments["comparisons"].loc[arguments["comparisons"]["seed"] == 2, "verdict"] = Verdict.NOT_SIGNIFICANT.value
    for question, tone in (("RQ1", "harm"), ("RQ2", "open")):
        found = answered(question, arguments["comparisons"], arguments)
        assert (found.label, found.tone) == ("yes in 1 of 2 seeds", tone)


def test_words__a_person_that_cannot_drive_leaves_both_questions_unanswered():
    arguments = cannot_drive(campaign(personas=["speedy"]), [1])
    for label, sentence in verdict_texts(arguments):
        assert label.endswith(": not answered: the person can't drive this scene")
        assert sentence == (
            "The speedy driver can't drive this scene: alone it reaches its goal in 0 of 60 games (0 %), below 80 %."
        )
    arguments["manifest"]["campaign"]["competence"] = {"ego_goal_share": 0.97, "non_ego_goal_share": 0.8}
    text = text_of(arguments).replace("\N{NO-BREAK SPACE}", " ")
    assert "in a share of games: 97 % of an ego, 80 % of a non-ego." in text
    assert "1 training did not learn to drive this scene." in text
    stopped = "did not learn: goal in 0 of 60 games alone, at least 80 % asked"
    assert f"speedy-seed1: {stopped}" in text
    (stage,) = [row for row in Page(without_curves(arguments)).tables["stages"] if row[0]["text"] == "speedy-seed1"]
    assert stopped in [cell["text"].replace("\N{NO-BREAK SPACE}", " ") for cell in stage]
    assert not any("significantly" in sentence for _, sentence in verdict_texts(arguments))


@pytest.mark.parametrize(
    ("value", "text"),
    [(-0.004, "\N{MINUS SIGN}0.004"), (-0.05, "\N{MINUS SIGN}0.05"), (0.004, "0"), (0.0, "0"), (-0.0, "0")],
)
def test_numbers__that_round_to_0_keep_their_sign(value, text):
    assert signed(value, 2) == text


def test_p_values__are_never_rounded_to_0_or_1():
    assert [p_number(p) for p in (0.00031, 0.0123, 0.5, 1.0)] == ["0.0003", "0.0123", "0.5", "1"]
    assert p_text(1e-30) == "p\N{NO-BREAK SPACE}<\N{NO-BREAK SPACE}0.0001"
    assert p_number(0.99999) == ">\N{NO-BREAK SPACE}0.999"
    assert (p_number(math.nan), p_text(math.nan)) == ("–", "no p-value")


def test_numbers__have_a_typographic_form():
    assert (number(-1.5, 1), number(-0.001, 2), number(math.nan, 1)) == ("\N{MINUS SIGN}1.5", "0.00", "–")
    assert [percent(share) for share in (0.25, 0.0362, 1)] == [
        f"{text}\N{NO-BREAK SPACE}%" for text in ("25", "3.6", "100")
    ]
    assert [duration(s) for s in (12.34, 59.99, 185, 3725, None)] == [
        "12.3 s", "1 min 00 s", "3 min 05 s", "1 h 02 min", "–",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("question", "metric", "mean", "words"),
    [
        ("RQ1", "failure", 0.25, "25 points more failures (95 %: 15 to 35)"),
        ("RQ1", "failure", -0.25, "25 points fewer failures (95 %: 15 to 35)"),
        ("RQ2", "failure", 0.25, "25 points fewer failures (95 %: 15 to 35)"),
        ("RQ1", "mean_speed", 0.25, "0.25 m/s slower (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", 0.25, "0.25 m/s faster (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", -0.25, "0.25 m/s slower (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", 0.098, "0.1 m/s faster (95 %: \N{MINUS SIGN}0.002 to 0.2)"),
    ],
)
def test_effect__names_the_direction_it_has(question, metric, mean, words):
    row = {"question": question, "metric": metric, "mean_difference": mean}
    row |= {"ci_low": mean - 0.1, "ci_high": mean + 0.1}
    assert effect(row).replace("\N{NO-BREAK SPACE}", " ") == words


# --- banners ---


def test_banner__stages_that_are_not_done_are_named_with_their_message(page):
    arguments = campaign()
    stages = arguments["manifest"]["stages"]
    stages["retrained_speedy-seed1"] |= {"status": "failed", "message": "the worker <died>"}
    stages["retrained_vs_speedy-seed1"] |= {"status": "pending", "seconds": None}
    text = text_of(arguments)
    assert f"2 of {len(stages)} stages are not done." in text
    assert "retrained_speedy-seed1: failed: the worker <died>" in text
    assert "retrained_vs_speedy-seed1: pending" in text
    assert "not done" not in page.text


def test_next_steps__a_person_that_did_not_learn_may_imitate_a_driver(page):
    sentence, line = "speedy did not learn to drive here.", "imitation = true"
    told = text_of(cannot_drive(campaign(personas=["speedy"]))).split("What to do next")[1]
    assert sentence in told
    assert line in told
    assert line not in page.text
    imitating = cannot_drive(campaign(personas=["speedy"]))
    imitating["manifest"]["campaign"]["non_ego_training"] = {"imitation": True}
    assert sentence not in text_of(imitating), "it has been tried"
    on_foot = text_of({**cannot_drive(campaign(personas=["speedy"])), "non_ego_drives": False})
    assert sentence not in on_foot, "there is no demonstrator on foot"
    assert "Does this person cause failures?" in on_foot


def test_banner__games_that_could_not_be_played_are_counted_by_arm(page):
    arguments = campaign()
    rows = arguments["episodes"]
    text = text_of(with_errors(arguments, (rows["arm"] == "naive_vs_speedy") & (rows["episode"] < 3)))
    assert f"3 of {len(rows)} games could not be played." in text
    assert "naive_vs_speedy, seed 1: 3" in text
    assert "3 games: the simulator died" in text
    assert "could not be played." not in page.text.split("Figures")[0]


# --- replays ---


def test_replays__are_worst_first_as_the_command_lists_them(small, page):
    expected = [
        replay_name(game["arm"], game["seed"], game["episode"])
        for game in worst_first(choose_games(small["episodes"])).to_dict("records")
    ]
    commands = re.findall(r"sumo-gui -c replays/(\S+)/scene.sumocfg", page.text)
    assert commands == expected[:REPLAYS_SHOWN]
    assert f"{len(expected) - REPLAYS_SHOWN} more games are in replays" in page.text


def test_replays__each_has_the_command_that_opens_it(page):
    assert "harness replay . naive_vs_speedy 6" in page.text
    assert "--seed" not in page.text
    assert "harness replay . naive_vs_speedy 6 --seed 2" in text_of(campaign(personas=["speedy"], seeds=(1, 2)))


def test_replays__those_that_the_page_can_play_are_links(small):
    html = without_curves(small | recordings(small))
    assert '<a href="#game=naive_vs_speedy,1,6">naive_vs_speedy, game 6</a>' in html
    assert '<a href="#game=naive' not in without_curves(small)


# --- the file itself ---


def test_page__is_the_same_bytes_for_the_same_input(small):
    once, again = (without_curves(small | recordings(small)) for _ in range(2))
    assert once == again


def test_page__names_from_documents_stay_text():
    hostile = "<script>alert(1)</script>"
    arguments = campaign(personas=[hostile, "\"><img src=x onerror='alert(2)'>", "$\\frac{"])
    arguments["manifest"]["name"] = hostile
    arguments["manifest"]["versions"] |= {hostile: hostile}
    with_errors(arguments, arguments["episodes"]["episode"] == 0)
    html = rendered(**arguments, **recordings(arguments))
    page = Page(html)
    assert hostile in page.text
    assert {tag for tag, _ in page.tags}.isdisjoint({"img", "iframe", "object", "link", "base"})
    assert [tag for tag, _ in page.tags].count("script") == 6  # two tables, games, games elsewhere, libraries, own
    assert not [name for _, attributes in page.tags for name in attributes if name.startswith("on")]


def test_page__loads_nothing(html, page):
    named = re.findall(r"https?://[^\s\"'`<>)]*", html)
    harmless = ("http://www.w3.org/", "https://github.com/leeoniya/uPlot", "https://datatables.net")  # names, comments
    assert [each for each in named if not each.startswith(harmless)] == []
    assert not [attributes for _, attributes in page.tags if "src" in attributes]
    assert "@import" not in html
    styles = re.sub(r"<script.*?</script>", "", html, flags=re.DOTALL)
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", styles))
    (policy,) = [a["content"] for tag, a in page.tags if tag == "meta" and "http-equiv" in a]
    assert policy.startswith("default-src 'none'")


def test_page__every_id_is_there_once_and_every_reference_has_one(html, page):
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = {a["href"][1:] for _, a in page.tags if a.get("href", "").startswith("#")}
    assert targets | set(re.findall(r"url\(#([^)]*)\)", html)) <= set(ids)


def test_page__every_figure_says_what_it_shows(page):
    figures = [attributes for tag, attributes in page.tags if tag == "svg"]
    assert len(figures) == 2 * 4 + 5  # four per persona, one per training stage
    assert all(attributes["role"] == "img" and len(attributes["aria-label"]) > 40 for attributes in figures)
    assert "naive vs speedy: 30\N{NO-BREAK SPACE}%" in figures[0]["aria-label"] + figures[1]["aria-label"]
    assert [tag for tag, _ in page.tags].count("figcaption") == len(figures)


def test_page__figures_take_their_colours_from_the_page(html):
    figures = "".join(re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL))
    assert "currentColor" in figures
    assert "var(--persona)" in figures
    assert not re.findall(r"#[0-9a-f]{6}\b", figures)
    assert "<text" in figures


def test_page__every_table_has_a_caption_and_scoped_headings(html, page):
    assert html.count("<table") == html.count("<caption>")
    assert all("scope" in attributes for tag, attributes in page.tags if tag == "th")


def test_page__an_empty_run_is_a_page_too():
    page = Page(rendered(manifest={"name": "merge", "stages": {}}))
    assert "No persona has been assessed yet." in page.text


def test_page__ignores_the_users_matplotlib_settings(small, html):
    import matplotlib

    with matplotlib.rc_context({"font.size": 30, "text.usetex": True, "axes.facecolor": "red"}):
        assert rendered(**small) == html


# --- manoeuvres ---


def test_causes__failures_are_counted_by_cause_response_and_arm(small):
    page = Page(without_curves(small | recordings(small)))
    heading, *rows = [[cell["text"] for cell in row] for row in page.tables["pairs"]]
    episodes = small["episodes"]
    failed = episodes[episodes["ego_failed"].fillna(0) == 1]
    assert heading[:3] == ["cause", "response", "failures"]
    assert sum(int(row[2]) for row in rows) == len(failed)
    assert sum(int(row[heading.index("naive_vs_speedy")]) for row in rows) == (failed["arm"] == "naive_vs_speedy").sum()
    assert [row[:2] for row in rows] == [["cut-in", "swerves"], ["drift", "brakes"]]
    assert all(sum(map(int, row[3:])) == int(row[2]) for row in rows)


def test_causes__each_opens_its_games_shortly_before_it(small):
    html = without_curves(small | recordings(small))
    link = '<a href="#game=naive_vs_speedy,1,6&amp;t=2.5">naive_vs_speedy, game 6</a>'
    assert f"{link}: collision (cuts in from the left, 1.2 s before the end)" in html
