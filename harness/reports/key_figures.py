"""What a persona's card says beside the failure rates: who the persona is, why the ego fails, near misses, the worst
known opponent, the price in speed.

An ego without failures may still come too close in most games, or fail against the next opponent: the card says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.evaluation.comparisons.arm_clauses import Beside, by_criterion, harm_clauses, near_misses
from harness.evaluation.comparisons.comparison import HARM, SHARES
from harness.evaluation.strategies import Arm, EgoStrategy, PersonaNonEgo
from harness.game.lapses import Attention
from harness.game.roles import NON_EGO
from harness.reports.differences import NO_RELEVANT_DIFFERENCE, faster_by, is_equivalent
from harness.reports.numbers import NO_SPACE, number, percent, sure
from harness.reports.persona.profile import length_of_lapses
from harness.reports.run_tables import RunTables, played
from harness.reports.severity_wording import severity_clause
from harness.reports.verdict_wording import Answer

SEVERITY = "Severity of collisions"
NEAR_MISSES = "Near misses"
HARM_TO_OTHERS = "Harm to others"
WORST_KNOWN_OPPONENT = "Against its worst known opponent"
PRICE = "Price of {doing} in speed"
OFTEN = 0.1
"""A share of games from which a figure is shown as a warning."""


@dataclass(frozen=True, kw_only=True)
class KeyFigure:
    """One line of a card."""

    title: str
    lines: Sequence[str]
    warns: bool = False


def key_figures(persona: str, tables: RunTables) -> list[KeyFigure]:
    """The lines of a persona's card, those that can be measured."""
    parts = (_causes, _severity, _preventable, _near_misses, _harm, _worst_opponent, _price)
    return [figure for part in parts for figure in part(persona, tables) if figure.lines]


def egos_of(persona: str, tables: RunTables) -> list[tuple[str, str, str]]:
    """The egos that a persona's card shows: the question about each, its word, and its arm against the persona."""
    naive, changed = tables.arms_of("RQ2", persona)
    egos = [("RQ1", tables.naive, naive)]
    return [*egos, ("RQ2", f"{tables.change.made} ego", changed)] if tables.asked("RQ2", persona) else egos


