"""The section on the game: verdicts on best responses, small tables, heat maps and the solutions of the game.

"Not refuted" is the best answer here: a gap is a lower bound, so no search can show an equilibrium between drivers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from harness.evaluation.competence import Verdict
from harness.evaluation.game_theory.best_response_gap import NOTHING_TO_GAIN
from harness.evaluation.game_theory.empirical_game import ALL, SolutionKind
from harness.evaluation.game_theory.findings import GameFindings
from harness.evaluation.gap_verdict import GapVerdict
from harness.reports.data_table import table
from harness.reports.game_links import GameLinks
from harness.reports.gap_sentences import both_sides, induced_failures, induced_in_several
from harness.reports.heatmaps import LEAST_SHARE, views
from harness.reports.numbers import (
    MISSING,
    interval,
    number,
    percent,
    signed,
    trimmed,
)
from harness.reports.run_tables import Row
from harness.reports.verdict_wording import NOT_ANSWERED, Answer, as_sentence, left_out

QUESTION = "Equilibrium"
NO, NEAR, OPEN = "no", "not refuted", "not decided"
MEANINGS = {
    NO: "not an equilibrium",
    NEAR: "this search found nothing against an equilibrium",
    OPEN: "it is not decided whether this is an equilibrium",
}
"""The end of a pair's sentence, by its label."""
NOT_VERIFIED = "No equilibrium could be verified with the accuracy of the numbers."
NO_GAME = "No ego was measured against all of these: there is no game to solve."
CAPTIONS = {
    "gaps": "A row per best response.",
    "crossplay": "A row per pairing of an ego and a non-ego.",
    "equilibria": "A row per strategy of each solution of each game.",
    "generalisation": "A row per retrained ego and non-ego of a persona it was not trained against.",
}


def game_section(findings: GameFindings | None, links: GameLinks) -> dict[str, Any] | None:
    """What the template shows of a run's findings; None where it has none. `links` are the games that cells lead to.

    `cautions` are seed and sentence: which strategies were not shown to drive the scene.
    """
    if findings is None:
        return None
    return {
        "cautions": [(seed, as_sentence(reason)) for seed, reason in findings.cautions],
        "verdicts": gap_verdicts(findings.gaps),
        "views": views(findings.crossplay, findings.equilibria, links),
        "solutions": equilibrium_sentences(findings.equilibria),
        "new_personas": [
            {"ego": ego, "trained_against": met, "non_ego": non_ego, **_new_persona(rows[rows["pairs"] > 0])}
            for (ego, met, non_ego), rows in findings.generalisation.groupby(["ego", "met", "non_ego"], sort=False)
        ],
        "tables": {name: table(name, CAPTIONS[name], frame) for name, frame in findings.tables.items()},
    }


def _new_persona(rows: pd.DataFrame) -> dict[str, str]:
    """How an ego fares against a non-ego of a persona it was not trained against; `rows` are the seeds that were
    played."""
    significant = int((rows["verdict"] == Verdict.SIGNIFICANT.value).sum())
    answered = int((rows["reason"] == "").sum())
    rate, naive_rate = rows["failure_rate"].mean(), rows["naive_failure_rate"].mean()
    span, ends = "", (math.nan, math.nan)
    if len(rows) == 1:
        seed = rows.iloc[0]
        span = f" ({interval(seed['failure_rate_low'], seed['failure_rate_high'])})"
        ends = seed["fewer_failures_low"], seed["fewer_failures_high"]
    elif len(rows):
        span = f" ({interval(rows['failure_rate'].min(), rows['failure_rate'].max())})"
    return {
        "rate": f"{percent(rate)}{span}",
        "naive_rate": percent(naive_rate),
        "share": percent(rate / naive_rate) if naive_rate else MISSING,
        "difference": fewer_failures(rows["fewer_failures"].mean(), *ends),
        "significant": f"{significant} of {answered}" if answered else NOT_ANSWERED,
    }


def gap_verdicts(gaps: pd.DataFrame) -> list[tuple[str, Answer]]:
    """For each persona, whether its last pair is an equilibrium (equation 2), for the page and the terminal."""
    verdicts = []
    for persona in dict.fromkeys(gaps["persona"]):
        rows = gaps[gaps["persona"] == persona]
        last = rows[rows["round"] == rows.groupby("seed")["round"].transform("max")]
        pairs = [pair.to_dict("records") for _, pair in last.groupby(["seed", "ego", "non_ego"], sort=False)]
        verdicts.append((str(persona), _of_pairs(str(persona), pairs)))
    return verdicts


