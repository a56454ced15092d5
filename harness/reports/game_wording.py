"""The game in words: who could still gain, what an equilibrium of the table says, whom to trust against strangers.

Nothing here says "equilibrium" of players for whom merely nothing better was found: a gap is a lower bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from harness.reports.wording import (NO_SPACE, Answer, Row, Tone, Conclusion, interval, left_out, number, p_text, percent, trimmed)
from harness.evaluation.game_theory.empirical_game import ALL, SolutionKind
from harness.evaluation.game_theory.best_response_gap import NOTHING_TO_GAIN, GapVerdict

QUESTION = "Equilibrium"
NO, NEAR, OPEN = "no", "not refuted", "not decided"


def gap_verdicts(gaps: pd.DataFrame) -> list[tuple[str, Conclusion]]:
    """Of each persona, whether its last pair is an equilibrium (equation 2), as the page and the terminal say it."""
    found = []
    for persona in dict.fromkeys(gaps["persona"]):
        last = last_pairs(gaps[gaps["persona"] == persona])
        answers = [pair_answer(rows) for rows in last]
        responders = [row for rows in last for row in rows if row["role"] == "non_ego" and row["pairs"]]
        found.append((str(persona), _headline(str(persona), answers, responders)))
    return found


def pairs(gaps: pd.DataFrame) -> list[list[Row]]:
    """The rows of each pair of players: one for each side that was searched for a better response."""
    keys = ["seed", "persona", "round", "ego", "non_ego"]
    return [rows.to_dict("records") for _, rows in gaps.groupby(keys, sort=False)]


def last_pairs(gaps: pd.DataFrame) -> list[list[Row]]:
    """The pairs of each seed's last round."""
    last = gaps.groupby("seed")["round"].transform("max")
    return pairs(gaps[gaps["round"] == last])


def other_pairs(gaps: pd.DataFrame) -> list[tuple[str, str, Answer]]:
    """Persona, name and answer of every pair that is not of its seed's last round with that persona."""
    found = []
    for persona in dict.fromkeys(gaps["persona"]):
        of = gaps[gaps["persona"] == persona]
        last = of.groupby("seed")["round"].transform("max")
        for rows in pairs(of[of["round"] < last]):
            found.append((str(persona), f"{rows[0]['ego']} against {rows[0]['non_ego']}", pair_answer(rows)))
    return found


def pair_answer(rows: Sequence[Row]) -> Answer:
    """Whether a pair is an equilibrium as far as was found, in a sentence, and what its best-responding persona
    does to the ego."""
    by_role = {row["role"]: row for row in rows}
    ego, non_ego = by_role.get("ego"), by_role.get("non_ego")
    verdicts = [GapVerdict(row["verdict"]) for row in rows]
    if GapVerdict.DISTINGUISHABLE in verdicts:
        label, so = NO, "not an equilibrium"
    elif ego is not None and non_ego is not None and NOTHING_TO_GAIN.issuperset(verdicts):
        label, so = NEAR, "as near to an equilibrium as this search can tell"
    else:
        label, so = OPEN, "whether this is an equilibrium is not decided"
    driver = f"the {rows[0]['persona']} driver"
    both_gain = all(each is GapVerdict.DISTINGUISHABLE for each in verdicts) and len(rows) == 2
    parts = [
        _part("the ego", ego),
        f"{driver} {_share(non_ego)}" if both_gain and non_ego is not None and _has_share(non_ego, ego)
        else _part(driver, non_ego),
    ]  # fmt: skip
    sentence = "; ".join(parts) + f": {so}."
    sentence = sentence[0].upper() + sentence[1:]
    induced = "" if non_ego is None else induced_failures(non_ego)
    harmful = non_ego is not None and non_ego["failure_difference_low"] > 0
    tone: Tone = "harm" if harmful else "open"  # what is not refuted is no yes
    return Answer(rows[0]["seed"], label == NEAR, label, tone, sentence + "".join(map(left_out, rows)), induced)


