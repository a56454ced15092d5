"""Round 2 of an ego that can't be trained, through the real command: planned, resumed, reported, and used again."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import signal
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.planned_drivers import Reconfigured
from harness.campaign.plan.stages import AssessmentStage, SearchStage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.config.driver import read_driver
from harness.evaluation.tables import read_csv
from harness.training.parameter_search import read_trials
from tests.support import shipped
from tests.support.external_drivers import document, find, problems
from tests.support.plans import planned
from tests.support.repository import REPOSITORY
from tests.support.shipped import PERSON, stage
from tests.support.tiny import (
    CAREFUL,
    PAPER_SPEEDY,
    SHIPPED,
    begin,
    carried_out,
    end,
    finished,
    harness,
    numbers,
    wait_for,
    write_campaign,
)

ADAS = REPOSITORY / "egos" / "adas.toml"
SEARCH = {"trials": 8, "games": 16, "games_at_once": 8}
PERSONA = shipped.SPEEDY
AGAINST, RECONFIGURED, RECONFIGURED_ALONE = (
    f"{each}_{PERSONA}" for each in ("naive_vs", "reconfigured_vs", "reconfigured_alone")
)
STAGE = stage(f"reconfigured_{PERSONA}")


def searched(driver: object = ADAS, **changes: Any) -> dict[str, Any]:
    """A campaign that trains nothing, and plays nothing but what is asked for here."""
    ego = {"driver": str(driver), "persona": str(CAREFUL)}
    return {**SHIPPED, "ego": ego, "reconfiguration": SEARCH, **changes}


# --- the plan ---


def test_plan__of_an_ego_with_something_to_tune(tmp_path: Path) -> None:
    trained, _ = planned(tmp_path, **searched(seeds=[1, 7], policies=None))
    trainings = {id for id, stage in trained.items() if isinstance(stage, TrainingStage)}
    assert trainings == {f"{PERSONA}-seed{seed}" for seed in (1, 7)}
    for seed in (1, 7):
        search = trained[f"reconfigured_{PERSONA}-seed{seed}"]
        assert isinstance(search, SearchStage)
        assert (search.needs, search.reads) == ((f"{PERSONA}-seed{seed}",), ())
        for arm in (f"vs_{PERSONA}", f"alone_{PERSONA}"):
            stage = trained[f"reconfigured_{arm}-seed{seed}"]
            assert isinstance(stage, AssessmentStage)
            assert search.id in stage.needs
            assert stage.ego == (Reconfigured(stage=search.id),)
    assert not [id for id in trained if "retrained" in id]

    before, _ = planned(tmp_path, **searched())
    assert (before[STAGE].needs, before[STAGE].reads) == ((), (PERSON,))
    assert not [stage for stage in before.values() if isinstance(stage, TrainingStage)]


def test_questions__compare_naive_with_reconfigured(tmp_path: Path) -> None:
    campaign = open_campaign(write_campaign(tmp_path, **searched()))
    asked = {each.question: (each.baseline, each.treatment) for each in questions(campaign.document, [PERSONA], True)}
    assert asked == {"RQ1": ("naive_alone", AGAINST), "RQ2": (AGAINST, RECONFIGURED)}


SEARCHED = {STAGE, stage(RECONFIGURED), stage(RECONFIGURED_ALONE)}


def with_tunable(text: str, low: float) -> str:
    return text + f'\n[tunable]\n"cruise.time_gap_s" = [{low}, 2.5]\n'


@pytest.mark.parametrize(
    ("change", "redone"),
    [
        ({}, set()),
        ({"reconfiguration": {**SEARCH, "trials": 9}}, SEARCHED),
        ({"reconfiguration": {**SEARCH, "alone_share": 0.5}}, SEARCHED),
        ({"tunable": lambda text: with_tunable(text, 0.9)}, SEARCHED),
        ({"assessment": {"episodes": 5}}, None),
    ],
    ids=["nothing", "trials", "alone_share", "tunable", "episodes"],
)
def test_keys__of_a_search_change_with_what_it_is_made_of_and_with_no_more(
    change: dict[str, Any], redone: set[str] | None, tmp_path: Path
) -> None:
    text = ADAS.read_text()
    driver = document(tmp_path, with_tunable(text, 0.8), "adas.toml")
    stages, keys = planned(tmp_path, **searched(tmp_path / driver))
    if tunable := change.pop("tunable", None):
        document(tmp_path, tunable(text), "adas.toml")
    _, other = planned(tmp_path, **searched(tmp_path / driver, **change))
    changed = {name for name, key in keys.items() if key != other[name]}
    assert changed == ({*stages} - {STAGE} if redone is None else redone)


# --- what is refused ---


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"ego": {"persona": str(CAREFUL)}}, "reconfiguration: this ego is trained: the table would be ignored"),
        ({"ego": {"driver": "sumo", "persona": str(CAREFUL)}}, "reconfiguration: this ego has nothing to tune"),
        ({"driver": REPOSITORY / "egos" / "rss.toml"}, "reconfiguration: this ego has nothing to tune"),
        ({"policies": None, "retraining": {"alone_share": 0.5}}, "retraining: this ego is not trained"),
        ({"reconfiguration": {"trials": 1}}, "reconfiguration.trials: 1 is not possible"),
        ({"reconfiguration": {"trails": 5}}, "reconfiguration.trails: unknown key (did you mean 'trials'?)"),
        ({"reconfiguration": "long"}, "reconfiguration: 'long' is not possible"),
    ],
)
def test_check__a_table_that_would_be_ignored_or_can_not_be_is_an_error(
    changes: dict[str, Any], said: str, tmp_path: Path
) -> None:
    found = problems(write_campaign(tmp_path, **searched(**changes)))
    assert [each for each in found if said in each], found


def test_check__a_persona_may_not_be_called_as_a_search_is(tmp_path: Path) -> None:
    text, given = PAPER_SPEEDY.read_text(), f'name = "{PERSONA}"'
    names = ("anna", "reconfigured_anna")
    files = [document(tmp_path, text.replace(given, f'name = "{name}"'), f"{name}.toml") for name in names]
    (said,) = problems(write_campaign(tmp_path, **searched(policies=None, personas=files)))
    assert "two stages would be called 'reconfigured_anna-seed11'" in said


def test_check__says_what_will_be_searched(tmp_path: Path) -> None:
    told = harness("check", write_campaign(tmp_path, **searched())).stdout
    assert "Round 2 searches its parameters in 8 trials of 16 games: cruise.speed_share from 0.7 to 1, " in told
    assert f"  tune   {STAGE}  with {PERSON}" in told
    assert "nothing is trained, 6 arms of 4 episodes" in told


# --- whole campaigns (each a start of a program that takes seconds to start) ---


@pytest.fixture
def run() -> Path:
    return finished(**searched(name="reconfigured"))


@pytest.mark.slow
def test_campaign__every_trial_is_in_the_table_and_the_best_is_chosen(run: Path) -> None:
    table = read_csv(run / "reconfiguration.csv")
    searched = read_driver(ADAS).searched  # type: ignore[union-attr]
    assert len(table) == 8 * len(searched)
    assert set(table["stage"]) == {f"reconfigured_{PERSONA}"}
    trials = table.drop_duplicates("trial").set_index("trial")
    assert trials["best_payoff"].tolist() == trials["mean_payoff"].cummax().tolist()
    chosen = table[table["chosen"]]
    assert chosen["trial"].nunique() == 1
    assert set(chosen["mean_payoff"]) == {table["mean_payoff"].max()}
    found = read_driver(run / "policies" / STAGE / "driver.toml")
    given = read_driver(ADAS)
    values = {row.parameter: row.value for row in chosen.itertuples()}
    first = {row.parameter: row.value for row in table[table["trial"] == 0].itertuples()}
    assert first == {key: given.numbers[key] for key in first}  # type: ignore[union-attr]
    assert found == given.tuned(values)  # type: ignore[union-attr]


@pytest.mark.slow
def test_campaign__naive_and_reconfigured_are_compared_as_naive_and_retrained_are(run: Path) -> None:
    comparisons, episodes = read_csv(run / "comparisons.csv"), read_csv(run / "episodes.csv")
    assert set(episodes["arm"]) == {
        *("naive_alone", "naive_vs_sumo", f"{PERSONA}_alone", AGAINST),
        *(RECONFIGURED, RECONFIGURED_ALONE),
    }
    versions = json.loads((run / "manifest.json").read_text())["stages"][STAGE]["versions"]
    assert [set(each) > {"optuna", "libsumo"} for each in versions] == [True]
    (row,) = comparisons.query("question == 'RQ2' and metric == 'mean_speed'").to_dict("records")
    speeds = {arm: games.set_index("episode")["ego_mean_speed_mps"] for arm, games in episodes.groupby("arm")}
    assert row["mean_difference"] == pytest.approx((speeds[RECONFIGURED] - speeds[AGAINST]).mean())


@pytest.mark.slow
def test_campaign__the_report_and_the_terminal_say_reconfigured(run: Path) -> None:
    page = html.unescape((run / "report.html").read_text())
    assert f"<code>policies/{STAGE}/driver.toml</code> in the run folder" in page
    assert re.search(
        r"<th scope=\"row\">cruise.time_gap_s</th><td>1.5</td><td>[\d.]+</td><td>0.8</td><td>2.5</td>", page
    )
    assert re.search(r"8 trials; the best is trial \d: mean payoff|8 trials, none better", page)
    printed = (run.parent / "printed").read_text()
    assert "mixes versions" not in printed
    assert "8 trials in" in printed
    assert f"{PERSONA}, RQ2: " in printed
    assert "reconfigured ego" in printed or "Reconfiguration" in printed


@pytest.mark.slow
def test_campaign__the_driver_that_was_found_is_an_ego_that_plays_the_same_games(run: Path, tmp_path: Path) -> None:
    found = run / "policies" / STAGE / "driver.toml"
    assert found.read_text().startswith("# the rules adas (")
    driver = document(tmp_path, found.read_text() + "\n[tunable]\n")
    carried_out(write_campaign(tmp_path, **searched(driver, reconfiguration=None)), tmp_path / "run")
    theirs, ours = read_csv(run / "episodes.csv"), read_csv(tmp_path / "run" / "episodes.csv")
    for now, then in ((AGAINST, RECONFIGURED), ("naive_alone", RECONFIGURED_ALONE)):
        both = ours[ours["arm"] == now], theirs[theirs["arm"] == then]
        rows = [games.drop(columns=["arm", "persona"]).reset_index(drop=True) for games in both]
        pd.testing.assert_frame_equal(*rows)
    page = html.unescape((tmp_path / "run" / "report.html").read_text())
    assert "0 and 1: this ego has nothing to train or to tune" in page
    assert "Round 2 was not played: the campaign trains and tunes no ego in it." in page
    assert not (tmp_path / "run" / "reconfiguration.csv").exists()


def trials_of(run: Path) -> int:
    return len(read_trials(run / ".stages" / STAGE / "trials.json"))


@pytest.mark.slow
def test_campaign__killed_in_its_search_goes_on_and_ends_the_same(run: Path, tmp_path: Path) -> None:
    campaign, again = run.with_suffix(".toml"), tmp_path / "run"
    for signal_number, trials in ((signal.SIGKILL, 2), (signal.SIGINT, 5)):
        process = begin("campaign", campaign, "--out", again, "--jobs", 1)
        wait_for(lambda trials=trials: trials_of(again) >= trials, f"{trials} trials are kept")  # type: ignore[misc]
        os.kill(process.pid, signal_number)
        end(process)
        assert trials <= trials_of(again) < 8
    carried_out(campaign, again)
    assert numbers(again) == numbers(run)


@pytest.mark.slow
def test_campaign__what_is_damaged_of_a_search_is_noticed_and_made_again(run: Path, tmp_path: Path) -> None:
    again = shutil.copytree(run, tmp_path / "run")
    damaged = [again / "policies" / STAGE / "driver.toml", again / ".stages" / STAGE / "reconfiguration.csv"]
    damaged[0].unlink()
    damaged[1].write_text("stage\n")
    refused = harness("report", again)
    assert refused.returncode == 2
    for file in damaged:
        assert f"{file}: is missing, or is not what the campaign wrote" in refused.stderr
    assert f"started  {STAGE}" in carried_out(run.with_suffix(".toml"), again)
    assert numbers(again) == numbers(run)


@pytest.mark.slow
def test_campaign__a_program_that_plays_one_game_at_a_time_is_searched_so(tmp_path: Path) -> None:
    shutil.copytree(REPOSITORY / "egos" / "examples" / "process", tmp_path / "perl")
    program = (tmp_path / "perl" / "drive.pl").read_text()
    alone = program.replace("my ($rows)", 'die "one at a time" if $line =~ /"games": \\[0, /; my ($rows)', 1)
    assert alone != program
    (tmp_path / "perl" / "drive.pl").write_text(alone)
    text = (tmp_path / "perl" / "perl.toml").read_text()
    (tmp_path / "perl" / "perl.toml").write_text(text + "[parameters]\na = 1.0\n[tunable]\na = [0.0, 2.0]\n")
    (said,) = problems(write_campaign(tmp_path, **searched("perl/perl.toml")))
    assert "one at a time" in said
    search = {"trials": 2, "games": 2, "games_at_once": 1}
    changes = searched("perl/perl.toml", reconfiguration=search, assessment={"episodes": 2})
    carried_out(write_campaign(tmp_path, **changes), tmp_path / "run", "--allow-code")
    table = read_csv(tmp_path / "run" / "reconfiguration.csv")
    assert table["mean_payoff"].nunique() == 1  # it heeds no parameter:
    assert table["chosen"].tolist() == [True, False]  # then what was given stays
    found = find(f"run/policies/{STAGE}/driver.toml", tmp_path)
    assert found.identity == find("perl/perl.toml", tmp_path).identity
