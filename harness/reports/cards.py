"""A persona's card: the verdicts, the failure rates they rest on, and the two figures of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from harness.evaluation.comparison import Verdict
from harness.reports import wording
from harness.reports.distributions import MOST_LINES, paired_figure, pairs_of, spread_figure, spreads_of
from harness.reports.figures import Column, Point, rate_figure, speed_figure
from harness.reports.results import Results
from harness.reports.wording import Row, Conclusion, failures, failures_of, interval, percent, played

QUESTIONS = {
    "RQ1": "Does the persona make the ego fail?",
    "RQ2": "Does {doing} mend it?",
}
METRICS = {"failure": "failures", "mean_speed": "average speed"}
LONGEST_LABEL = 12
"""Letters of a persona's name that fit under a column of a figure."""
SURE = "95\N{NO-BREAK SPACE}%"


@dataclass(frozen=True)
class Rate:
    """One arm's failure rate: large, and each training seed's count and interval."""

    label: str
    series: str
    headline: str
    counts: Sequence[str]
    spans: Sequence[tuple[float, float, float]]
    """Each seed's rate and the ends of its interval, in per cent."""


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Card:
    """All that the page says of one persona before its tables."""

    persona: str
    anchor: str
    verdicts: Sequence[tuple[str, Conclusion]]
    """Each with its question in plain words."""
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
    worst: tuple[str, str] | None
    """Key and description of the game to show: the worst that is embedded."""


def card(persona: str, place: int, found: Results, worst: tuple[str, str] | None) -> Card:
    """The card of a persona; `place` tells its figures' ids from those of other cards, `worst` is the game to show."""
    rows = [row for row in found.comparisons if row["persona"] == persona]
    made = found.change.made if found.asked("RQ2", persona) else None
    arms = [
        ("naive ego, alone", "alone", "naive_alone"),
        (f"naive ego, against {persona}", "persona", f"naive_vs_{persona}"),
    ]
    if made:
        arms.append((f"{made} ego, against {persona}", "retrained", f"{made}_vs_{persona}"))
    columns = _columns(persona, made)
    paired, note = _paired(persona, place, found) if made else (None, "")
    return Card(
        persona,
        f"persona-{place}",
        [
            (words.format(doing=found.change.doing), found.verdicts(question, persona))
            for question, words in QUESTIONS.items()
        ],
        [_rate(label, series, found.of(arm)) for label, series, arm in arms],
        _facts(persona, made, found),
        [_test(row) for row in rows],
        rate_figure(
            [Column(label, series, _rates(found.of(arm))) for label, series, arm in columns],
            f"rate{place}",
            "Failure rate. " + _alternative(columns, found, "failure_rate", percent),
        ),
        speed_figure(
            [Column(label, series, _speeds(arm, found)) for label, series, arm in columns],
            f"speed{place}",
            "Average speed of the ego. "
            + _alternative(columns, found, "mean_speed_mps", lambda speed: f"{wording.number(speed, 1)} m/s"),
        ),
        paired,
        note,
        spread_figure(
            spreads_of(columns, found.games),
            f"spread{place}",
            "Average speed, trailing distance, least time to collision and hardest braking of the ego in each game. "
            + _alternative(columns, found, "min_ttc_s", lambda time: f"least time {wording.number(time, 1)} s"),
        ),
        worst,
    )


def _paired(persona: str, place: int, found: Results) -> tuple[Markup, str]:
    change = found.change
    pairs = pairs_of(persona, found.games, change.made)
    mended = int((pairs[0].before_failed & ~pairs[0].after_failed).sum())
    broken = int((~pairs[0].before_failed & pairs[0].after_failed).sum())
    alternative = (
        f"Average speed and least time to collision of {len(pairs[0].before)} episodes against {persona}, naive and "
        f"{change.made}: {mended} failed before and no longer, {broken} fail only after {change.doing}."
    )
    count = len(pairs[0].before)
    note = f"{MOST_LINES} of the {count:,} episodes are drawn, evenly chosen." if count > MOST_LINES else ""
    return paired_figure(pairs, f"paired{place}", alternative, change.made), note


def _rate(label: str, series: str, rows: Mapping[int, Row]) -> Rate:
    if not rows:
        return Rate(label, series, "–", ["not played"], [])
    shares = [row["failure_rate"] for row in rows.values()]
    spans = [
        tuple(100.0 * row[name] for name in ("failure_rate", "failure_rate_low", "failure_rate_high"))
        for row in rows.values()
    ]
    return Rate(label, series, percent(sum(shares) / len(shares)), _counts(rows), spans)


def _counts(rows: Mapping[int, Row], who: str = "") -> list[str]:
    """A line per seed, e.g. "18 of 60 games (95 %: 18.8–43.2 %)"; with `who`, "The ego fails in 18 of …"."""
    return _by_seed(
        {
            seed: f"{who and f'{who} fails in '}{failures_of(row)} games ({SURE}: "
            f"{interval(row['failure_rate_low'], row['failure_rate_high'])})" + "." * bool(who)
            for seed, row in rows.items()
        }
    )


