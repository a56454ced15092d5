"""The questions of a run, each with what its person does that people do not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas as pd

from harness.campaign.results.run_people import declared_of, questions_of
from harness.evaluation.realism import DECLARED, INSIDE, NOT_COMPARABLE, OUTSIDE
from harness.evaluation.tables import table_of
from tests.support.plans import campaign_of, stages_of

CHANGE = {"figure": "lane_change_s", "games": 90, "value": 2.2, "people_low": 3.5, "people_high": 8.0}
HASTY = "driver is outside the range of people: lane change 2.2 s, people 3.5 to 8 s"


def realism(*rows: tuple[str, int, str]) -> pd.DataFrame:
    """A lane change of 2.2 s by player, seed and verdict."""
    players = ({"player": player, "seed": seed, "realistic": verdict} for player, seed, verdict in rows)
    return table_of("realism", [{**CHANGE, **player} for player in players])


def unlike(table: pd.DataFrame, *personas: str, **changes: Any) -> dict[tuple[str, int], set[str]]:
    """What each persona's questions say of its person, by persona and seed; every stage is done."""
    campaign = campaign_of(*personas, **changes)
    done = {f"{name}-seed{seed}" for name in stages_of(*personas, **changes) for seed in campaign.seeds}
    manifest = {"personas": [*personas], "stages": {}}
    run: Any = SimpleNamespace(campaign=campaign, manifest=manifest, done=done)
    found: dict[tuple[str, int], set[str]] = {}
    for question in questions_of(run, table):
        found.setdefault((question.persona, question.seed), set()).add(question.unlike_people)
    return found


def test_questions__name_what_is_outside_for_the_person_and_seed() -> None:
    table = realism(("anna", 1, OUTSIDE), ("anna", 2, INSIDE), ("bert", 1, NOT_COMPARABLE), ("naive ego", 1, OUTSIDE))
    assert unlike(table, "anna", "bert", seeds=[1, 2]) == {
        ("anna", 1): {f"the anna {HASTY}"},
        ("anna", 2): {""},
        ("bert", 1): {""},
        ("bert", 2): {""},
    }


def test_questions__are_not_withheld_where_it_is_declared_or_the_campaign_does_not_ask() -> None:
    assert unlike(realism(("anna", 1, DECLARED)), "anna") == {("anna", 1): {""}}
    free = {"competence": {"non_ego_like_people": False}}
    assert unlike(realism(("anna", 1, OUTSIDE)), "anna", **free) == {("anna", 1): {""}}


def test_questions__of_a_population_ask_each_of_its_personas() -> None:
    town = {"population": [{"name": "town", "shares": {"anna": 1, "bert": 1}}]}
    found = unlike(realism(("anna", 1, INSIDE), ("bert", 1, OUTSIDE)), "anna", "bert", **town)
    assert found["town", 1] == found["bert", 1] == {f"the bert {HASTY}"}
    assert found["anna", 1] == {""}


def test_declared__are_the_reasons_of_the_personas_documents() -> None:
    documents = {
        "anna": {"unlike_people": [{"figure": "lane_change_s", "reason": "It is made for a test."}]},
        "bert": {"unlike_people": []},
    }
    run: Any = SimpleNamespace(manifest={"persona_documents": documents})
    assert declared_of(run) == {"anna": {"lane_change_s": "It is made for a test."}, "bert": {}}
