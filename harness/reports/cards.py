"""A persona's card: the verdicts, the failure rates behind them, and the two figures of the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from markupsafe import Markup

from harness.evaluation.strategies import NAIVE_ALONE, NAIVE_VS_SUMO, Arm, NaiveEgo, against_persona, persona_alone
from harness.reports.differences import Row, statistics
from harness.reports.distributions import MOST_LINES, Pairs, paired_figure, pairs_of, spread_figure, spreads_of
from harness.reports.figures import NOT_PLAYED, ArmBar, Point, rate_figure, speed_figure
from harness.reports.game_links import NO_LINKS, GameLinks
from harness.reports.key_figures import CardVerdict, KeyFigure, card_verdict, key_figures, portrait
from harness.reports.numbers import MISSING, SURE, interval, number, percent
from harness.reports.run_findings import RunFindings
from harness.reports.verdict_wording import QUESTIONS, Change, failures, failures_of, played

LONGEST_LABEL = 12
"""Letters of a persona's name that fit under a column of a figure."""
CAUTION = "Caution"
FAILS_ALONE = "The {naive} also fails alone: the persona does not cause all of its failures."
AS_MANY_FAILURES = (
    "This is not less often than against {persona}{seeds}: the ego also fails against an ordinary driver."
)
STILL_DRIVES = "The {made} ego alone: does it still drive without failures?"
SPREADS = "Average speed, trailing distance, least time to collision and hardest braking of the ego in each game"


@dataclass(frozen=True, kw_only=True)
class CardRate:
    """One arm's failure rate: large, and each training seed's count and interval."""

    label: str
    series: str
    headline: str
    counts: Sequence[str]
    spans: Sequence[tuple[float, float, float]]
    """Each seed's rate and the ends of its interval, in per cent."""


@dataclass(frozen=True, kw_only=True)
class Card:
    """The contents of the page on one persona, but for its tables."""

    persona: str
    anchor: str
    verdicts: Sequence[CardVerdict]
    rates: Sequence[CardRate]
    facts: Sequence[tuple[str, Sequence[str]]]
    tests: Sequence[Row]
    """Rows of `comparisons`."""
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


def card(
    persona: str, place: int, found: RunFindings, *, worst: tuple[str, str] | None, links: GameLinks = NO_LINKS
) -> Card:
    """The card of a persona; `place` makes the ids of its figures unique, `worst` is the game to show."""
    change = found.change if found.asked("RQ2", persona) else None
    columns, figures = _columns(persona, change), key_figures(persona, found)
    tests = [row for row in found.comparisons if row["persona"] == persona]
    paired, paired_note = _paired(persona, place, found, links) if change is not None else (None, "")
    return Card(
        persona=persona,
        anchor=f"persona-{place}",
        verdicts=[
            card_verdict(
                question.format(person=found.person, doing=found.change.doing), found.verdicts(name, persona), figures
            )
            for name, question in QUESTIONS.items()
        ],
        rates=[_rate(label, series, found.of(arm)) for label, series, arm in arm_labels(persona, change, found.naive)],
        facts=_facts(persona, change, found),
        tests=tests,
        rate_figure=rate_figure(
            [_drawn(each, _rates(found.of(each.arm)), links) for each in columns],
            f"rate{place}",
            _alternative("Failure rate", columns, found, "failure_rate", percent),
        ),
        speed_figure=speed_figure(
            [_drawn(each, _speeds(each.arm, found), links) for each in columns],
            f"speed{place}",
            _alternative(
                "Average speed of the ego", columns, found, "mean_speed_mps", lambda speed: f"{number(speed, 1)} m/s"
            ),
        ),
        paired_figure=paired,
        paired_note=paired_note,
        spread_figure=spread_figure(
            spreads_of(columns, found.games, links),
            f"spread{place}",
            _alternative(SPREADS, columns, found, "min_ttc_s", lambda time: f"least time {number(time, 1)} s"),
        ),
        portrait=portrait(found.persona_documents.get(persona, {})),
        key_figures=figures,
        statistics=[
            f"{row['question']}{', seed ' + str(row['seed']) if len(found.seeds) > 1 else ''}. {statistics(row)}"
            for row in tests
            if row["p_value"] == row["p_value"]
        ],
        worst=worst,
    )


def _alternative(
    title: str, columns: Sequence[ArmColumn], found: RunFindings, column: str, text: Callable[[float], str]
) -> str:
    """The text of a figure: each arm's values."""
    arms = [(each.label.replace("\n", " "), [row[column] for row in found.of(each.arm).values()]) for each in columns]
    return f"{title}. " + "; ".join(f"{label}: {', '.join(map(text, values)) or NOT_PLAYED}" for label, values in arms)


def _paired(persona: str, place: int, found: RunFindings, links: GameLinks) -> tuple[Markup, str]:
    """The figure of pairs and its note."""
    pairs: Sequence[Pairs] = pairs_of(persona, found.games, found.change, links)
    first, change = pairs[0], found.change
    count = len(first.before)
    alternative = (
        f"Average speed and least time to collision of {count} episodes against {persona}, naive and {change.made}: "
        f"{(first.before_failed & ~first.after_failed).sum()} failed before and no longer, "
        f"{(~first.before_failed & first.after_failed).sum()} fail only after {change.doing}."
    )
    note = f"{MOST_LINES} of the {count:,} episodes are drawn, evenly spaced." if count > MOST_LINES else ""
    return paired_figure(pairs, f"paired{place}", alternative, change.made), note