def _of_pair(rows: Sequence[Row]) -> Answer:
    """Whether a pair is an equilibrium as far as was found, and how a best-responding persona affects the ego. `rows`
    are one for each side for which a best response was trained."""
    by_role = {row["role"]: row for row in rows}
    ego, non_ego, seed = by_role.get("ego"), by_role.get("non_ego"), rows[0]["seed"]
    if reason := rows[0]["reason"]:  # the same of both sides
        return Answer(question=QUESTION, seed=seed, label=NOT_ANSWERED, sentence=as_sentence(reason))
    label = _label([GapVerdict(row["verdict"]) for row in rows], both=ego is not None and non_ego is not None)
    sentence = f"{both_sides(str(rows[0]['persona']), ego, non_ego)}: {MEANINGS[label]}."
    harmful = non_ego is not None and non_ego["failure_difference_low"] > 0
    return Answer(
        question=QUESTION,
        seed=seed,
        label=label,
        tone="harm" if harmful else "open",  # "not refuted" is no yes
        sentence=sentence[0].upper() + sentence[1:] + "".join(map(left_out, rows)),
        speed="" if non_ego is None else induced_failures(non_ego),
    )


def _label(verdicts: Sequence[GapVerdict], both: bool) -> str:
    if GapVerdict.DISTINGUISHABLE in verdicts:
        return NO
    return NEAR if both and NOTHING_TO_GAIN.issuperset(verdicts) else OPEN


def _of_pairs(persona: str, pairs: Sequence[Sequence[Row]]) -> Answer:
    """The answer of the pair, or of several: of all seeds, or of all pairs of the last round."""
    answers = [_of_pair(rows) for rows in pairs]
    several = len(answers)
    if several == 1:
        return answers[0]
    unit = "seeds" if len({answer.seed for answer in answers}) == several else "pairs"
    findings = {
        NO: f"the ego or the {persona} driver could still gain by a change of strategy alone (after Holm's correction)",
        NEAR: "no gain that is distinguishable from 0 was found for either side",
        OPEN: "it is not decided",
        NOT_ANSWERED: "it is not answered",
    }
    counts = {label: sum(answer.label == label for answer in answers) for label in findings}
    sentence = "; ".join(
        f"in {count} of {several} {unit} {findings[label]}" for label, count in counts.items() if count
    )
    # "not refuted" is no headline beside a pair of which a search lacks power
    weak = GapVerdict.LACKS_POWER in [row["verdict"] for rows in pairs for row in rows]
    headline = next((label for label in ((NO, OPEN) if weak else (NO, NEAR, OPEN)) if counts[label]), NOT_ANSWERED)
    measured = [row for rows in pairs for row in rows if not row["reason"] and row["pairs"]]
    responders = [row for row in measured if row["role"] == "non_ego"]
    return Answer(
        question=QUESTION,
        label=headline if headline in (OPEN, NOT_ANSWERED) else f"{headline} in {counts[headline]} of {several} {unit}",
        tone="harm" if "harm" in [answer.tone for answer in answers] else "open",
        sentence=f"{sentence[0].upper()}{sentence[1:]}.",
        speed=induced_in_several(persona, responders, unit),
        per_seed=answers,
    )


def equilibrium_sentences(equilibria: pd.DataFrame) -> list[tuple[int, str, list[str]]]:
    """For each seed and game: its solutions in sentences, the one to choose first."""
    return [
        (int(seed), str(game), list(filter(None, (_solution(game, rows), _dominated(rows), _left_out(rows)))))
        for (seed, game), rows in equilibria.groupby(["seed", "game"], sort=False)
    ]


def _solution(game: str, rows: pd.DataFrame) -> str:
    solved = rows[rows["solution"].isin([SolutionKind.NASH.value, SolutionKind.SAFEST.value])]
    if not len(solved):
        return NOT_VERIFIED if (rows["solution"] == SolutionKind.NOT_VERIFIED.value).any() else NO_GAME
    if game == ALL:
        return _safest(solved.to_dict("records"))
    first = solved[solved["number"] == 1].to_dict("records")
    sides = {role: _mixture([row for row in first if row["role"] == role]) for role in ("ego", "non_ego")}
    rate = percent(first[0]["solution_failure_rate"])
    text = f"In equilibrium the ego plays {sides['ego']}, the {game} driver {sides['non_ego']}: the ego fails in {rate}"
    text += f" of games{_held_out(first[0])} and earns {number(first[0]['solution_payoff'], 2)}."
    more = int(solved["number"].max()) - 1
    return text + (f" {more} more {'is' if more == 1 else 'are'} in the table." if more else "")


