"""A persona's card: the verdicts, the failure rates behind them, and the figures of the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from markupsafe import Markup

from harness.evaluation.strategies import NAIVE_ALONE, NAIVE_VS_SUMO, persona_alone
from harness.reports.arm_figures import (
    MOST_LINES,
    NOT_PLAYED,
    ArmColumn,
    paired_figure,
    pairs_of,
    rate_figure,
    speed_figure,
    spread_figure,
)
from harness.reports.differences import statistics
from harness.reports.failing_paths import SPAN_S, FailingPath, paths_figures
from harness.reports.game_links import GameLinks
from harness.reports.human_ranges import crashes_alone
from harness.reports.key_figures import card_verdict, key_figures, portrait
from harness.reports.numbers import number, percent, sure
from harness.reports.run_tables import QUESTIONS, Row, RunTables, played
from harness.reports.verdict_wording import answer, over_trainings_statistics

LONGEST_LABEL = 12
"""Letters of a persona's name that fit under a column of a figure."""
SPREADS = "Average speed, trailing distance, least time to collision and hardest braking of the ego in each game"


def card(
    persona: str,
    place: int,
    tables: RunTables,
    links: GameLinks,
    scene: Mapping[str, Any] | None = None,
    paths: Sequence[FailingPath] = (),
) -> dict[str, Any]:
    """What the templates show of a persona; `place` makes the ids of its figures unique. `paths` are those of the games
    that an ego fails, on the road `scene`."""
    is_changed, figures = bool(tables.asked("RQ2", persona)), key_figures(persona, tables)
    columns = _columns(persona, is_changed, tables, links)
    labels = {columns[0].arm: f"{tables.naive}, alone", columns[2].arm: f"{tables.naive}, against {persona}"}
    labels |= {each.arm: f"{tables.change.made} ego, against {persona}" for each in columns[3:]}
    failed = {arm: tables.counts_of(arm)[0] for arm in labels}
    of_egos = [path for path in paths if path.persona == persona]
    paired, paired_note = _paired(persona, place, columns[2], columns[3], tables) if is_changed else (None, "")
    return {
        "persona": persona,
        "anchor": f"persona-{place}",
        "portrait": portrait(tables.manifest.get("persona_documents", {}).get(persona, {})),
        "worst": links.worst_of({arm: label for arm, label in labels.items() if arm != NAIVE_ALONE.name}),
        "paths_span_s": SPAN_S,
        "paths": list(paths_figures(of_egos, scene, labels, failed, f"paths{place}")) if scene else [],
        "verdicts": [
            card_verdict(
                question.format(person=tables.person, doing=tables.change.doing), answer(tables, name, persona), figures
            )
            for name, question in QUESTIONS.items()
        ],
        "key_figures": figures,
        "statistics": [
            f"{row['question']}{', seed ' + str(row['seed']) if tables.several_seeds else ''}. {statistics(row)}"
            for row in tables.comparisons.to_dict("records")
            if row["persona"] == persona and row["p_value"] == row["p_value"]
        ]
        + [
            over_trainings_statistics(row)
            for row in tables.over_trainings.to_dict("records")
            if row["persona"] == persona and row["p_value"] == row["p_value"]
        ],
        "rate_figure": rate_figure(
            columns, f"rate{place}", _alternative("Failure rate", columns, "failure_rate", percent)
        ),
        "speed_figure": speed_figure(
            columns,
            f"speed{place}",
            _alternative(
                "Average speed of the ego", columns, "mean_speed_mps", lambda speed: f"{number(speed, 1)} m/s"
            ),
        ),
        "paired_figure": paired,
        "paired_note": paired_note,
        "spread_figure": spread_figure(
            columns,
            f"spread{place}",
            _alternative(SPREADS, columns, "min_ttc_s", lambda time: f"least time {number(time, 1)} s"),
        ),
        "facts": _facts(persona, tables),
    }


