"""A persona's card: the verdicts, the failure rates behind them, and the two figures of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from markupsafe import Markup

from harness.evaluation.research_questions import Verdict
from harness.evaluation.strategies import NAIVE_ALONE, NAIVE_VS_SUMO, Arm, NaiveEgo, against_persona, persona_alone
from harness.reports import page_wording
from harness.reports.differences import Row, effect, statistics
from harness.reports.distributions import MOST_LINES, Pairs, paired_figure, pairs_of, spread_figure, spreads_of
from harness.reports.figures import Column, Point, rate_figure, speed_figure
from harness.reports.game_links import NO_LINKS, GameLinks
from harness.reports.key_figures import KeyFigure, key_figures
from harness.reports.numbers import MISSING, p_number, percent
from harness.reports.portrait import portrait
from harness.reports.results import Results
from harness.reports.shown_verdict import ShownVerdict, shown_verdict
from harness.reports.treatment import Change
from harness.reports.wording import QUESTIONS, failures

LONGEST_LABEL = 12
"""Letters of a persona's name that fit under a column of a figure."""


@dataclass(frozen=True, kw_only=True)
class Rate:
    """One arm's failure rate: large, and each training seed's count and interval."""

    label: str
    series: str
    headline: str
    counts: Sequence[str]
    spans: Sequence[tuple[float, float, float]]
    """Each seed's rate and the ends of its interval, in per cent."""


@dataclass(frozen=True, kw_only=True)
class Test:
    """One row of `comparisons`, in words."""

    question: str
    seed: int
    metric: str
    effect: str
    p_value: str
    p_holm: str
    mcnemar_p: str
    verdict: str


@dataclass(frozen=True, kw_only=True)
class Card:
    """The contents of the page on one persona, but for its tables."""

    persona: str
    anchor: str
    verdicts: Sequence[ShownVerdict]
    rates: Sequence[Rate]
    facts: Sequence[tuple[str, Sequence[str]]]
    tests: Sequence[Test]
    rate_figure: Markup
    speed_figure: Markup
    paired_figure: Markup | None
    """None where round 2 was not played."""
    paired_note: str
    """How many of the episodes are drawn in it, if not all."""
    spread_figure: Markup
    portrait: str
    """The persona in a line; empty without its document."""
    key_figures: Sequence[KeyFigure]
    statistics: Sequence[str]
    """A line for each test behind the verdicts."""
    worst: tuple[str, str] | None
    """Key and description of the game to show: the worst that is embedded."""


class ArmColumn(NamedTuple):
    """A column of the figures."""

    label: str
    series: str
    arm: str


def card(persona: str, place: int, found: Results, worst: tuple[str, str] | None, links: GameLinks = NO_LINKS) -> Card:
    """The card of a persona; `place` makes the ids of its figures unique, `worst` is the game to show."""
    change = found.change if found.asked("RQ2", persona) else None
    columns, figures = _columns(persona, change), key_figures(persona, found)
    paired, paired_note = _paired(persona, place, found, links) if change is not None else (None, "")
    return Card(
        persona=persona,
        anchor=f"persona-{place}",
        verdicts=[
            shown_verdict(
                question.format(person=found.person, doing=found.change.doing), found.verdicts(name, persona), figures
            )
            for name, question in QUESTIONS.items()
        ],
        rates=[
            _rate(label, series, found.of(arm))
            for label, series, arm in page_wording.arm_labels(persona, change, found.naive)
        ],
        facts=_facts(persona, change, found),
        tests=[_test(row) for row in found.comparisons if row["persona"] == persona],
        rate_figure=rate_figure(
            [_drawn(each, _rates(found.of(each.arm)), links) for each in columns],
            f"rate{place}",
            page_wording.rate_alternative(_values(columns, found, "failure_rate")),
        ),
        speed_figure=speed_figure(
            [_drawn(each, _speeds(each.arm, found), links) for each in columns],
            f"speed{place}",
            page_wording.speed_alternative(_values(columns, found, "mean_speed_mps")),
        ),
        paired_figure=paired,
        paired_note=paired_note,
        spread_figure=spread_figure(
            spreads_of(columns, found.games, links),
            f"spread{place}",
            page_wording.spread_alternative(_values(columns, found, "min_ttc_s")),
        ),
        portrait=portrait(found.persona_documents.get(persona, {})),
        key_figures=figures,
        statistics=_statistics(persona, found),
        worst=worst,
    )


def _statistics(persona: str, found: Results) -> list[str]:
    several = len(found.seeds) > 1
    return [
        f"{row['question']}{', seed ' + str(row['seed']) if several else ''}. {statistics(row)}"
        for row in found.comparisons
        if row["persona"] == persona and row["p_value"] == row["p_value"]
    ]


def _paired(persona: str, place: int, found: Results, links: GameLinks) -> tuple[Markup, str]:
    """The figure of pairs and its note."""
    pairs: Sequence[Pairs] = pairs_of(persona, found.games, found.change, links)
    first = pairs[0]
    alternative = page_wording.paired_alternative(
        persona,
        found.change,
        pairs=len(first.before),
        mended=int((first.before_failed & ~first.after_failed).sum()),
        broken=int((~first.before_failed & first.after_failed).sum()),
    )
    note = page_wording.pairs_drawn(MOST_LINES, len(first.before))
    return paired_figure(pairs, f"paired{place}", alternative, found.change.made), note


