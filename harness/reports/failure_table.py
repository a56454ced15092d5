"""The first table of the page: how often each ego fails against each person, on one axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.evaluation.comparisons.comparison import rate_cells
from harness.evaluation.strategies import (
    Arm,
    EgoStrategy,
    ErrorFreeEgo,
    NaiveEgo,
    OwnEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    RoundAnswer,
    ShieldedEgo,
    SumoNonEgo,
    against_persona,
)
from harness.game.roles import NON_EGO
from harness.reports.game_links import GameLinks
from harness.reports.numbers import percent
from harness.reports.run_tables import RunTables, failures, played
from harness.reports.severity_wording import RISK_TONES, risk_tone

NOBODY, WORST_KNOWN = "nobody", "worst known opponent"
ORDINARY, ORDINARY_PERSON = "SUMO’s driver", "ordinary person"
"""Who has the person's place in the control arm: a driver; or, where people do not drive, a walker or rider."""
TAKES_OVER = "UN R157’s driver takes over"
MOST_LINES, MOST_INTERVALS = 8, 24
"""Lines of the table, and intervals below one another; with more of either it is dense."""
_DOT_REM, _DENSE_DOT_REM, _MOST_REM = 0.42, 0.24, 8.0
"""The height of an interval, and in a dense table that of an interval and, at most, of all below one another."""
AXES = (0.05, 0.1, 0.2, 0.4, 0.6, 1.0)
"""The ends that the common axis of failure rates may have."""


@dataclass(frozen=True, kw_only=True)
class FailureCell:
    """How often one ego fails against one person."""

    rate: str
    counts: str
    """Failures and games, over all training seeds."""
    spans: Sequence[tuple[float, float, float]]
    """For each training seed the share and its 95 % interval."""
    tone: str
    """A key of `RISK_TONES`."""
    game: str = ""
    """The address of its worst game on the page; empty without one."""
    arm: str = ""
    """The arm, where the line and the column do not say it."""


@dataclass(frozen=True, kw_only=True)
class PersonLine:
    """One person, with a cell for each ego; None where they did not meet."""

    person: str
    cells: Sequence[FailureCell | None]
    is_baseline: bool = False
    """Whether the personas are compared with it: nobody, the ordinary driver, the careful person."""

    @property
    def warns(self) -> bool:
        """Whether an ego fails where none of the personas takes part."""
        return self.is_baseline and any(cell is not None and cell.tone != "none" for cell in self.cells)


def failure_table(tables: RunTables, links: GameLinks) -> dict[str, Any] | None:
    """The columns, lines and axis of the table for the template; None before a game was played."""
    egos, lines = egos_in(tables), [line for line in _lines(tables, links) if any(line.cells)]
    cells = [cell for line in lines for cell in line.cells if cell is not None]
    if not cells:
        return None
    columns = [*egos, TAKES_OVER] if len(lines[-1].cells) > len(egos) else list(egos)
    most = max(high for cell in cells for _, _, high in cell.spans)
    top = next((end for end in AXES if end >= most), AXES[-1])
    intervals = len(lines) * len(tables.seeds)
    is_dense = len(lines) > MOST_LINES or intervals > MOST_INTERVALS
    dense_dot_rem = min(_DENSE_DOT_REM, _MOST_REM / intervals)
    return {
        "columns": columns,
        "lines": lines,
        "top": top,
        "dense": is_dense,
        "dot_rem": dense_dot_rem if is_dense else _DOT_REM,
        "tones": {tone: words for tone, words in RISK_TONES.items() if any(cell.tone == tone for cell in cells)},
    }


def egos_in(tables: RunTables) -> dict[str, list[EgoStrategy]]:
    """The egos of a run by their words, the last round's of each persona together."""
    egos: dict[str, list[EgoStrategy]] = {tables.naive: [NaiveEgo()]}
    if changed := [tables.last_ego(persona) for persona in tables.personas if tables.asked("RQ2", persona)]:
        egos[f"{tables.change.made} ego"] = list(dict.fromkeys(changed))
    if any(arm.ego == RobustEgo() for arm in tables.arms.values()):
        egos["robust ego"] = [RobustEgo()]
    known = {arm.ego for arm in tables.arms.values()}
    for words, column in list(egos.items()):
        for differs, twin_of in _TWINS.items():
            twins: list[EgoStrategy] = [twin_of(of=each) for each in column if isinstance(each, OwnEgo)]
            twins = [each for each in twins if each in known]
            egos |= {f"{words} {differs}": twins} if twins else {}
    return egos