def _columns(persona: str, is_changed: bool, tables: RunTables, links: GameLinks) -> list[ArmColumn]:
    name = persona if len(persona) <= LONGEST_LABEL else persona[: LONGEST_LABEL - 1] + "…"
    naive, changed = tables.arms_of("RQ2", persona)
    arms = [
        ("naive\nalone", "alone", NAIVE_ALONE.name),
        ("naive vs\nSUMO driver", "sumo", NAIVE_VS_SUMO.name),
        (f"naive vs\n{name}", "persona", naive),
    ]
    arms += [(f"{tables.change.made} vs\n{name}", "retrained", changed)] if is_changed else []
    columns = []
    for label, series, arm in arms:
        games = tables.games_of(arm)
        games = games.assign(address=links.of(games))
        rates, worst = tables.rates_of(arm), links.worst(arm)
        columns.append(ArmColumn(label=label, series=series, arm=arm, rates=rates, games=games, worst=worst))
    return columns


def _alternative(title: str, columns: Sequence[ArmColumn], quantity: str, text: Callable[[float], str]) -> str:
    """The text of a figure: each arm's values of a column of `summary`."""
    arms = [(each.label.replace("\n", " "), [row[quantity] for row in each.rates.values()]) for each in columns]
    return f"{title}. " + "; ".join(f"{label}: {', '.join(map(text, values)) or NOT_PLAYED}" for label, values in arms)


def _paired(persona: str, place: int, before: ArmColumn, after: ArmColumn, tables: RunTables) -> tuple[Markup, str]:
    """The figure of pairs, and how many of the episodes are drawn in it, if not all."""
    pairs, change = pairs_of(before, after), tables.change
    failed, failed_after = (pairs[name].fillna(0).astype(bool) for name in ("ego_failed", "ego_failed_after"))
    alternative = (
        f"Average speed and least time to collision of {len(pairs)} episodes against {persona}, naive and "
        f"{change.made}: {(failed & ~failed_after).sum()} failed before and no longer, "
        f"{(~failed & failed_after).sum()} fail only after {change.doing}."
    )
    note = f"{MOST_LINES} of the {len(pairs):,} episodes are drawn, evenly spaced." if len(pairs) > MOST_LINES else ""
    return paired_figure(pairs, f"paired{place}", alternative, change.made), note


def _facts(persona: str, tables: RunTables) -> tuple[str, list[str]]:
    """What the first screen does not say: how often each persona of a population makes the ego fail, or else how the
    persona drives alone."""
    by_driver = [row for row in tables.populations.to_dict("records") if row["population"] == persona]
    if by_driver:
        return "Results by the persona that drove", [_by_driver(row, several=tables.several_seeds) for row in by_driver]
    return "The persona alone on the road", _alone(persona, tables) or [NOT_PLAYED]


def _by_seed(lines: Mapping[int, str]) -> list[str]:
    """The lines, each with its seed before it when there are several."""
    return [f"Seed {seed}: {line}" if len(lines) > 1 else line[:1].upper() + line[1:] for seed, line in lines.items()]


def _sure(row: Row, rate: str) -> str:
    return sure(row[f"{rate}_low"], row[f"{rate}_high"])


def _by_driver(row: Row, *, several: bool) -> str:
    seed = f", seed {row['seed']}" if several else ""
    rate = f"{percent(row['failure_rate'])} of {played(row)} games"
    return f"{row['persona']}, in {row['arm']}{seed}: the ego fails in {rate} ({_sure(row, 'failure_rate')})."


def _alone(persona: str, tables: RunTables) -> list[str]:
    """How often a persona reaches its goal and crashes alone; of a crowd, each of its personas."""
    lines: list[str] = []
    for member in dict.fromkeys(tables.crowds.get(persona, [persona])):
        reached = {
            seed: f"reaches its goal in {percent(row['non_ego_goal_rate'])} of {played(row)} games "
            f"({_sure(row, 'non_ego_goal_rate')}){_crashes(tables, member, seed)}."
            for seed, row in tables.rates_of(persona_alone(member).name).items()
        }
        named = f"{member}: " if persona in tables.crowds else ""
        lines += [f"{named}{line}" for line in _by_seed(reached)]
    return lines


def _crashes(tables: RunTables, persona: str, seed: int) -> str:
    crashes = crashes_alone(tables.realism, persona, seed)
    return f", with {crashes}" if crashes else ""