def induced_failures(row: Row) -> str:
    """What a persona that is trained anew against this ego makes of it: the number that matters."""
    games, rate = row["pairs"], row["ego_failure_rate_best_response"]
    if not games:
        return f"What a {row['persona']} driver trained anew makes of this ego was not measured."
    low, high = row["ego_failure_rate_best_response_low"], row["ego_failure_rate_best_response_high"]
    counts = f"{round(rate * games)} of {games} games ({percent(rate)}; 95{NO_SPACE}%: {interval(low, high)})"
    text = f"A {row['persona']} driver trained anew against this ego makes it fail in {counts}"
    text += f" instead of {round(row['ego_failure_rate'] * games)}"
    if GapVerdict(row["verdict"]) is GapVerdict.NONE_FOUND:
        return f"{text}, though that driver earns no more by it."
    return f"{text}."


def _induced_in_several(persona: str, responders: Sequence[Row], what: str) -> str:
    if not responders:
        return ""
    rates = [row["ego_failure_rate_best_response"] for row in responders]
    before = sum(row["ego_failure_rate"] for row in responders) / len(rates)
    text = f"A {persona} driver trained anew against this ego makes it fail in {percent(sum(rates) / len(rates))} of games "
    return f"{text}(mean of {len(rates)} {what}: {interval(min(rates), max(rates))}) instead of {percent(before)}."


def _part(who: str, row: Row | None) -> str:
    if row is None:
        return f"no best response of {who} was trained"
    return {
        GapVerdict.DISTINGUISHABLE: f"{who} could still gain {_share(row)} of its payoff",
        GapVerdict.BEFORE_HOLM_ONLY: (
            f"{who} might gain {_share(row)} of its payoff, but not after Holm's correction ({p_text(row['p_holm'])})"
        ),
        GapVerdict.NOT_DISTINGUISHABLE: (
            f"for {who} a gain of {_share(row)} was measured, which can't be told from 0{_span(row)}"
        ),
        GapVerdict.NONE_FOUND: f"for {who} nothing better was found",
        GapVerdict.NO_DIFFERENCE: f"the best response of {who} earns the same in every game",
        GapVerdict.ALL_EQUAL: f"{who} gains {_share(row)} of its payoff, as much in every game, so that there is no test",
        GapVerdict.NOT_ENOUGH_PAIRS: f"for {who} too few games could be compared",
    }[GapVerdict(row["verdict"])]


def _has_share(*rows: Row | None) -> bool:
    return all(row is not None and math.isfinite(row["gap_share"]) for row in rows)


def _share(row: Row) -> str:
    """The gap as a share of the payoff; where that is 0, the gap itself."""
    if math.isfinite(row["gap_share"]):
        return percent(row["gap_share"])
    return f"{number(row['gap'], 2)} above the 0"


def _span(row: Row) -> str:
    """The gap's interval as shares of the payoff; empty where there is none."""
    if not (row["payoff"] and math.isfinite(row["ci_low"])):
        return ""
    low, high = (trimmed(row[end] / abs(row["payoff"]) * 100, 1) for end in ("ci_low", "ci_high"))
    return f" (95{NO_SPACE}%: {low} to {high}{NO_SPACE}%)"


def _headline(persona: str, answers: Sequence[Answer], responders: Sequence[Row]) -> Conclusion:
    if len(answers) == 1:
        (only,) = answers
        return Conclusion(QUESTION, only.label, only.tone, only.sentence, only.speed, ())
    several, no = len(answers), sum(answer.label == NO for answer in answers)
    near = sum(answer.label == NEAR for answer in answers)
    what = "seeds" if len({answer.seed for answer in answers}) == several else "pairs"
    tones = [answer.tone for answer in answers]
    label = f"no in {no} of {several} {what}" if no else f"{NEAR} in {near} of {several} {what}" if near else OPEN
    tone: Tone = "harm" if "harm" in tones else "open"
    finding = {
        NO: f"the ego or the {persona} driver could still gain by changing its strategy alone (after Holm's correction)",
        NEAR: "no gain that can be told from 0 was found for either",
        OPEN: "it is not decided",
    }
    counts = {each: sum(answer.label == each for answer in answers) for each in finding}
    said = [f"in {count} of {several} {what} {finding[each]}" for each, count in counts.items() if count]
    sentence = "; ".join(said)
    sentence = f"{sentence[0].upper()}{sentence[1:]}."
    return Conclusion(QUESTION, label, tone, sentence, _induced_in_several(persona, responders, what), answers)


