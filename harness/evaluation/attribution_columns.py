"""The columns of the tables `attribution` and `undecided`, but for those that many tables share."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from harness.evaluation.column import COUNT, MAYBE, NUMBER, P_VALUE, POINTS, TEXT, Column

_T = "95 % t interval"
_MCNEMAR = Column("p", NUMBER, "McNemar's exact test of these pairs, two-sided.", unit=P_VALUE, label="p")
_HOLM = Column("p_holm", NUMBER, "Corrected for all tests of the table.", unit=P_VALUE, source="Holm 1979")


def _compared(name: str, counts: tuple[Column, Column], meaning: str) -> Iterator[Column]:
    yield Column(f"{name}_pairs", MAYBE, "Games of both arms that are compared, with the same start.")
    yield Column(f"{name}_pairs_left_out", MAYBE, "Pairs with a game that errored or is missing.")
    yield from counts
    yield from Column(f"{name}_difference", NUMBER, meaning, unit=POINTS).with_interval(_T)
    for column, label in ((_MCNEMAR, "p"), (_HOLM, "p after Holm")):
        yield replace(column, name=f"{name}_{column.name}", label=label)


ATTRIBUTION = (
    Column("trait", TEXT, "A trait in which the persona differs from the baseline, or `all` of them."),
    Column("arm", TEXT, "The ego against the persona."),
    Column("without_arm", TEXT, "Against the persona with the baseline's value of the trait; of `all`: the baseline."),
    *_compared(
        "without",
        (
            Column("failures", MAYBE, "Failures of the ego against the persona, in these pairs."),
            Column("failures_without", MAYBE, "Those against the persona without the trait."),
        ),
        "Mean of failures with the trait minus without; above 0 the trait causes failures.",
    ),
    Column("example", MAYBE, "The worst game that the ego fails against the persona and not without the trait."),
    Column("baseline_arm", TEXT, "The ego against the baseline."),
    Column("alone_arm", TEXT, "Against the baseline with the persona's value of the trait; of `all`: empty."),
    *_compared(
        "alone",
        (
            Column("failures_baseline", MAYBE, "Failures of the ego against the baseline, in these pairs."),
            Column("failures_alone", MAYBE, "Those against the baseline with this trait alone."),
        ),
        "Mean of failures of the baseline with the trait minus without; above 0 the trait causes failures by itself.",
    ),
)
_OF_FAILURES = "Of these, those in which the person involved made no decision, because its attention had lapsed,"
UNDECIDED = (
    Column("failures", COUNT, "Failures of the ego."),
    Column("undecided_all_game", COUNT, f"{_OF_FAILURES} from the start to the end of its game."),
    Column("undecided_since_conflict", COUNT, f"{_OF_FAILURES} from the `time_s` of `causes.csv` to the end."),
    Column("undecided_last_second", COUNT, f"{_OF_FAILURES} in the last second of its game."),
)
