"""Searches on the page: naive against reconfigured, the best over the trials, and the found parameters."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import pandas as pd

from harness.evaluation.strategies import ReconfiguredEgo, against_persona
from harness.evaluation.tables import table_of
from harness.reports.learning import searches
from harness.reports.provenance import rounds
from harness.reports.run_tables import QUESTIONS, RECONFIGURED
from tests.support.pages import Page, campaign, plain, rendered

PAYOFFS = (2.0, 1.5, math.nan, 4.25, 4.25)


def trials(seed: int = 1, payoffs: tuple[float, ...] = PAYOFFS, error: str = "ValueError: no") -> pd.DataFrame:
    """The table of a search of two parameters."""
    chosen = payoffs.index(max(each for each in payoffs if not math.isnan(each)))
    rows = [
        {
            **{"stage": "reconfigured_speedy", "persona": "speedy", "seed": seed},
            **{"trial": trial, "chosen": trial == chosen},
            **{"parameter": name, "value": 1.5 + 0.25 * trial, "low": -1.0, "high": 3.0},
            **{"mean_payoff": payoff, "failure_rate": 0.125, "best_payoff": max(payoffs[: trial + 1], key=_or_least)},
            "error": error if math.isnan(payoff) else "",
        }
        for trial, payoff in enumerate(payoffs)
        for name in ("gap_s", "<b>odd</b>")
    ]
    return table_of("reconfiguration", rows)


def _or_least(payoff: float) -> float:
    return -math.inf if math.isnan(payoff) else payoff


def reconfigured(**options: Any) -> dict[str, Any]:
    """The fields of RunTables for a campaign with an ego that was reconfigured, not retrained."""
    given = campaign(personas=["speedy"], **options)
    given["manifest"] = json.loads(json.dumps(given["manifest"]).replace("retrained", "reconfigured"))
    given["manifest"]["stages"]["reconfigured_speedy-seed1"] |= {"kind": "reconfiguration"}
    given["manifest"]["campaign"]["ego"]["driver"] = "adas.toml"
    for name in ("episodes", "summary"):
        given[name]["arm"] = given[name]["arm"].str.replace("retrained", "reconfigured")
    given["training"] = given["training"][:0]
    arm = against_persona(ReconfiguredEgo(against="speedy"), "speedy")
    given["arms"] = {**given["arms"], arm.name: arm}
    return given | {"replays": [], "reconfiguration": trials()}


def test_page__shows_naive_against_reconfigured_as_it_does_naive_against_retrained() -> None:
    parsed = Page(rendered(**reconfigured()))
    page = parsed.text
    headings, axis = parsed.tables["failure-table"][0], "0 30 % 60 %"
    assert [plain(cell["text"]) for cell in headings] == ["against", f"ego adas{axis}", f"reconfigured ego{axis}"]
    assert f"{QUESTIONS['RQ2'].format(doing=RECONFIGURED.doing)} Yes RQ2" in page
    assert "Reconfiguration reduces the ego's failures against the speedy driver from 18 of 60 games to 2 of 60" in page
    assert "played by the naive and by the reconfigured ego" in page
    assert "drives faster after reconfiguration" in page
    assert "the ego tuned against speedy, against the same speedy" in page
    assert not re.search("retrain", page.replace("the retrained or reconfigured one", ""), re.IGNORECASE)


def test_page__says_what_was_found_and_escapes_names() -> None:
    page = rendered(**reconfigured())
    assert '<tr><th scope="row">gap_s</th><td>1.5</td><td>2.25</td><td>\N{MINUS SIGN}1</td><td>3</td></tr>' in page
    assert "<b>odd</b>" not in page
    assert "&lt;b&gt;odd&lt;/b&gt;" in page
    assert rounds([{"kind": "reconfiguration"}]) in Page(page).text


def test_searches__in_words() -> None:
    (found,) = searches(trials())
    assert found["summary"] == (
        "5 trials; the best is trial 3: mean payoff 4.25, failures in 12.5 %. "
        "As given: mean payoff 2.00, failures in 12.5 %. 1 could not be played: ValueError: no"
    )
    assert found["document"] == "policies/reconfigured_speedy-seed1/driver.toml"
    (found,) = searches(trials(payoffs=(3.0, 1.0, 3.0)))
    assert found["summary"] == "3 trials, none better than the ego as given: mean payoff 3.00, failures in 12.5 %."
