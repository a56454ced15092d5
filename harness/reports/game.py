"""The section on the game: verdicts on best responses, small tables, heat maps and the solutions of the game.

"Not refuted" is the best answer here: a gap is a lower bound, so no search can show an equilibrium between drivers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from harness.evaluation.competence import Verdict
from harness.evaluation.game_theory.best_response_gap import NOTHING_TO_GAIN, SEARCH, GapVerdict
from harness.evaluation.game_theory.empirical_game import ALL, SolutionKind
from harness.evaluation.game_theory.findings import GameFindings
from harness.reports.data_table import table
from harness.reports.game_links import GameLinks
from harness.reports.heatmaps import views
from harness.reports.numbers import (
    MINUS,
    MISSING,
    NO_SPACE,
    SURE,
    interval,
    number,
    p_text,
    percent,
    signed,
    sure,
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
        "views": views(findings.crossplay, links),
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
    sentence = f"{_both_sides(str(rows[0]['persona']), ego, non_ego)}: {MEANINGS[label]}."
    harmful = non_ego is not None and non_ego["failure_difference_low"] > 0
    return Answer(
        question=QUESTION,
        seed=seed,
        label=label,
        tone="harm" if harmful else "open",  # "not refuted" is no yes
        sentence=sentence[0].upper() + sentence[1:] + "".join(map(left_out, rows)),
        speed="" if non_ego is None else _induced_failures(non_ego),
    )


def _label(verdicts: Sequence[GapVerdict], both: bool) -> str:
    if GapVerdict.DISTINGUISHABLE in verdicts:
        return NO
    return NEAR if both and NOTHING_TO_GAIN.issuperset(verdicts) else OPEN


def _both_sides(persona: str, ego: Row | None, non_ego: Row | None) -> str:
    driver = f"the {persona} driver"
    gains = [each for each in (ego, non_ego) if each is not None and each["verdict"] == GapVerdict.DISTINGUISHABLE]
    if non_ego is not None and [math.isfinite(each["gap_share"]) for each in gains] == [True, True]:
        return f"{_side('the ego', ego)}; {driver} {_share(non_ego)}{_by_playing(non_ego)}"
    return f"{_side('the ego', ego)}; {_side(driver, non_ego)}"


def _induced_failures(row: Row) -> str:
    """How often the ego fails against the best known response of a persona to it."""
    games, rate = row["pairs"], row["ego_failure_rate_best_response"]
    if not games:
        return f"The effect of a {row['persona']} driver newly trained against this ego was not measured."
    span = sure(row["ego_failure_rate_best_response_low"], row["ego_failure_rate_best_response_high"])
    counts = f"{round(rate * games)} of {games} games ({percent(rate)}; {span})"
    text = f"{_responding(str(row['persona']), row)} {counts} instead of {round(row['ego_failure_rate'] * games)}"
    if row["gap"] <= 0:
        return f"{text}, but this driver does not earn more by it."
    return f"{text}."


def _responding(persona: str, *rows: Row) -> str:
    """The persona with its best known responses of these rows."""
    if any(_known(row) for row in rows):
        return f"A {persona} driver with its best known response makes this ego fail in"
    return f"A {persona} driver newly trained against this ego makes it fail in"


def _side(player: str, row: Row | None) -> str:
    if row is None:
        return f"no best response of {player} was trained"
    match GapVerdict(row["verdict"]):
        case GapVerdict.DISTINGUISHABLE:
            return f"{player} could still gain {_share(row)} of its payoff{_by_playing(row)}"
        case GapVerdict.BEFORE_HOLM_ONLY:
            holm = f"but not after Holm's correction ({p_text(row['p_holm'])})"
            return f"{player} might gain {_share(row)} of its payoff{_by_playing(row)}, {holm}"
        case GapVerdict.NOT_DISTINGUISHABLE:
            measured = f"after {_budget(row)} a gain of {_share(row)}{_by_playing(row)} was measured for {player}"
            return f"{measured}, which is not distinguishable from 0{_span(row)}"
        case GapVerdict.NONE_FOUND:
            return _nothing_better(player, row)
        case GapVerdict.LACKS_POWER:
            below = f"{_budget(row)} end {_below(row)} its own strategy"
            return f"the search for {player} lacks power: {below}"
        case GapVerdict.NO_DIFFERENCE:
            return f"the best response of {player} earns the same in every game"
        case GapVerdict.ALL_EQUAL:
            gain = f"{_share(row)} of its payoff{_by_playing(row)}"
            return f"{player} gains {gain}, the same in every game: there is no test"
        case _:
            return f"for {player} too few games could be compared"


def _budget(row: Row) -> str:
    """What the search had, e.g. "600,000 steps from 2 starts"."""
    starts = row["search_starts"]
    return f"{number(row['search_steps'], 0)} steps from {starts} {'start' if starts == 1 else 'starts'}"


def _known(row: Row) -> list[str]:
    """The known strategies that were taken as best response, beside the search or in its place."""
    return [name for name in row["best_known"].split(" + ") if name not in ("", SEARCH)]


def _by_playing(row: Row) -> str:
    """The known strategies by which the gain was measured; empty where the search alone found it."""
    names = _known(row)
    if names and row["best_known"].startswith(SEARCH):
        names = ["the newly trained strategy", *names]
    return f" by playing {' or '.join(names)}" if names else ""


def _nothing_better(player: str, row: Row) -> str:
    known = row["known"]
    others = f"{known} other {'strategy' if known == 1 else 'strategies'}"
    if row["search_gap"] > 0:  # the search alone earned more: what was taken in the halves of the games did not
        choice = f"the best of {_budget(row)} and {others} of this campaign"
        return f"for {player} {choice} earns no more in games that did not choose it"
    nor = f", nor {'does' if known == 1 else 'do'} {others} of this campaign earn more" if known else ""
    return f"{_budget(row)} found nothing better for {player}{nor}"


def _below(row: Row) -> str:
    """How far below the player's own strategy the search ended."""
    if row["payoff"]:
        below = signed(row["search_gap"] / abs(row["payoff"]) * 100, 1).lstrip(MINUS)
        return f"{below}{NO_SPACE}% below"
    return f"{number(-row['search_gap'], 2)} below the 0 of"


def _share(row: Row) -> str:
    """The gap as a share of the payoff; where the payoff is 0, the gap itself."""
    if math.isfinite(row["gap_share"]):
        return percent(row["gap_share"])
    return f"{number(row['gap'], 2)} above the 0"


def _span(row: Row) -> str:
    """The gap's interval as shares of the payoff; empty where there is none."""
    if not (row["payoff"] and math.isfinite(row["ci_low"])):
        return ""
    low, high = (signed(row[end] / abs(row["payoff"]) * 100, 1) for end in ("ci_low", "ci_high"))
    return f" ({SURE}: {low} to {high}{NO_SPACE}%)"


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
        speed=_induced_in_several(persona, responders, unit),
        per_seed=answers,
    )


def _induced_in_several(persona: str, responders: Sequence[Row], unit: str) -> str:
    if not responders:
        return ""
    rates = [row["ego_failure_rate_best_response"] for row in responders]
    before = sum(row["ego_failure_rate"] for row in responders) / len(rates)
    text = f"{_responding(persona, *responders)} {percent(sum(rates) / len(rates))} of games "
    return f"{text}(mean of {len(rates)} {unit}: {interval(min(rates), max(rates))}) instead of {percent(before)}."


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
    played = [row for row in rows if row["share"] >= 0.0005]
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
