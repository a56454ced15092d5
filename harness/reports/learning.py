"""How players came to be: the learning curves of trainings with their events, and the searches of egos that can't be
trained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd
from markupsafe import Markup

from harness.config.training import ATTENTIVE_SHARE, Training
from harness.evaluation.competence import ALONE, DID_NOT_LEARN
from harness.evaluation.strategies import ManyPersonas, NaiveEgo, PersonaNonEgo, Strategy, player_of, stage_id
from harness.game.roles import EGO
from harness.reports.figures import INK, SERIES, figure_of, svg
from harness.reports.numbers import MISSING, number, percent, short, steps_text, trimmed
from harness.reports.run_tables import Row, RunTables

_LINES = ("-", "--", ":", "-.")


def learning(tables: RunTables) -> list[dict[str, Any]]:
    """Each training in order of first appearance: `stage`, `figure` with a curve per seed, and why each `stops`."""
    training, found = tables.training, []
    for place, stage in enumerate(training["stage"].unique(), 1):
        rows = training[training["stage"] == stage]
        entries = {seed: tables.stages.get(stage_id(str(stage), seed), {}) for seed in sorted(rows["seed"].unique())}
        events = {seed: _events(str(stage), entry, tables) for seed, entry in entries.items()}
        stops = {
            seed: f"{entry['steps']:,} steps ({stopped(entry)})"
            for seed, entry in entries.items()
            if entry.get("steps") is not None
        }
        found.append(
            {
                "stage": str(stage),
                "figure": _learning_figure(rows, entries, events, _series(tables.strategies.get(str(stage))), place),
                "stops": [f"seed {seed}: {text}" if len(entries) > 1 else text for seed, text in stops.items()],
                "events": _told(events),
            }
        )
    return found


class _Event(NamedTuple):
    """What changes in a training after so many steps."""

    steps: int
    words: str


LAPSES_BEGIN, NARROWS = "lapses of attention begin", "actions become narrow"


def _events(stage: str, entry: Mapping[str, Any], tables: RunTables) -> list[_Event]:
    """The events of a training that has ended, in order: when a person's lapses of attention begin, and when the last
    part begins, in which the deviation of its actions becomes narrow. Its end is no event."""
    steps, budget = entry.get("steps"), entry.get("budget_steps")
    if steps is None or budget is None:
        return []
    found, strategy = [], tables.strategies.get(stage)
    documents = tables.manifest.get("persona_documents", {})
    learners = strategy.personas if isinstance(strategy, ManyPersonas) else (entry.get("persona", ""),)
    is_of_round_1 = isinstance(strategy, PersonaNonEgo) and strategy.round == 1
    learns_attentive = is_of_round_1 or isinstance(strategy, ManyPersonas)
    if learns_attentive and any((documents.get(each) or {}).get("attention") for each in learners):
        found.append(_Event(round(ATTENTIVE_SHARE * budget), LAPSES_BEGIN))
    share = tables.campaign.get("training", {}).get("narrowing_share", Training().narrowing_share)
    end = steps if entry.get("stopped") == "converged" else budget
    if share:
        found.append(_Event(max(round(end - share * budget), 0), NARROWS))
    return sorted(each for each in found if each.steps < steps)


def _told(events: Mapping[int, Sequence[_Event]]) -> list[str]:
    """The events in words; those of several seeds that are at the same step as one."""
    seeds: dict[_Event, list[int]] = {}
    for seed, found in events.items():
        for each in found:
            seeds.setdefault(each, []).append(seed)
    lines = []
    for event in sorted(seeds):
        whose = f"seed {', '.join(map(str, seeds[event]))}: " if len(seeds[event]) < len(events) else ""
        lines.append(f"{whose}{event.words} at {steps_text(event.steps)}")
    return lines


def _learning_figure(
    training: pd.DataFrame,
    entries: Mapping[int, Mapping[str, Any]],
    events: Mapping[int, Sequence[_Event]],
    series: str,
    place: int,
) -> Markup:
    """Mean payoff and failure rate of the learner over its steps, a line per seed, where each stopped, and dotted lines
    at the events."""
    with figure_of(3.7, 3.9) as figure:
        payoff, failure = figure.subplots(2, 1, sharex=True)
        ends = []
        for (seed, entry), linestyle in zip(entries.items(), _LINES * len(entries), strict=False):
            curve = training[training["seed"] == seed].sort_values("steps")
            line: dict[str, Any] = {"color": SERIES[series], "linestyle": linestyle, "markersize": 3}
            line["marker"] = "o" if len(curve) <= 30 else ""
            payoff.plot(curve["steps"], curve["mean_payoff"], label=f"seed {seed}", **line)
            failure.plot(curve["steps"], curve["failure_rate"], **line)
            ends.append(f"seed {seed} ends at mean payoff {curve['mean_payoff'].iloc[-1]:.3g}")
            if entry.get("steps") is not None:
                for axes in (payoff, failure):
                    axes.axvline(entry["steps"], color=INK, linewidth=1, linestyle=linestyle)
        for event in sorted({each for found in events.values() for each in found}):
            for axes in (payoff, failure):
                axes.axvline(event.steps, color=INK, linewidth=0.8, linestyle=":")
        if len(entries) > 1:
            payoff.legend(frameon=False, fontsize=8)
        payoff.set_ylabel("mean payoff")
        payoff.yaxis.set_major_formatter(lambda value, _: short(value))
        failure.set_ylabel("failure rate (%)")
        failure.yaxis.set_major_formatter(lambda share, _: f"{share * 100:.3g}")
        failure.set_ylim(0, max([0.05, *training["failure_rate"].dropna()]) * 1.08)
        failure.set_xlim(left=0)
        failure.xaxis.set_major_formatter(lambda steps, _: steps_text(steps))
        failure.locator_params(axis="x", nbins=5)
        failure.set_xlabel("training steps")
        stage = training["stage"].iloc[0]
        alternative = f"Learning curve of {stage}: mean payoff and failure rate over training steps; {'; '.join(ends)}"
        return svg(figure, f"curve{place}", alternative)


def stopped(stage: Mapping[str, Any]) -> str:
    reason = stage.get("stopped")
    text = {"converged": "early: converged", "budget": "budget used", None: MISSING}.get(reason, str(reason))
    if reason == DID_NOT_LEARN and stage.get("played"):
        asked = f"at least {percent(stage['goal_share_asked'])}"
        text += f": goal in {stage['goals']} of {stage['played']} games {stage.get('where') or ALONE}, {asked} asked"
    if reason == DID_NOT_LEARN and stage.get("failing_roads"):
        text += f"; most of its last games alone failed on {', '.join(stage['failing_roads'])}"
    return text


def _series(strategy: Strategy | None) -> str:
    """The colour of a curve: of the naive ego, of an ego of a later round, or of a non-ego."""
    match strategy:
        case NaiveEgo():
            return "alone"
        case None:
            return "persona"
        case _:
            return "retrained" if player_of(strategy) == EGO else "persona"


def searches(reconfiguration: pd.DataFrame) -> list[dict[str, Any]]:
    """Each search of `reconfiguration`, the table, in order of first appearance.

    `stage` has its seed when there are several. `parameters` are rows with the name (`parameter`), the given `value`,
    `value_found`, and the bounds `low` and `high` of the search. `document` is the path of the driver that it found,
    from the run folder.
    """
    several, found = reconfiguration["seed"].nunique() > 1, []
    for place, ((stage, seed), rows) in enumerate(reconfiguration.groupby(["stage", "seed"], sort=False), 1):
        title = f"{stage}, seed {seed}" if several else str(stage)
        trials = rows.drop_duplicates("trial").sort_values("trial")
        given, chosen = rows[rows["trial"] == 0], rows[rows["chosen"]]
        summary = _summary(trials, given.iloc[0], chosen.iloc[0])
        alternative = f"Mean payoff of each trial of {title}, and the best so far. {summary}"
        both = given.merge(chosen[["parameter", "value"]], on="parameter", suffixes=("", "_found"))
        found.append(
            {
                "stage": title,
                "figure": _figure(trials, f"search{place}", alternative),
                "summary": summary,
                "parameters": both.to_dict("records"),
                "document": f"policies/{stage_id(str(stage), seed)}/driver.toml",
            }
        )
    return found


def _summary(trials: pd.DataFrame, first: Row, best: Row) -> str:
    text = f"{len(trials)} trials; the best is trial {best['trial']}: {_trial(best)}. As given: {_trial(first)}."
    if best["trial"] == first["trial"]:
        text = f"{len(trials)} trials, none better than the ego as given: {_trial(first)}."
    unplayed = int(trials["mean_payoff"].isna().sum())
    errors = "; ".join(trials.loc[trials["error"] != "", "error"].unique()[:3])
    return text + (f" {unplayed} could not be played: {errors}" if unplayed else "")


def _trial(trial: Row) -> str:
    return f"mean payoff {number(trial['mean_payoff'], 2)}, failures in {trimmed(trial['failure_rate'] * 100, 1)} %"


def _figure(trials: pd.DataFrame, name: str, alternative: str) -> Markup:
    with figure_of(3.7, 3.0) as figure:
        axes = figure.subplots()
        colour = SERIES["retrained"]
        axes.plot(trials["trial"], trials["mean_payoff"], "o", color=colour, markersize=3.5, alpha=0.5)
        axes.step(trials["trial"], trials["best_payoff"], where="post", color=colour, linewidth=1.8)
        axes.axhline(trials["mean_payoff"].iloc[0], color=INK, linewidth=0.8, linestyle=":")
        axes.annotate(
            "as given", (1, trials["mean_payoff"].iloc[0]), (0, -4), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", va="top", fontsize=9,
        )  # fmt: skip
        axes.set_xlabel("trial")
        axes.set_ylabel("mean payoff of the ego")
        axes.yaxis.set_major_formatter(lambda value, _: short(value))
        axes.locator_params(axis="x", integer=True)
        return svg(figure, name, alternative)