def equilibrium_sentences(equilibria: pd.DataFrame) -> list[tuple[int, str, list[str]]]:
    """Of each seed and game: what its solutions say, the one to choose first."""
    return [
        (int(seed), str(game), list(filter(None, (_solution(game, rows), _dominated(rows), _left_out(rows)))))
        for (seed, game), rows in equilibria.groupby(["seed", "game"], sort=False)
    ]


def _solution(game: str, rows: pd.DataFrame) -> str:
    solved = rows[rows["solution"].isin([SolutionKind.NASH.value, SolutionKind.SAFEST.value])]
    if not len(solved):
        if (rows["solution"] == SolutionKind.NOT_VERIFIED.value).any():
            return "No equilibrium could be verified: its numbers got in the way."
        return "No ego was measured against all of these: there is no game to solve."
    if game == ALL:
        return _safest(solved.to_dict("records"))
    first = solved[solved["number"] == 1].to_dict("records")
    sides = {role: _mixture([row for row in first if row["role"] == role]) for role in ("ego", "non_ego")}
    rate = percent(first[0]["solution_failure_rate"])
    text = f"In equilibrium the ego plays {sides['ego']}, the {game} driver {sides['non_ego']}: the ego fails in {rate} "
    text += f"of games and earns {number(first[0]['solution_payoff'], 2)}."
    more = int(solved["number"].max()) - 1
    return text + (f" {more} more {'is' if more == 1 else 'are'} in the table." if more else "")


def _safest(rows: Sequence[Mapping[str, Any]]) -> str:
    egos = [row for row in rows if row["role"] == "ego"]
    most = egos[0]["solution_failure_rate"]
    worst = [row["player"] for row in rows if row["role"] == "non_ego" and row["failure_rate"] >= most - 1e-6]
    best = min(egos, key=lambda row: row["failure_rate"])
    text = f"Whoever comes, the safest choice of egos is {_mixture(egos)}: it fails in {percent(most)} of games at worst"
    text += f" (against {', '.join(worst)})." if most > 0 else "."
    if sum(row["share"] > 0 for row in egos) > 1:
        text += f" The safest single ego is {best['player']}, with {percent(best['failure_rate'])} at worst."
    return text


def _mixture(rows: Sequence[Mapping[str, Any]]) -> str:
    played = [row for row in rows if row["share"] >= 0.0005]
    if len(played) == 1:
        return f"{played[0]['player']} alone"
    return " + ".join(f"{percent(row['share'])} {row['player']}" for row in played)


def _dominated(rows: pd.DataFrame) -> str:
    """The egos that another ego or a mixture of egos is better than, whatever the other side does."""
    egos = rows[rows["role"] == "ego"].drop_duplicates("player").to_dict("records")
    said = []
    for row in egos:
        by = {"in payoff": row["dominated_in_payoff"], "in failures": row["dominated_in_failures"]}
        how = [f"{where} by {name}" for where, name in by.items() if name]
        if how:
            said.append(f"{row['player']} ({', '.join(how)})")
    return f"Dominated: {'; '.join(said)}." if said else ""


def _left_out(rows: pd.DataFrame) -> str:
    names = rows.loc[rows["solution"] == SolutionKind.NOT_PLAYED.value, "player"]
    return f"Left out, because not played against all: {', '.join(names)}." if len(names) else ""
