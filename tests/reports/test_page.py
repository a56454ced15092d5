from __future__ import annotations

import math
import re
from functools import partial

import pandas as pd
import pytest

from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import WITHHELD, Verdict
from harness.evaluation.realism import CRASHES, DECLARED
from harness.evaluation.tables import table_of
from harness.evaluation.worst_first import choose_games, replay_name, worst_first
from harness.reports import page as page_module
from harness.reports.differences import CHANCE, effect, p_values, speed_sentence
from harness.reports.numbers import duration, number, p_number, p_text, percent, signed, steps_text
from harness.reports.page import REPLAYS_SHOWN
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import NO_ROUND_2, answer, planned_in_words
from tests.support.pages import (
    Page,
    blank_figures,
    campaign,
    cannot_drive,
    plain,
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


@pytest.mark.parametrize(("driver", "games"), [("learned", 180), ("adas", 60)])
def test_counts__games_without_a_trained_player_count_once(driver, games):
    made = campaign(personas=["speedy"], seeds=[1, 2, 3], retrained=False)
    made["manifest"]["campaign"]["ego"]["driver"] = driver
    tables = RunTables(**made)
    assert [tables.counts_of(arm)[1] for arm in ("naive_alone", "naive_vs_sumo")] == [games, games]
    assert tables.counts_of("naive_vs_speedy")[1] == 180


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
    answer = r"<strong>[^<]*\? (.*?)</strong> <span>(.*?)</span>"
    found = re.findall(rf'class="answer">{answer}.*?class="sentence">(.*?)</p>', html, flags=re.DOTALL)
    plain = [[re.sub(r"\s+", " ", part.replace("&#39;", "'").replace("&lt;", "<")) for part in each] for each in found]
    return [
        (f"{question}: {label[0].lower()}{label[1:]}", sentence.replace("\N{NO-BREAK SPACE}", " "))
        for label, question, sentence in plain
    ]


def not_played():
    arguments = campaign(personas=["speedy"])
    return with_errors(arguments, arguments["episodes"]["arm"] == "retrained_vs_speedy")


def without_arm(seeds, failed):
    """A campaign with a failed arm of round 2: it has neither games nor comparisons."""
    arguments = campaign(personas=["speedy"], seeds=seeds)
    rows, compared, arm = arguments["episodes"], arguments["comparisons"], "retrained_vs_speedy"
    arguments["episodes"] = rows[~((rows["arm"] == arm) & (rows["seed"] == failed))]
    arguments["comparisons"] = compared[~((compared["question"] == "RQ2") & (compared["seed"] == failed))]
    arguments["summary"] = summarise(arguments["episodes"])
    arguments["manifest"]["stages"][f"{arm}-seed{failed}"] |= {"status": "failed", "message": "it died"}
    return arguments


def tame_in_one_seed():
    arguments = campaign(personas=["speedy"], seeds=(1, 2, 3))
    episodes = arguments["episodes"]
    tame = (episodes["arm"] == "naive_vs_speedy") & (episodes["seed"] == 2)
    episodes.loc[tame, ["ego_failed", "ego_outcome"]] = [0, "goal"]
    return recomputed(arguments)


def failing(**shares):
    return partial(campaign, personas=["speedy"], failing=shares)


@pytest.mark.parametrize(
    ("arguments", "label", "sentence"),
    [
        (
            failing(naive=0.05),
            "RQ1: not shown",
            f"3 of 60 games against the speedy driver and in 0 of 60 alone: {CHANCE}",
        ),
        (failing(naive=0.05, retrained=0.2), "RQ2: not shown", "12 of 60 games, the naive ego in 3 of 60: not fewer."),
        (failing(naive=1), "RQ1: yes", "makes the naive ego fail in 60 of 60 games instead of 0 of 60"),
        (not_played, "RQ1: yes", "makes the naive ego fail in 18 of 60 games instead of 0 of 60"),
        (not_played, "RQ2: not answered", NOT_PLAYED),
        (partial(without_arm, [1], 1), "RQ2: not answered", NOT_PLAYED),
        (partial(without_arm, [1, 2], 2), "RQ2: yes in 1 of 2 seeds", "In 1 of 2 it is not answered."),
        (partial(campaign, personas=["speedy"], retrained=False), "RQ2: not asked", NO_ROUND_2),
        (
            tame_in_one_seed,
            "RQ1: not shown",
            f"single trainings 0 to 30: {CHANCE}. Each trained pair by itself: yes in 2 of 3.",
        ),
        (
            partial(campaign, personas=["speedy"], seeds=(1, 2, 3)),
            "RQ2: yes",
            "Over 3 trainings, the retrained ego against the speedy driver, compared with the naive ego: "
            "26.7 points fewer failures (95 %: ",
        ),
    ],
)
def test_words__say_no_more_than_the_verdict(arguments, label, sentence):
    answers = dict(verdict_texts(arguments()))
    assert label in answers
    assert sentence in answers[label]


@pytest.mark.parametrize(
    ("seeds", "about", "tests"),
    [
        ((1,), "this trained pair", "one of 4 planned tests; trainings like this need 3 training seeds"),
        ((1, 2), "this trained pair", "one of 8 planned tests; trainings like this need 3 training seeds"),
        ((1, 2, 3), "trainings like this", "one of 4 planned tests"),
    ],
)
def test_words__say_what_the_verdict_is_about_and_of_how_many_tests_it_is_one(seeds, about, tests):
    run = RunTables(**campaign(seeds=seeds))
    found = answer(run, "RQ1", "speedy")
    assert (found.about, found.scope) == (about, f"About {about}, {tests}.")
    assert {each.about for each in found.per_seed} <= {"this trained pair"}
    pairs = f"{4 * len(seeds)} planned tests about this trained pair"
    over = ", and by itself over 4 planned tests about trainings like this" if len(seeds) > 2 else ""
    assert planned_in_words(run) == pairs + over


def test_words__a_question_that_most_trainings_do_not_answer_says_so():
    arguments = cannot_drive(campaign(personas=["speedy"], seeds=(1, 2, 3)), [1])
    found = answer(RunTables(**arguments), "RQ1", "speedy")
    assert (found.label, found.about) == ("not answered: not enough trainings", "trainings like this")
    assert found.sentence == (
        "The question is answered for 2 of 3 trainings, and trainings like this need 3 training seeds. "
        "Each trained pair by itself: yes in 2 of 3."
    )
    arguments = cannot_drive(campaign(personas=["speedy"], seeds=(1, 2, 3)), [1, 2, 3])
    found = answer(RunTables(**arguments), "RQ1", "speedy")
    assert found.label == "not answered: the person can't drive this scene"


def test_words__several_seeds_are_shown_each():
    text = text_of(tame_in_one_seed())
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
    row |= {"mean_difference": 0.3, "ci_low": 0.1, "ci_high": 0.5, "planned_tests": 2}
    rows = [row | {"metric": metric} for metric in ("failure", "mean_speed")]
    found = answered(question, rows, small)
    yes = verdict is Verdict.SIGNIFICANT
    assert (found.label == "yes") == yes
    assert (found.tone != "open") == yes
    assert found.sentence.endswith(".")
    if verdict in WITHHELD:  # no number of the games is an answer
        assert (found.label, found.tone, found.speed) == (verdict.value, "open", "")
        assert found.sentence == "The speedy driver can't drive this scene."
        return
    assert found.speed.endswith(".")
    for text in (found.sentence, found.speed):
        if verdict in (Verdict.NO_DIFFERENCE, Verdict.ALL_EQUAL, Verdict.NOT_ENOUGH_PAIRS):
            assert "significantly" not in text


def test_answer__of_a_person_that_declares_to_be_unlike_people_says_so(small):
    cells = {"player": "speedy", "seed": 1, "figure": "lane_change_s", "games": 90, "realistic": DECLARED}
    realism = table_of("realism", [{**cells, "value": 2.2, "people_low": 3.5, "people_high": 8.0}])
    plain = answered("RQ1", small["comparisons"], small)
    found = answered("RQ1", small["comparisons"], {**small, "realism": realism})
    note = "The speedy driver is unlike people, as its persona declares: lane change."
    assert found.sentence == f"{plain.sentence} {note}"
    assert found.label == plain.label == "yes"


def test_card__of_a_person_states_how_often_it_crashes_alone(small):
    crashes = {"player": "speedy", "seed": 1, "figure": CRASHES, "games": 60}
    crashes |= {"value": 1_460_064.0, "low": 777_423.0, "high": 2_496_755.0}
    text = text_of({**small, "realism": table_of("realism", [crashes])}).replace("\N{NO-BREAK SPACE}", " ")
    assert ", with 1.46 crashes per km (95 %: 0.777–2.497)." in text
    assert "crashes per km" not in text_of(small)


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
    assert "speedy-seed1: did not learn: goal in 0 of 60 games alone, at least 80 % asked" in text
    assert "significantly" not in "".join(sentence for _, sentence in verdict_texts(arguments))


def test_numbers__have_a_typographic_form():
    assert [p_number(p) for p in (0.00031, 0.0123, 0.5, 1.0)] == ["0.0003", "0.0123", "0.5", "1"]
    assert p_text(1e-30) == "p\N{NO-BREAK SPACE}<\N{NO-BREAK SPACE}0.0001", "never rounded to 0 or 1"
    assert p_number(0.99999) == ">\N{NO-BREAK SPACE}0.999"
    assert (p_number(math.nan), p_text(math.nan)) == ("–", "no p-value")
    assert (number(-1.5, 1), number(-0.001, 2), number(math.nan, 1)) == ("\N{MINUS SIGN}1.5", "0.00", "–")
    assert [percent(share)[:-2] for share in (0.25, 0.0362, 1)] == ["25", "3.6", "100"]
    kept = [signed(value, 2) for value in (-0.004, -0.05, 0.004, 0.0, -0.0)]
    assert kept == ["\N{MINUS SIGN}0.004", "\N{MINUS SIGN}0.05", "0", "0", "0"], "what rounds to 0 keeps its sign"
    durations = ["12.3 s", "1 min 00 s", "3 min 05 s", "1 h 02 min", "–"]
    assert [duration(s) for s in (12.34, 59.99, 185, 3725, None)] == durations
    steps = {400: "400", 999.6: "1 k", 150_000: "150 k", 999_499: "999 k", 999_500: "1 M", 1_234_567: "1.23 M"}
    assert {count: steps_text(count) for count in steps} == steps


def test_p_values__are_also_shown_after_holms_correction():
    row = {"p_value": 0.004, "p_holm": 0.025}
    assert p_values(row).replace("\N{NO-BREAK SPACE}", " ") == "p = 0.004; p = 0.025 after Holm's correction"


@pytest.mark.parametrize(
    ("question", "metric", "mean", "words"),
    [
        ("RQ1", "failure", 0.25, "25 points more failures (95 %: 15 to 35)"),
        ("RQ1", "failure", -0.25, "25 points fewer failures (95 %: 15 to 35)"),
        ("RQ2", "failure", 0.25, "25 points fewer failures (95 %: 15 to 35)"),
        ("RQ1", "mean_speed", 0.25, "0.25 m/s slower (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", 0.25, "0.25 m/s faster (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", -0.25, "0.25 m/s slower (95 %: 0.15 to 0.35)"),
        ("RQ2", "person_failure", 0.25, "25 points more failures of people (95 %: 15 to 35)"),
        ("RQ2", "follower_braking", -0.25, "0.25 m/s² gentler braking of the follower (95 %: 0.15 to 0.35)"),
        ("RQ2", "mean_speed", 0.098, "0.1 m/s faster (95 %: \N{MINUS SIGN}0.002 to 0.2)"),
    ],
)
def test_effect__names_the_direction_it_has(question, metric, mean, words):
    row = {"question": question, "metric": metric, "mean_difference": mean}
    row |= {"ci_low": mean - 0.1, "ci_high": mean + 0.1}
    assert effect(row).replace("\N{NO-BREAK SPACE}", " ") == words


# --- banners ---


def test_banner__stages_and_games_that_failed_are_named_with_their_message(page):
    arguments = campaign()
    stages, rows = arguments["manifest"]["stages"], arguments["episodes"]
    stages["retrained_speedy-seed1"] |= {"status": "failed", "message": "the worker <died>"}
    stages["retrained_vs_speedy-seed1"] |= {"status": "pending", "seconds": None}
    text = text_of(with_errors(arguments, (rows["arm"] == "naive_vs_speedy") & (rows["episode"] < 3)))
    assert f"2 of {len(stages)} stages are not done." in text
    assert "retrained_speedy-seed1: failed: the worker <died>" in text
    assert "retrained_vs_speedy-seed1: pending" in text
    assert f"3 of {len(rows)} games could not be played." in text
    assert "naive_vs_speedy, seed 1: 3" in text
    assert "3 games: the simulator died" in text
    assert "not done" not in page.text
    assert "could not be played." not in page.text.split("Figures")[0]


def test_banner__policies_that_learned_in_other_games_are_named(page):
    arguments = campaign(personas=["speedy"])
    arguments["manifest"]["learned_elsewhere"] = {"mine/<policy>": "learned in other games: scene crossing, here merge"}
    told = "mine/<policy>: learned in other games: scene crossing, here merge"
    assert told in text_of(arguments)
    assert "learned in other games" not in page.text


def test_next_steps__a_player_that_did_not_learn_may_try_another_conflict(page):
    command = "harness scene new NAME --from MAP --list"
    assert command in text_of(cannot_drive(campaign(personas=["speedy"]))).split("What to do next")[1]
    assert command not in page.text


@pytest.mark.parametrize(
    ("quick", "command"), [(True, "harness campaign campaigns/merge.toml"), (False, "steps = 6000000")]
)
def test_next_steps__players_that_did_not_learn_may_train_longer(quick, command):
    arguments = cannot_drive(campaign(personas=["speedy"]))
    arguments["manifest"] |= {"quick": quick, "file": "campaigns/merge.toml"}
    arguments["manifest"]["campaign"]["training"]["steps"] = 3_000_000
    told = text_of(arguments).split("What to do next")[1]
    assert command in told
    assert f"{command} --quick" not in told


# --- replays ---


def test_replays__are_worst_first_as_the_command_lists_them(small, page):
    expected = [
        replay_name(game["arm"], game["seed"], game["episode"])
        for game in worst_first(choose_games(small["episodes"])).to_dict("records")
    ]
    commands = re.findall(r"sumo-gui -c replays/(\S+)/scene.sumocfg", page.text)
    assert commands == expected[:REPLAYS_SHOWN]
    assert f"{len(expected) - REPLAYS_SHOWN} more games are in replays" in page.text


def test_replays__each_has_the_command_that_opens_it(small, page):
    assert "harness replay . naive_vs_speedy 6" in page.text
    assert "--seed" not in page.text
    assert "harness replay . naive_vs_speedy 6 --seed 2" in text_of(campaign(personas=["speedy"], seeds=(1, 2)))
    link = '<a href="#game=naive_vs_speedy,1,6">naive_vs_speedy, game 6</a>'
    assert link in without_curves(small | recordings(small))
    assert link not in without_curves(small)


# --- the file itself ---


def test_page__is_the_same_bytes_for_the_same_input(small):
    once, again = (without_curves(small | recordings(small)) for _ in range(2))
    assert once == again


def test_page__permits_no_request(page):
    """That it makes none, test_browser.py says."""
    assert not [attributes for _, attributes in page.tags if "src" in attributes]
    (policy,) = [a["content"] for tag, a in page.tags if tag == "meta" and "http-equiv" in a]
    assert policy.startswith("default-src 'none'")


def test_page__every_id_is_there_once_and_every_reference_leads_to_one(html, page):
    """A published page stands alone: what lies beside it in the run folder is not there."""
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    links = {a["href"] for _, a in page.tags if "href" in a} | set(re.findall(r"url\((#[^)]*)\)", html))
    assert links <= {f"#{each}" for each in ids}


def test_page__every_figure_says_what_it_shows(page):
    figures = [attributes for tag, attributes in page.tags if tag == "svg"]
    assert len(figures) == 2 * 4 + 5  # four per persona, one per training stage
    assert all(attributes["role"] == "img" and len(attributes["aria-label"]) > 40 for attributes in figures)
    assert "naive vs speedy: 30\N{NO-BREAK SPACE}%" in figures[0]["aria-label"] + figures[1]["aria-label"]
    assert [tag for tag, _ in page.tags].count("figcaption") == len(figures)


def test_page__every_table_has_a_caption_and_scoped_headings(html, page):
    assert html.count("<table") == html.count("<caption>")
    assert all("scope" in attributes for tag, attributes in page.tags if tag == "th")


def test_page__an_empty_run_is_a_page_too():
    page = Page(rendered(manifest={"name": "merge", "stages": {}}))
    assert "No persona was assessed." in page.text


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


def test_acceptance__shows_three_broken_bounds_the_measured_ones_first(small):
    def check(persona, value):
        limit = value + 0.1
        numbers = {"value": value, "limit": limit, "allowed": 0.1, "games": 60}
        return Check(bound="failure_rate", persona=persona, seed=1, arm=f"naive_vs_{persona}", **numbers)

    people = [check("anna", math.nan), *(check(name, 0.1 * k) for k, name in enumerate(("bert", "cleo", "dora"), 3))]
    text = plain(Page(rendered(**small | {"acceptance": people})).text)
    places = [text.index(f"failures, {name}") for name in ("bert", "cleo", "dora", "anna")]
    assert places == sorted(places)
    assert places[2] < text.index("1 more not kept") < places[3]
    assert "more not kept" not in Page(rendered(**small | {"acceptance": people[1:]})).text