def _rate(label: str, series: str, rows: Mapping[int, Row]) -> Rate:
    if not rows:
        return Rate(label=label, series=series, headline=MISSING, counts=[page_wording.NOT_PLAYED], spans=[])
    shares = [row["failure_rate"] for row in rows.values()]
    spans = [
        tuple(100.0 * row[name] for name in ("failure_rate", "failure_rate_low", "failure_rate_high"))
        for row in rows.values()
    ]
    return Rate(
        label=label,
        series=series,
        headline=percent(sum(shares) / len(shares)),
        counts=page_wording.counts(rows),
        spans=spans,
    )


def _facts(persona: str, change: Change | None, found: Results) -> list[tuple[str, Sequence[str]]]:
    """The notes of a card, as titles and lines."""
    arm = against_persona(NaiveEgo(), persona).name
    against = found.of(arm)
    facts: list[tuple[str, Sequence[str]]] = []
    causes = {seed: page_wording.causes(row) for seed, row in against.items() if failures(row)}
    if causes:
        facts.append((page_wording.how_it_fails(persona, found.naive), page_wording.by_seed(causes)))
    prevented = {each.seed: each.sentences for each in found.preventability.get(arm, ()) if each.failures}
    if prevented:
        lines = {seed: " ".join(sentences) for seed, sentences in prevented.items()}
        facts.append((page_wording.PREVENTABLE, page_wording.by_seed(lines)))
    facts.append((page_wording.ORDINARY_DRIVER, _ordinary_driver(persona, found)))
    by_driver = [row for row in found.by_driver if row["population"] == persona]
    if by_driver:
        several = len(found.seeds) > 1
        facts.append((page_wording.BY_DRIVER, [page_wording.by_driver(row, several) for row in by_driver]))
    else:
        facts.append((page_wording.PERSONA_ALONE, _alone(persona, found)))
    if change is not None:
        arm = Arm(ego=change.ego(against=persona)).name
        alone = page_wording.counts(found.of(arm), f"the {change.made} ego")
        facts.append((page_wording.changed_ego_alone(change.made), alone))
    if any(failures(row) for row in found.of(NAIVE_ALONE.name).values()):
        facts.append((page_wording.CAUTION, [page_wording.FAILS_ALONE.format(naive=found.naive)]))
    return [(title, lines or [page_wording.NOT_PLAYED]) for title, lines in facts]


def _alone(persona: str, found: Results) -> list[str]:
    """How often a persona reaches its goal alone; of a crowd, each of its personas."""
    lines: list[str] = []
    for member in dict.fromkeys(found.crowds.get(persona, [persona])):
        reached = {seed: page_wording.reaches_goal(row) for seed, row in found.of(persona_alone(member).name).items()}
        named = f"{member}: " if persona in found.crowds else ""
        lines += [f"{named}{line}" for line in page_wording.by_seed(reached)]
    return lines


def _ordinary_driver(persona: str, found: Results) -> list[str]:
    ordinary = found.of(NAIVE_VS_SUMO.name)
    against = found.of(against_persona(NaiveEgo(), persona).name)
    lines = page_wording.counts(ordinary, f"the {found.naive}")
    seeds = [
        seed
        for seed, row in ordinary.items()
        if seed in against and row["failure_rate"] >= against[seed]["failure_rate"] > 0
    ]
    return lines + ([page_wording.as_many_failures(persona, seeds, len(ordinary) > 1)] if seeds else [])


def _test(row: Row) -> Test:
    return Test(
        question=row["question"],
        seed=row["seed"],
        metric=page_wording.METRICS.get(row["metric"], str(row["metric"])),
        effect=effect(row),
        p_value=p_number(row["p_value"]),
        p_holm=p_number(row["p_holm"]),
        mcnemar_p=p_number(row["mcnemar_p"]),
        verdict=Verdict(row["verdict"]).value,
    )


def _columns(persona: str, change: Change | None) -> list[ArmColumn]:
    """The columns of the figures, in the order of the paper's rounds."""
    name = persona if len(persona) <= LONGEST_LABEL else persona[: LONGEST_LABEL - 1] + "…"
    columns = [
        ArmColumn("naive\nalone", "alone", NAIVE_ALONE.name),
        ArmColumn("naive vs\nSUMO driver", "sumo", NAIVE_VS_SUMO.name),
        ArmColumn(f"naive vs\n{name}", "persona", against_persona(NaiveEgo(), persona).name),
    ]
    if change is not None:
        arm = against_persona(change.ego(against=persona), persona).name
        columns.append(ArmColumn(f"{change.made} vs\n{name}", "retrained", arm))
    return columns


def _drawn(column: ArmColumn, points: Sequence[Point], links: GameLinks) -> Column:
    """A column of a figure; it leads to the worst game of its arm."""
    return Column(label=column.label, series=column.series, points=points, link=links.worst(column.arm))


def _rates(rows: Mapping[int, Row]) -> list[Point]:
    return [
        Point(seed=seed, value=row["failure_rate"], low=row["failure_rate_low"], high=row["failure_rate_high"])
        for seed, row in rows.items()
    ]


def _speeds(arm: str, found: Results) -> list[Point]:
    points = []
    for seed, row in found.of(arm).items():
        games = found.speeds.get((arm, seed))
        points.append(
            Point(
                seed=seed,
                value=row["mean_speed_mps"],
                low=row["mean_speed_low_mps"],
                high=row["mean_speed_high_mps"],
                middle_half=None if games is None or games.empty else (games.quantile(0.25), games.quantile(0.75)),
            )
        )
    return points


def _values(columns: Sequence[ArmColumn], found: Results, column: str) -> dict[str, list[float]]:
    """Each column's values by its label, for the text of a figure."""
    return {each.label.replace("\n", " "): [row[column] for row in found.of(each.arm).values()] for each in columns}
