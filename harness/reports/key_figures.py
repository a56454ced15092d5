"""What a persona's card says beside the failure rates: who the persona is, why the ego fails, near misses, the worst
known opponent, the price in speed.

An ego without failures may still come too close in most games, or fail against the next opponent: the card says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.evaluation.strategies import Arm, EgoStrategy, NaiveEgo, PersonaNonEgo, against_persona
from harness.game.roles import NON_EGO
from harness.reports.differences import NO_RELEVANT_DIFFERENCE, faster_by, is_equivalent
from harness.reports.numbers import NO_SPACE, SURE, interval, number, percent
from harness.reports.run_findings import RunFindings
from harness.reports.verdict_wording import Conclusion, Tone

PREVENTABLE = "Preventable"
CAUSES = "Why the {ego} fails"
NEAR_MISS = "near_miss"
NEAR_MISSES = "Near misses"
WORST_KNOWN_OPPONENT = "Against its worst known opponent"
PRICE = "Price of {doing} in speed"
NO_BLIND_SPOT_CHECK = "It does not check the blind spot in {share} of drives."
LOOKS_AWAY = "Its eyes leave the road for {low:g} to {high:g} s at a time, about every {every:g} s."
PARTLY = "Partly"
OFTEN = 0.1
"""A share of games from which a figure is shown as a warning."""


@dataclass(frozen=True, kw_only=True)
class KeyFigure:
    """One line of a card."""

    title: str
    lines: tuple[str, ...]
    warns: bool = False


def key_figures(persona: str, found: RunFindings) -> list[KeyFigure]:
    """The lines of a persona's card, those that can be measured."""
    parts = (_causes, _preventable, _near_misses, _worst_opponent, _price)
    return [figure for part in parts for figure in part(persona, found)]


def _causes(persona: str, found: RunFindings) -> Iterator[KeyFigure]:
    for question, ego in (("RQ1", found.naive), ("RQ2", f"{found.change.made} ego")):
        lines = found.causes(question, persona)
        if lines:
            yield KeyFigure(title=CAUSES.format(ego=ego), lines=lines)


def _preventable(persona: str, found: RunFindings) -> Iterator[KeyFigure]:
    lines = []
    for each in found.preventability.get(against_persona(NaiveEgo(), persona).name, ()):
        if each.failures:
            seed = f"Seed {each.seed}: " if len(found.seeds) > 1 else ""
            count = f"{each.from_start.by_any} of {each.from_start.judged} failures of the {found.naive}"
            rate = f"{percent(each.rate)} of its games, {SURE}: {interval(each.rate_low, each.rate_high)}"
            lines.append(f"{seed}{count} by a reference driver in its seat ({rate})")
    if lines:
        yield KeyFigure(title=PREVENTABLE, lines=tuple(lines))


def _near_misses(persona: str, found: RunFindings) -> Iterator[KeyFigure]:
    if NEAR_MISS not in found.games.columns:
        return
    egos: list[tuple[str, EgoStrategy]] = [(found.naive, NaiveEgo())]
    if found.asked("RQ2", persona):
        egos.append((f"{found.change.made} ego", found.change.ego(against=persona)))
    lines, last = [], 0.0
    for made, ego in egos:
        games = found.games[found.games["arm"] == against_persona(ego, persona).name]
        marks = games[NEAR_MISS].dropna()
        if len(marks):
            last = float(marks.mean())
            lines.append(f"{int(marks.sum())} of {len(marks)} games of the {made} ({percent(last)})")
    if lines:
        yield KeyFigure(title=NEAR_MISSES, lines=tuple(lines), warns=last >= OFTEN)


def _worst_opponent(persona: str, found: RunFindings) -> Iterator[KeyFigure]:
    """The opponent of the ego of round 2, among people and best responses, against which it fails most often."""
    if not found.asked("RQ2", persona):
        return
    ego = found.change.ego(against=persona)
    known = {name for name, arm in found.planned_arms.items() if _meets_a_person(arm, ego)}
    rows = {key: row for key, row in found.arms.items() if key[0] in known and row["failure_rate"] >= 0.0}
    opponents = len({arm for arm, _ in rows})
    if opponents < 2:
        return
    (arm, seed), row = max(rows.items(), key=lambda each: each[1]["failure_rate"])
    rate = row["failure_rate"]
    line = (
        f"the {found.change.made} ego fails in {percent(rate)} of games "
        f"({SURE}: {interval(row['failure_rate_low'], row['failure_rate_high'])}) in {arm}"
        f"{f', seed {seed}' if len(found.seeds) > 1 else ''}, the worst of {opponents} opponents"
    )
    yield KeyFigure(title=WORST_KNOWN_OPPONENT, lines=(line,), warns=rate >= OFTEN)


def _meets_a_person(arm: Arm, ego: EgoStrategy) -> bool:
    """Whether the arm is this ego against a person, or against the best response of one."""
    return arm.ego == ego and isinstance(arm.non_ego, PersonaNonEgo) and arm.best_response_of in (None, NON_EGO)


def _price(persona: str, found: RunFindings) -> Iterator[KeyFigure]:
    lines = []
    for row in found.comparisons:
        if (row["question"], row["persona"], row["metric"]) != ("RQ2", persona, "mean_speed"):
            continue
        faster = faster_by(row)
        if faster != faster:
            continue
        size = f"{number(abs(faster), 2)}{NO_SPACE}m/s {'faster' if faster > 0 else 'slower'}"
        none = NO_RELEVANT_DIFFERENCE if is_equivalent(row) else "none" if faster > 0 else ""
        line = f"{none}: {size}" if none else size
        lines.append(f"Seed {row['seed']}: {line}" if len(found.seeds) > 1 else line)
    if lines:
        yield KeyFigure(title=PRICE.format(doing=found.change.doing), lines=tuple(lines))


def portrait(document: Mapping[str, Any]) -> str:
    """A persona in one line, from its document in the manifest; empty without one."""
    sentences = [str(document.get("description", "")).strip()]
    share = (document.get("perception") or {}).get("no_blind_spot_check_share")
    if share:
        sentences.append(NO_BLIND_SPOT_CHECK.format(share=percent(share)))
    if attention := document.get("attention"):
        low, high = attention["lapse_s"]
        sentences.append(LOOKS_AWAY.format(low=low, high=high, every=attention["mean_attentive_s"] + (low + high) / 2))
    return " ".join(sentence for sentence in sentences if sentence)


@dataclass(frozen=True, kw_only=True)
class CardVerdict:
    """A conclusion with its question in plain words, as a persona's card shows it."""

    question: str
    conclusion: Conclusion
    label: str
    tone: Tone
    caution: str = ""
    """What the answer does not say; empty if nothing."""


def card_verdict(question: str, conclusion: Conclusion, figures: Sequence[KeyFigure]) -> CardVerdict:
    """The conclusion; an ego that fails less is mended only partly where a key figure warns."""
    label = conclusion.label[:1].upper() + conclusion.label[1:]
    warnings = [each for each in figures if each.warns]
    if conclusion.tone != "mended" or not warnings:
        return CardVerdict(question=question, conclusion=conclusion, label=label, tone=conclusion.tone)
    caution = " ".join(f"But {each.title.lower()}: {each.lines[-1]}." for each in warnings)
    return CardVerdict(question=question, conclusion=conclusion, label=PARTLY, tone="open", caution=caution)