_TWINS: Mapping[str, Callable[..., ShieldedEgo | ErrorFreeEgo]] = {
    "with the shield": ShieldedEgo,
    "without perception errors": ErrorFreeEgo,
}
"""Egos that play the same games as another one, by what differs."""


def _with_twins(ego: EgoStrategy) -> list[EgoStrategy]:
    return [ego, *(twin_of(of=ego) for twin_of in _TWINS.values())] if isinstance(ego, OwnEgo) else [ego]


def _lines(tables: RunTables, links: GameLinks) -> Iterator[PersonLine]:
    egos = list(egos_in(tables).values())

    def cells(non_ego: SumoNonEgo | PersonaNonEgo | None) -> list[FailureCell | None]:
        return [_cell([Arm(ego=ego, non_ego=non_ego).name for ego in column], tables, links) for column in egos]

    judged = {persona: _taken_over(persona, tables) for persona in tables.personas}
    last: list[FailureCell | None] = [None] if any(judged.values()) else []
    yield PersonLine(person=NOBODY, cells=cells(None) + last, is_baseline=True)
    ordinary = ORDINARY if tables.non_ego_drives else ORDINARY_PERSON
    yield PersonLine(person=ordinary, cells=cells(SumoNonEgo()) + last, is_baseline=True)
    if (baseline := tables.manifest.get("baseline")) and baseline not in tables.personas:
        yield PersonLine(person=baseline, cells=cells(PersonaNonEgo(persona=baseline)) + last, is_baseline=True)
    for persona in tables.personas:
        answers = _with_twins(tables.last_ego(persona))
        own = [[each for each in column if len(column) == 1 or each in answers] for column in egos]
        met = [_cell([against_persona(ego, persona).name for ego in column], tables, links) for column in own]
        yield PersonLine(person=persona, cells=[*met, judged[persona]] if last else met)
    known = [[name for name, arm in tables.arms.items() if arm.ego in column and _is_answer(arm)] for column in egos]
    yield PersonLine(person=WORST_KNOWN, cells=[_cell(names, tables, links, named=True) for names in known] + last)


def _is_answer(arm: Arm) -> bool:
    """Whether a person of a later round, also one whose answer was rejected, a best response or another ego's opponent
    plays an arm."""
    person = arm.non_ego
    if isinstance(person, RoundAnswer):
        return True
    if not isinstance(person, PersonaNonEgo) or person.borrowed is not None:
        return False
    is_other = isinstance(arm.ego, RetrainedEgo | ReconfiguredEgo) and arm.ego.against != person.persona
    return arm.best_response_of == NON_EGO or (arm.best_response_of is None and (person.round > 1 or is_other))


def _cell(names: Sequence[str], tables: RunTables, links: GameLinks, named: bool = False) -> FailureCell | None:
    """The worst of some arms, with its name if `named`; None if none of them was played."""
    counts = {name: tables.counts_of(name) for name in names}
    shares = {name: failed / games for name, (failed, games) in counts.items() if games}
    if not shares:
        return None
    name = max(shares, key=lambda each: shares[each])
    (failed, games), rows = counts[name], list(tables.rates_of(name).values())
    return FailureCell(
        rate=percent(shares[name]),
        counts=f"{failed:,} of {games:,}",
        spans=[(row["failure_rate"], row["failure_rate_low"], row["failure_rate_high"]) for row in rows],
        tone=risk_tone(tables.games_of(name)["mais3_risk_high"].mean()) if failed else "none",
        game=links.worst(name) if failed else "",
        arm=name if named and failed else "",
    )


def _taken_over(persona: str, tables: RunTables) -> FailureCell | None:
    """The failures of the naive ego that the driver of UN R157 does not prevent by taking over at the danger."""
    arm = against_persona(NaiveEgo(), persona).name
    prevented = {row["seed"]: row["from_conflict_prevented"] for row in tables.prevented_in(arm)}
    rates = tables.rates_of(arm)
    if not prevented or any(failures(row) and seed not in prevented for seed, row in rates.items()):
        return None
    left = [(failures(row) - prevented.get(seed, 0), played(row)) for seed, row in rates.items()]
    failed, games = (sum(each) for each in zip(*left, strict=True))
    shares = [rate_cells("rate", *each) for each in left]
    return FailureCell(
        rate=percent(failed / games),
        counts=f"{failed:,} of {games:,}",
        spans=[(each["rate"], each["rate_low"], each["rate_high"]) for each in shares],
        tone="unknown" if failed else "none",  # how severe its own collisions would be is not computed
    )