def _by_seed(lines: Mapping[int, str]) -> list[str]:
    """The lines, each with its seed before it when there are several."""
    return [f"Seed {seed}: {line}" if len(lines) > 1 else line[:1].upper() + line[1:] for seed, line in lines.items()]


def _facts(persona: str, made: str | None, found: Results) -> list[tuple[str, Sequence[str]]]:
    naive, against = found.of("naive_alone"), found.of(f"naive_vs_{persona}")
    ordinary, alone = found.of("naive_vs_sumo"), found.of(f"{persona}_alone")
    facts: list[tuple[str, Sequence[str]]] = []

    def say(title: str, lines: Sequence[str]) -> None:
        facts.append((title, lines or ["not played"]))

    causes = {
        seed: f"collision in {row['collisions']}, rail contact in {row['rails']}, too late in {row['timeouts']} games."
        for seed, row in against.items()
        if failures(row)
    }
    if causes:
        say(f"How the naive ego fails against {persona}", _by_seed(causes))
    lines = _counts(ordinary, "the naive ego")
    as_bad = [
        seed
        for seed, row in ordinary.items()
        if seed in against and row["failure_rate"] >= against[seed]["failure_rate"] > 0
    ]
    if as_bad:
        seeds = f" (seed {', '.join(map(str, as_bad))})" if len(ordinary) > 1 else ""
        lines.append(f"That is no less often than against {persona}{seeds}: an ordinary driver does it too.")
    say("An ordinary SUMO driver in the persona's place", lines)
    if drove := [row for row in found.drove if row["population"] == persona]:
        say("Who drove, and how the ego fared", [_by_who(row, len(found.seeds) > 1) for row in drove])
    reaches = {
        seed: f"reaches its goal in {percent(row['non_ego_goal_rate'])} of {played(row)} games ({SURE}: "
        f"{interval(row['non_ego_goal_rate_low'], row['non_ego_goal_rate_high'])})."
        for seed, row in alone.items()
    }
    if not drove:
        say("The persona alone on the road", _by_seed(reaches))
    if made:
        unbroken = _counts(found.of(f"{made}_alone_{persona}"), f"the {made} ego")
        say(f"The {made} ego alone: is what worked unbroken?", unbroken)
    if any(failures(row) for row in naive.values()):
        say(
            "Caution",
            ["The naive ego fails alone as well: part of its failures are not the persona's doing."],
        )
    return facts


def _by_who(row: Row, several: bool) -> str:
    """How an ego fared against one of a population's people."""
    seed = f", seed {row['seed']}" if several else ""
    rate = f"{percent(row['failure_rate'])} of {played(row)} games"
    sure = f"{SURE}: {interval(row['failure_rate_low'], row['failure_rate_high'])}"
    return f"{row['persona']}, in {row['arm']}{seed}: the ego fails in {rate} ({sure})."


def _test(row: Row) -> Test:
    return Test(
        row["question"],
        row["seed"],
        METRICS.get(row["metric"], str(row["metric"])),
        wording.effect(row),
        wording.p_number(row["p_value"]),
        wording.p_number(row["p_holm"]),
        wording.p_number(row["mcnemar_p"]),
        Verdict(row["verdict"]).value,
    )


def _columns(persona: str, made: str | None) -> list[tuple[str, str, str]]:
    """Label, series and arm of each column of the figures; the order is the paper's story."""
    name = persona if len(persona) <= LONGEST_LABEL else persona[: LONGEST_LABEL - 1] + "…"
    columns = [
        ("naive\nalone", "alone", "naive_alone"),
        ("naive vs\nSUMO driver", "sumo", "naive_vs_sumo"),
        (f"naive vs\n{name}", "persona", f"naive_vs_{persona}"),
    ]
    return columns + ([(f"{made} vs\n{name}", "retrained", f"{made}_vs_{persona}")] if made else [])


def _rates(rows: Mapping[int, Row]) -> list[Point]:
    return [
        Point(seed, row["failure_rate"], row["failure_rate_low"], row["failure_rate_high"])
        for seed, row in rows.items()
    ]


def _speeds(arm: str, found: Results) -> list[Point]:
    points = []
    for seed, row in found.of(arm).items():
        games = found.speeds.get((arm, seed))
        middle = None if games is None or games.empty else (games.quantile(0.25), games.quantile(0.75))
        low, high = row["mean_speed_low_mps"], row["mean_speed_high_mps"]
        points.append(Point(seed, row["mean_speed_mps"], low, high, middle))
    return points


def _alternative(columns: Sequence[tuple[str, str, str]], found: Results, column: str, text: wording.Number) -> str:
    """What a figure shows, for who can't see it."""
    return "; ".join(
        label.replace("\n", " ")
        + ": "
        + (", ".join(text(row[column]) for row in found.of(arm).values()) or "not played")
        for label, _, arm in columns
    )
