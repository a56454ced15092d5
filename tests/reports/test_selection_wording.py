"""The sentences on selections."""

from __future__ import annotations

from harness.evaluation.tables import table_of
from harness.reports.selection_wording import selection_sentences


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