def _safest(rows: Sequence[Row]) -> str:
    egos = [row for row in rows if row["role"] == "ego"]
    most = egos[0]["solution_failure_rate"]
    worst = [row["player"] for row in rows if row["role"] == "non_ego" and row["failure_rate"] >= most - 1e-6]
    best = min(egos, key=lambda row: row["failure_rate"])
    text = f"The safest choice of egos is {_mixture(egos)}: in the worst case it fails in {percent(most)} of games"
    text += _held_out(egos[0]) + (f", against {', '.join(worst)}." if most > 0 else ".")
    if sum(row["share"] > 0 for row in egos) > 1:
        text += f" The safest single ego is {best['player']}, with {percent(best['failure_rate'])} in the worst case."
    return text


def _held_out(row: Row) -> str:
    rate = row["held_out_failure_rate"]
    return f" ({percent(rate)} in games that did not choose it)" if math.isfinite(rate) else ""


def _mixture(rows: Sequence[Row]) -> str:
    played = [row for row in rows if row["share"] >= LEAST_SHARE]
    if len(played) == 1:
        return f"{played[0]['player']} alone"
    return " + ".join(f"{percent(row['share'])} {row['player']}" for row in played)


def _dominated(rows: pd.DataFrame) -> str:
    """The egos that another ego, or a mixture of egos, is better than against every strategy of the other side."""
    egos = rows[rows["role"] == "ego"].drop_duplicates("player").to_dict("records")
    texts = []
    for row in egos:
        dominators = {"in payoff": row["dominated_in_payoff"], "in failures": row["dominated_in_failures"]}
        clauses = [f"{measure} by {name}" for measure, name in dominators.items() if name]
        if clauses:
            texts.append(f"{row['player']} ({', '.join(clauses)})")
    return f"Dominated: {'; '.join(texts)}." if texts else ""


def _left_out(rows: pd.DataFrame) -> str:
    names = rows.loc[rows["solution"] == SolutionKind.NOT_PLAYED.value, "player"]
    return f"Left out, because not played against all: {', '.join(names)}." if len(names) else ""


def fewer_failures(difference: float, low: float, high: float) -> str:
    """A difference of failure rates against the naive ego's, with its interval if it is finite."""
    if math.isnan(difference):
        return MISSING
    if difference == 0:
        return "none"
    text = f"{trimmed(abs(difference) * 100, 1)} points {'fewer' if difference > 0 else 'more'}"
    if math.isfinite(low):
        low, high = (low * 100, high * 100) if difference > 0 else (-high * 100, -low * 100)
        text += f" ({signed(low, 1)} to {signed(high, 1)})"
    return text


def selection_sentences(selections: pd.DataFrame) -> list[tuple[int, str]]:
    """Seed and sentence of each selection, in the order of the table."""
    found = selections.groupby(["seed", "persona", "round"], sort=False)
    return [(int(seed), _of_selection(rows.to_dict("records"))) for (seed, _, _), rows in found]


def _of_selection(candidates: list[Row]) -> str:
    """E.g. "Round 4, the ego against speedy: its answer is rejected. …". The last candidate is the new answer."""
    *before, answer = candidates
    games = f"{answer['episodes']} games, {answer['alone']} of them alone"
    who = f"the ego against {answer['persona']}" if answer["role"] == "ego" else f"the {answer['persona']} driver"
    earned = f"In {games}, it earned {number(answer['payoff'], 2)} on average"
    if answer["chosen"]:
        best = max(before, key=lambda row: row["payoff"])
        fate = "is taken"
        other = f"the best policy before it, {best['candidate']}, {number(best['payoff'], 2)}."
    else:
        chosen = next(row for row in before if row["chosen"])
        fate = "is rejected"
        other = f"{chosen['candidate']} {number(chosen['payoff'], 2)}: the player goes on with this policy."
    return f"Round {answer['round']}, {who}: the new answer {fate}. {earned}, {other}"