def arm_labels(persona: str, change: Change | None, naive: str) -> list[tuple[str, str, str]]:
    """Label, series and arm of each failure rate of a card; `change` is None without a round 2."""
    labels = [
        (f"{naive}, alone", "alone", NAIVE_ALONE.name),
        (f"{naive}, against {persona}", "persona", against_persona(NaiveEgo(), persona).name),
    ]
    if change is None:
        return labels
    arm = against_persona(change.ego(against=persona), persona).name
    return [*labels, (f"{change.made} ego, against {persona}", "retrained", arm)]


def _rate(label: str, series: str, rows: Mapping[int, Row]) -> CardRate:
    if not rows:
        return CardRate(label=label, series=series, headline=MISSING, counts=[NOT_PLAYED], spans=[])
    shares = [row["failure_rate"] for row in rows.values()]
    spans = [
        tuple(100.0 * row[name] for name in ("failure_rate", "failure_rate_low", "failure_rate_high"))
        for row in rows.values()
    ]
    headline = percent(sum(shares) / len(shares))
    return CardRate(label=label, series=series, headline=headline, counts=_counts(rows), spans=spans)


def _facts(persona: str, change: Change | None, found: RunFindings) -> list[tuple[str, Sequence[str]]]:
    """The notes of a card, as titles and lines."""
    arm = against_persona(NaiveEgo(), persona).name
    facts: list[tuple[str, Sequence[str]]] = []
    causes = {
        seed: f"collision in {row['collisions']}, rail contact in {row['rails']}, timeout in {row['timeouts']} games."
        for seed, row in found.of(arm).items()
        if failures(row)
    }
    if causes:
        facts.append((f"How the {found.naive} fails against {persona}", _by_seed(causes)))
    prevented = {each.seed: " ".join(each.sentences) for each in found.preventability.get(arm, ()) if each.failures}
    if prevented:
        facts.append(("Could it have been prevented?", _by_seed(prevented)))
    facts.append(("An ordinary SUMO driver in the persona's place", _ordinary_driver(persona, found)))
    by_driver = [row for row in found.by_driver if row["population"] == persona]
    if by_driver:
        lines = [_by_driver(row, several=len(found.seeds) > 1) for row in by_driver]
        facts.append(("RunFindings by the persona that drove", lines))
    else:
        facts.append(("The persona alone on the road", _alone(persona, found)))
    if change is not None:
        arm = Arm(ego=change.ego(against=persona)).name
        lines = _counts(found.of(arm), f"the {change.made} ego")
        facts.append((STILL_DRIVES.format(made=change.made), lines))
    if any(failures(row) for row in found.of(NAIVE_ALONE.name).values()):
        facts.append((CAUTION, [FAILS_ALONE.format(naive=found.naive)]))
    return [(title, lines or [NOT_PLAYED]) for title, lines in facts]


def _by_seed(lines: Mapping[int, str]) -> list[str]:
    """The lines, each with its seed before it when there are several."""
    return [f"Seed {seed}: {line}" if len(lines) > 1 else line[:1].upper() + line[1:] for seed, line in lines.items()]


def _counts(rows: Mapping[int, Row], player: str = "") -> list[str]:
    """A line per seed, e.g. "18 of 60 games (95 %: 18.8–43.2 %)"; with a player, "The ego fails in 18 of …"."""
    counts = {seed: f"{failures_of(row)} games ({_sure(row, 'failure_rate')})" for seed, row in rows.items()}
    return _by_seed({seed: f"{player} fails in {text}." if player else text for seed, text in counts.items()})


def _sure(row: Row, rate: str) -> str:
    return f"{SURE}: {interval(row[f'{rate}_low'], row[f'{rate}_high'])}"


def _by_driver(row: Row, *, several: bool) -> str:
    """How an ego fared against one persona of a population, a row of `populations`."""
    seed = f", seed {row['seed']}" if several else ""
    rate = f"{percent(row['failure_rate'])} of {played(row)} games"
    return f"{row['persona']}, in {row['arm']}{seed}: the ego fails in {rate} ({_sure(row, 'failure_rate')})."


def _alone(persona: str, found: RunFindings) -> list[str]:
    """How often a persona reaches its goal alone; of a crowd, each of its personas."""
    lines: list[str] = []
    for member in dict.fromkeys(found.crowds.get(persona, [persona])):
        reached = {
            seed: f"reaches its goal in {percent(row['non_ego_goal_rate'])} of {played(row)} games "
            f"({_sure(row, 'non_ego_goal_rate')})."
            for seed, row in found.of(persona_alone(member).name).items()
        }
        named = f"{member}: " if persona in found.crowds else ""
        lines += [f"{named}{line}" for line in _by_seed(reached)]
    return lines


def _ordinary_driver(persona: str, found: RunFindings) -> list[str]:
    ordinary = found.of(NAIVE_VS_SUMO.name)
    against = found.of(against_persona(NaiveEgo(), persona).name)
    seeds = [
        seed
        for seed, row in ordinary.items()
        if seed in against and row["failure_rate"] >= against[seed]["failure_rate"] > 0
    ]
    lines = _counts(ordinary, f"the {found.naive}")
    if seeds:
        named = f" (seed {', '.join(map(str, seeds))})" if len(ordinary) > 1 else ""
        lines.append(AS_MANY_FAILURES.format(persona=persona, seeds=named))
    return lines


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


def _drawn(column: ArmColumn, points: Sequence[Point], links: GameLinks) -> ArmBar:
    """A column of a figure; it leads to the worst game of its arm."""
    return ArmBar(label=column.label, series=column.series, points=points, link=links.worst(column.arm))


def _rates(rows: Mapping[int, Row]) -> list[Point]:
    return [
        Point(seed=seed, value=row["failure_rate"], low=row["failure_rate_low"], high=row["failure_rate_high"])
        for seed, row in rows.items()
    ]


def _speeds(arm: str, found: RunFindings) -> list[Point]:
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