def _causes(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    for question, ego in (("RQ1", tables.naive), ("RQ2", f"{tables.change.made} ego")):
        yield KeyFigure(title=f"Why the {ego} fails", lines=tables.causes_of(question, persona))


def _preventable(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    found = {made: prevented_clauses(arm, PREVENTED, tables) for _, made, arm in egos_of(persona, tables)}
    lines = [f"{made}: {', '.join(clauses)}" for made, clauses in found.items() if clauses]
    yield KeyFigure(title="Preventable by the careful and competent driver of UN R157", lines=lines)


PREVENTED = {
    "from_conflict": "from the conflict on",
    "moving_over": "if the other moves on into its line",
    "from_start": "from the start",
}
"""The verdicts of preventability.csv on a failure, in words."""


def prevented_clauses(arm: str, verdicts: Iterable[str], tables: RunTables) -> list[str]:
    """How many failures of an arm the driver of the regulation prevents, such as "3 of 7 from the start", for each of
    these verdicts that a failure has."""
    rows, clauses = tables.prevented_in(arm), []
    for verdict in verdicts:
        prevented, judged = (sum(row[f"{verdict}_{count}"] for row in rows) for count in ("prevented", "judged"))
        clauses += [f"{prevented} of {judged} {PREVENTED[verdict]}"] if judged else []
    return clauses


def _severity(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    clauses = [severity_clause(made, arm, tables) for _, made, arm in egos_of(persona, tables)]
    yield KeyFigure(title=SEVERITY, lines=[clause for clause in clauses if clause])


def _near_misses(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    lines, last = [], 0.0
    for _, made, arm in egos_of(persona, tables):
        rows = [row for row in tables.rates_of(arm).values() if row["near_miss_rate"] >= 0.0]
        if rows:
            near, games = sum(map(near_misses, rows)), sum(map(played, rows))
            last = near / games
            lines.append(f"{near} of {games} games of the {made} ({percent(last)}): {by_criterion(rows)}")
    yield KeyFigure(title=NEAR_MISSES, lines=lines, warns=last >= OFTEN)


def harm_of(persona: str, tables: RunTables) -> dict[str, str]:
    """What happens to others beside each ego of a persona's card, the last ego first: a clause by the `metric` of
    comparisons.csv."""
    egos = [Beside(f"the {made}", list(tables.rates_of(arm).values())) for _, made, arm in egos_of(persona, tables)]
    return harm_clauses(*reversed(egos))


def _harm(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    grown = {
        row["metric"]
        for row in tables.tests_of("RQ2", persona)
        if row["metric"] in HARM & SHARES and row["mean_difference"] > 0.0 and row["rejects_h0"]
    }
    clauses = harm_of(persona, tables)
    lines = sorted(clauses, key=lambda metric: metric in grown)
    yield KeyFigure(title=HARM_TO_OTHERS, lines=[clauses[metric] for metric in lines], warns=bool(grown))


def _worst_opponent(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    """The opponent of the ego of round 2, among people and best responses, against which it fails most often."""
    if not tables.asked("RQ2", persona):
        return
    ego = tables.change.ego(persona)
    known = {name for name, arm in tables.arms.items() if _meets_a_person(arm, ego)}
    rows = {key: row for key, row in tables.rates.items() if key[0] in known and row["failure_rate"] >= 0.0}
    opponents = len({arm for arm, _ in rows})
    if opponents < 2:
        return
    (arm, seed), row = max(rows.items(), key=lambda each: each[1]["failure_rate"])
    rate = row["failure_rate"]
    line = (
        f"the {tables.change.made} ego fails in {percent(rate)} of games "
        f"({sure(row['failure_rate_low'], row['failure_rate_high'])}) in {arm}"
        f"{f', seed {seed}' if tables.several_seeds else ''}, the worst of {opponents} opponents"
    )
    yield KeyFigure(title=WORST_KNOWN_OPPONENT, lines=[line], warns=rate >= OFTEN)


def _meets_a_person(arm: Arm, ego: EgoStrategy) -> bool:
    return arm.ego == ego and isinstance(arm.non_ego, PersonaNonEgo) and arm.best_response_of in (None, NON_EGO)


def _price(persona: str, tables: RunTables) -> Iterator[KeyFigure]:
    lines = []
    for row in tables.tests_of("RQ2", persona):
        faster = faster_by(row)
        if row["metric"] != "mean_speed" or faster != faster:
            continue
        size = f"{number(abs(faster), 2)}{NO_SPACE}m/s {'faster' if faster > 0 else 'slower'}"
        none = NO_RELEVANT_DIFFERENCE if is_equivalent(row) else "none" if faster > 0 else ""
        lines.append(f"{_seed(row['seed'], tables)}{none}{': ' if none else ''}{size}")
    yield KeyFigure(title=PRICE.format(doing=tables.change.doing), lines=lines)


def _seed(seed: int, tables: RunTables) -> str:
    return f"Seed {seed}: " if tables.several_seeds else ""


def portrait(document: Mapping[str, Any]) -> str:
    """A persona in one line, from its document in the manifest; empty without one."""
    sentences = [str(document.get("description", "")).strip()]
    share = (document.get("perception") or {}).get("no_shoulder_glance_share")
    if share:
        sentences.append(f"It does not glance over the shoulder in {percent(share)} of drives.")
    if given := document.get("attention"):
        attention = Attention(**given)
        every = attention.mean_attentive_s + attention.mean_lapse_s
        sentences.append(f"Its eyes leave the road about every {every:.2g} s: for {length_of_lapses(attention)}.")
    return " ".join(sentence for sentence in sentences if sentence)


def card_verdict(question: str, answer: Answer, figures: Sequence[KeyFigure]) -> dict[str, Any]:
    """An answer with its question in plain words, as a persona's card shows it. `caution` is what a yes to RQ2 does not
    say: the key figures that warn; empty if none does."""
    warnings = [each for each in figures if each.warns and answer.tone == "mended"]
    caution = " ".join(f"But {each.title.lower()}: {each.lines[-1]}." for each in warnings)
    return {"question": question, "answer": answer, "caution": caution}
