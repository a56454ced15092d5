"""Model cards: a README.md beside each policy, from the run's own data only."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.results.model_cards import model_card
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.evaluation.columns import TABLES
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.realism import CRASHES
from harness.evaluation.tables import read_csv, table_of, typed
from tests.support.repository import REPOSITORY
from tests.support.tiny import learned_run, sumo_run

ARMS = ("naive_alone", "naive_vs_paper_distracted", "paper_distracted_alone", "retrained_vs_paper_distracted")


def persona(name: str) -> dict[str, Any]:
    return read_document(REPOSITORY / "personas" / f"{name}.toml", Persona).model_dump(mode="json")


def entry(name: str, kind: str = "training") -> dict[str, Any]:
    done = {"steps": 1_703_936, "budget_steps": 3_000_000, "stopped": "converged", "rule": "stop when settled"}
    about = {"kind": kind, "name": name, "persona": "" if name == "naive" else "paper_distracted", "seed": 1}
    return {**about, "status": "done", "seconds": 166.5, **(done if kind == "training" else {})}


MANIFEST: dict[str, Any] = {
    "name": "merge",
    "quick": False,
    "campaign": {"name": "merge", "scene": "../networks/merge", "personas": ["paper_distracted.toml"], "seeds": [1]},
    "personas": ["paper_distracted"],
    "ego_persona": persona("careful"),
    "persona_documents": {"paper_distracted": persona("paper_distracted")},
    "seeds": [1],
    "versions": {"python": "3.11.7", "platform": "Linux-6.1", "harness": "0.1.0", "torch": "2.13.0"},
    "stages": {
        **{f"{name}-seed1": entry(name) for name in ("naive", "paper_distracted", "retrained_paper_distracted")},
        **{f"{name}-seed1": entry(name, "assessment") for name in ARMS},
    },
}
POLICY: dict[str, Any] = {
    "stage": "naive-seed1",
    "player": "ego",
    "persona": "careful",
    "scene": "merge",
    "against": None,
    "began_from": None,
    "training": {
        "steps": 3_000_000,
        "early_convergence": True,
        "learning_rate": 1e-4,
        "network": [64, 64],
        "demonstration_steps": 0,
    },
}
NON_EGO_POLICY = {
    **POLICY,
    "stage": "paper_distracted-seed1",
    "player": "non_ego",
    "persona": "paper_distracted",
    "against": "naive-seed1",
    "alone_share": 0.5,
    "attentive_share": 0.5,
}
SUMMARY = typed(
    pd.DataFrame(
        [
            {"arm": "naive_alone", "seed": 1, "episodes": 100, "errors": 0}
            | {"failure_rate": 0.0, "failure_rate_low": 0.0, "failure_rate_high": 0.0362}
            | {"mean_speed_mps": 13.8, "mean_speed_low_mps": 13.79, "mean_speed_high_mps": 13.81},
            {"arm": "naive_vs_paper_distracted", "seed": 1, "episodes": 100, "errors": 1}
            | {"failure_rate": 0.18, "failure_rate_low": 0.11, "failure_rate_high": 0.269, "mean_speed_mps": 13.78}
            | {"non_ego_goal_rate": 0.75, "non_ego_goal_rate_low": 0.653, "non_ego_goal_rate_high": 0.831}
            | {"non_ego_mean_speed_mps": 11.56},
            {"arm": "naive_alone", "seed": 2, "episodes": 7, "errors": 0, "failure_rate": 1.0},
        ],
        columns=list(TABLES["summary"]),
    )
)

CRASHES_OF_DISTRACTED = {"player": "paper_distracted", "seed": 1, "figure": CRASHES, "games": 100}
REALISM = table_of("realism", [{**CRASHES_OF_DISTRACTED, "value": 1_460_064.0, "low": 777_423.0, "high": 2_496_755.0}])


def lines(card: str) -> list[str]:
    return card.replace("\N{NO-BREAK SPACE}", " ").splitlines()


def case(stage: str, rows: str, person: dict[str, Any] | None = None, **policy: Any) -> Any:
    """A card and rows that it has; `person` changes the careful persona of a non-ego, `policy` its policy.json."""
    documents = {
        "paper_distracted": persona("paper_distracted") if person is None else {**persona("careful"), **person}
    }
    made = {**(NON_EGO_POLICY if stage == "paper_distracted-seed1" else POLICY), **policy}
    card = "\n".join(lines(model_card(stage, {**MANIFEST, "persona_documents": documents}, SUMMARY, REALISM, made)))
    return card, [row.strip() for row in rows.strip().splitlines()]


def shown(steps: int) -> dict[str, Any]:
    return {**POLICY["training"], "demonstration_steps": steps}


LIMITS = {
    "clearance": {"weight": 1.0, "within_m": 0.5},
    "red_light": {"weight": 2.0, "after_s": 2.0},
    "stop_sign": {"weight": 1.0, "from_mps": 1.5},
    "time_gap": {"weight": 1.0, "within_s": 1.2},
}
OF_NAIVE = """
    # naive-seed1
    The naive ego: it was trained alone on the road.
    | player | ego |
    | persona | `careful` |
    | scene | `merge` |
    | against | no other player |
    | initial policy | none |
    | trained for | 1,703,936 of at most 3,000,000 steps: stopped by convergence |
    | convergence | stop when settled |
    | safety | `collision` | 20 | per event | touching a vehicle or person, once |
    | safety | `clearance` | 2 | per second | nearness to the nearest surface, rail or vehicle, within 0.6 m |
    | learning_rate | 0.0001 |
    | network | 64, 64 |
    | early_convergence | yes |
    driver = "policies/naive-seed1"    # the path of this folder
    Versions: python 3.11.7, torch 2.13.0.
    1 × safety + 1 × operational + 0 × human
"""
OF_NON_EGO = """
    | player | non_ego |
    | against | `naive-seed1` |
    | games without the other player | 50 % |
    lapses of 4 to 6 s, with 4 s of attention between them on average
    | no lapses in | the first 50 % of the budget |
    5 seconds
    | arm | games | reaches its goal | mean speed (m/s) |
    | `naive_vs_paper_distracted` | 99 | 75 % (65.3–83.1 %) | 11.56 |
    policies = "policies"    # the path of the parent of this folder
"""
OF_RETRAINED = """
    The ego, retrained against the persona `paper_distracted`.
    | initial policy | `naive-seed1` |
    | games without the other player | 25 % |
    None yet: no arm with this policy has been assessed.
"""
OF_SPEEDY = """
    fuzzy, of `speed_over_limit`: within (0: 1, 0.15: 0) has the value 0; over
    - Actions are sampled from the policy's distribution
    - No glance over the shoulder in 85 % of the drives
"""


@pytest.mark.parametrize(
    ("card", "rows"),
    [
        case("naive-seed1", OF_NAIVE),
        case("naive-seed1", "trained alone on the road, and beside SUMO's own driver.", against="sumo"),
        case("naive-seed1", "it imitated a rule-based driver, shown in 38,400 steps |", training=shown(38_400)),
        case("naive-seed1", "| initial policy | none |", training=shown(0)),
        case(
            "retrained_paper_distracted-seed1",
            OF_RETRAINED,
            against="paper_distracted-seed1",
            began_from="naive-seed1",
            alone_share=0.25,
        ),
        case("paper_distracted-seed1", OF_NON_EGO),
        case("paper_distracted-seed1", OF_SPEEDY, persona("paper_speedy")),
        case(
            "paper_distracted-seed1", ", within 0.5 m |\n, after 2 s |\n, within 1.2 s |", {"safety": {"terms": LIMITS}}
        ),
        case("paper_distracted-seed1", ", from 1.5 m/s |", {"safety": {"terms": LIMITS}}),
    ],
)
def test_card__states_its_facts(card: str, rows: list[str]) -> None:
    assert [row for row in rows if row not in card] == []


def test_card__has_the_shares_of_the_training_and_an_older_policy_has_none() -> None:
    best_response = {
        **NON_EGO_POLICY,
        "began_from": "paper_distracted-seed1",
        "alone_share": 0.0,
        "attentive_share": 0.0,
    }
    card = lines(model_card("paper_distracted-seed1", MANIFEST, SUMMARY, REALISM, best_response))
    assert "| games without the other player | 0 % |" in card
    assert not any("no lapses in" in line for line in card)
    older = {key: value for key, value in NON_EGO_POLICY.items() if not key.endswith("_share")}
    card = lines(model_card("paper_distracted-seed1", MANIFEST, SUMMARY, REALISM, older))
    assert not any("no lapses in" in line or "games without" in line for line in card)


def test_card__figures_are_those_of_its_own_arms_and_seed() -> None:
    card = lines(model_card("naive-seed1", MANIFEST, SUMMARY, REALISM, POLICY))
    start = card.index("| arm | games | failure rate | mean speed (m/s) |")
    assert card[start + 1 : start + 5] == [
        "| --- | ---: | ---: | ---: |",
        "| `naive_alone` | 100 | 0 % (0–3.6 %) | 13.80 (13.79–13.81) |",
        "| `naive_vs_paper_distracted` | 99 | 18 % (11–26.9 %) | 13.78 |",
        "",
    ]


def test_card__of_a_person_states_its_crashes_alone() -> None:
    crashes = "Alone on the road: 1.46 crashes per km (95 %: 0.777–2.497)."
    assert crashes in lines(model_card("paper_distracted-seed1", MANIFEST, SUMMARY, REALISM, NON_EGO_POLICY))
    unmeasured = table_of("realism", [{**CRASHES_OF_DISTRACTED, "value": None}])
    assert "crashes per km" not in model_card("paper_distracted-seed1", MANIFEST, SUMMARY, unmeasured, NON_EGO_POLICY)
    assert "crashes per km" not in model_card("naive-seed1", MANIFEST, SUMMARY, REALISM, POLICY)


def test_card__marks_a_quick_run_and_has_no_timings() -> None:
    card = model_card("naive-seed1", MANIFEST, SUMMARY, REALISM, POLICY)
    assert "not for conclusions" not in card
    assert "not for conclusions" in model_card("naive-seed1", {**MANIFEST, "quick": True}, SUMMARY, REALISM, POLICY)
    slower = json.loads(json.dumps(MANIFEST))
    slower["stages"]["naive-seed1"]["seconds"] = 999.0
    assert model_card("naive-seed1", slower, SUMMARY, REALISM, POLICY) == card


def test_card__of_a_policy_that_did_not_learn_says_so_first() -> None:
    manifest = json.loads(json.dumps(MANIFEST))
    judgement = {"stopped": DID_NOT_LEARN, "goals": 3, "played": 100, "goal_share_asked": 0.97}
    manifest["stages"]["naive-seed1"] |= judgement
    card = model_card("naive-seed1", manifest, SUMMARY, REALISM, POLICY).replace("\N{NO-BREAK SPACE}", " ")
    stopped = "did not learn: goal in 3 of 100 games alone, at least 97 % asked"
    assert f"**It {stopped}. Not for use.**" in card.partition("| player |")[0]
    assert f"| trained for | 1,703,936 of at most 3,000,000 steps: {stopped} |" in card.splitlines()
    assert "stopped by convergence" not in card


# --- of real runs -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("run", [learned_run, sumo_run])
def test_run__has_a_card_beside_each_policy_with_arms_of_its_summary(run: Callable[[], Path]) -> None:
    arms = set(read_csv(run() / "summary.csv")["arm"])
    for policy in (run() / "policies").iterdir():
        card = (policy / "README.md").read_text(encoding="utf-8")
        assert card.startswith(f"# {policy.name}\n")
        assert any(f"`{arm}` |" in card for arm in arms)


def test_card__a_description_is_one_line_of_text() -> None:
    description = "In a hurry.\n## Figures\n| failure rate | 0 % |\n<script>alert(1)</script>"
    documents = {"paper_distracted": {**persona("paper_distracted"), "description": description}}
    card = lines(
        model_card(
            "paper_distracted-seed1", {**MANIFEST, "persona_documents": documents}, SUMMARY, REALISM, NON_EGO_POLICY
        )
    )
    (line,) = [line for line in card if "In a hurry." in line]
    assert line.endswith("In a hurry. ## Figures \\| failure rate \\| 0 % \\| &lt;script>alert(1)&lt;/script>")
    assert [line for line in card if line.startswith("## Figures")] == ["## Figures"]
