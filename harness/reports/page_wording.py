"""The sentences of the report that are neither verdicts nor of the game: captions, notes, alternatives of figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import (
    NAIVE_ALONE,
    Arm,
    EgoStrategy,
    NaiveEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    SumoNonEgo,
    against_persona,
    strategy_name,
)
from harness.reports.differences import Row
from harness.reports.numbers import MISSING, SURE, interval, number, percent, steps_text, trimmed
from harness.reports.treatment import Change
from harness.reports.wording import failures_of, played

if TYPE_CHECKING:
    from harness.reports.results import Results  # imports pandas, and resuming does without

QUICK = "Quick run: fewer training steps than table 1; not for conclusions."
NOT_PLAYED = "not played"
CAPTIONS = {
    "comparisons": "Every test of the campaign.",
    "summary": "A row per arm and training seed.",
    "training": "A row per window of a learning curve.",
    "episodes": "A row per game.",
    "reconfiguration": "A row per trial and parameter of a search.",
}
"""Of the tables that are shown as the CSV files have them."""
METRICS = {"failure": "failures", "mean_speed": "average speed"}
OUTCOMES = {"rail": "contact with the rail", "timeout": "out of time", "goal": "goal reached"}
"""Outcomes in words, where the name is not clear."""

ORDINARY_DRIVER = "An ordinary SUMO driver in the persona's place"
PREVENTABLE = "Could it have been prevented?"
BY_DRIVER = "Results by the persona that drove"
PERSONA_ALONE = "The persona alone on the road"
CAUTION = "Caution"
FAILS_ALONE = "The {naive} also fails alone: the persona does not cause all of its failures."

MIXED_VERSIONS = "This run mixes versions: its results may differ from those of a single version."
UNKNOWN_VERSION = "of no known version"

# --- method and provenance ---


def asked_alone(manifest: Mapping[str, Any]) -> str:
    """What the campaign asks of players alone; empty if nothing."""
    asked = manifest.get("campaign", {}).get("competence", {})
    names = {"ego_goal_share": "an ego", "non_ego_goal_share": "a non-ego"}
    bounds = [f"{percent(asked[key])} of {player}" for key, player in names.items() if asked.get(key)]
    if not bounds:
        return ""
    return (
        f"A question is answered only if its players reach their goals alone in a share of games: {', '.join(bounds)}."
    )


def made_with(versions: str, stages: Sequence[str]) -> str:
    """Which stages were made with these versions."""
    return f"  by {versions}: {', '.join(stages)}"


# --- a persona's card ---


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


def by_seed(lines: Mapping[int, str]) -> list[str]:
    """The lines, each with its seed before it when there are several."""
    return [f"Seed {seed}: {line}" if len(lines) > 1 else line[:1].upper() + line[1:] for seed, line in lines.items()]


def counts(rows: Mapping[int, Row], player: str = "") -> list[str]:
    """A line per seed, e.g. "18 of 60 games (95 %: 18.8–43.2 %)"; with a player, "The ego fails in 18 of …"."""
    return by_seed({seed: _count(row, player) for seed, row in rows.items()})


def _count(row: Row, player: str) -> str:
    text = f"{failures_of(row)} games ({_sure(row, 'failure_rate')})"
    return f"{player} fails in {text}." if player else text


def _sure(row: Row, rate: str) -> str:
    return f"{SURE}: {interval(row[f'{rate}_low'], row[f'{rate}_high'])}"


def how_it_fails(persona: str, naive: str) -> str:
    """The title of the causes of the failures of the ego before round 2."""
    return f"How the {naive} fails against {persona}"


def causes(row: Row) -> str:
    """Of what kinds an arm's failures are."""
    return f"collision in {row['collisions']}, rail contact in {row['rails']}, timeout in {row['timeouts']} games."


def as_many_failures(persona: str, seeds: Sequence[int], several: bool) -> str:
    """That the ego fails no less often against an ordinary driver, in these of several seeds."""
    named = f" (seed {', '.join(map(str, seeds))})" if several else ""
    return f"This is not less often than against {persona}{named}: the ego also fails against an ordinary driver."


def by_driver(row: Row, several: bool) -> str:
    """How an ego fared against one persona of a population, a row of `populations`."""
    seed = f", seed {row['seed']}" if several else ""
    rate = f"{percent(row['failure_rate'])} of {played(row)} games"
    return f"{row['persona']}, in {row['arm']}{seed}: the ego fails in {rate} ({_sure(row, 'failure_rate')})."


def reaches_goal(row: Row) -> str:
    """How often a persona reaches its goal alone."""
    rate = percent(row["non_ego_goal_rate"])
    return f"reaches its goal in {rate} of {played(row)} games ({_sure(row, 'non_ego_goal_rate')})."


def changed_ego_alone(made: str) -> str:
    """The title of the failures of the ego of round 2 on its own."""
    return f"The {made} ego alone: does it still drive without failures?"


def paired_alternative(persona: str, change: Change, *, pairs: int, mended: int, broken: int) -> str:
    """The text of the figure of pairs."""
    return (
        f"Average speed and least time to collision of {pairs} episodes against {persona}, naive and {change.made}: "
        f"{mended} failed before and no longer, {broken} fail only after {change.doing}."
    )


def pairs_drawn(drawn: int, count: int) -> str:
    """How many of the pairs a figure draws; empty if all."""
    return f"{drawn} of the {count:,} episodes are drawn, evenly spaced." if count > drawn else ""


def rate_alternative(columns: Mapping[str, Sequence[float]]) -> str:
    """The text of the figure of failure rates, of each column's values by its label."""
    return "Failure rate. " + _alternative({label: list(map(percent, rates)) for label, rates in columns.items()})


def speed_alternative(columns: Mapping[str, Sequence[float]]) -> str:
    """The text of the figure of average speeds."""
    texts = {label: [f"{number(speed, 1)} m/s" for speed in speeds] for label, speeds in columns.items()}
    return "Average speed of the ego. " + _alternative(texts)


def spread_alternative(columns: Mapping[str, Sequence[float]]) -> str:
    """The text of the figure of single games, of least times to collision."""
    texts = {label: [f"least time {number(time, 1)} s" for time in times] for label, times in columns.items()}
    title = "Average speed, trailing distance, least time to collision and hardest braking of the ego in each game. "
    return title + _alternative(texts)


def _alternative(columns: Mapping[str, Sequence[str]]) -> str:
    return "; ".join(f"{label}: {', '.join(values) or NOT_PLAYED}" for label, values in columns.items())


# --- learning and searches ---


def stopped(stage: Mapping[str, Any]) -> str:
    """Why a training stopped."""
    reason = stage.get("stopped")
    text = {"converged": "early: converged", "budget": "budget used", None: MISSING}.get(reason, str(reason))
    if reason == DID_NOT_LEARN and stage.get("played"):
        asked = f"at least {percent(stage['goal_share_asked'])}"
        text += f": goal in {stage['goals']} of {stage['played']} games alone, {asked} asked"
    return text


def stopped_at(steps: float, reason: str) -> str:
    """Where a learning curve ends."""
    reasons = {"converged": "stopped early", "budget": "budget used", DID_NOT_LEARN: DID_NOT_LEARN}
    end = reasons.get(reason, "stopped")  # a figure draws no text that a run folder brings
    return f"{end}: {steps_text(steps)}"


def stop(stage: Mapping[str, Any], seed: int, several: bool) -> str:
    """The steps of a training that stopped, with its seed if there are several."""
    text = f"{stage['steps']:,} steps ({stopped(stage)})"
    return f"seed {seed}: {text}" if several else text


def curve_alternative(stage: str, last_payoffs: Mapping[int, float]) -> str:
    """The text of a learning curve, of the last mean payoff of each seed."""
    ends = [f"seed {seed} ends at mean payoff {payoff:.3g}" for seed, payoff in last_payoffs.items()]
    return f"Learning curve of {stage}: mean payoff and failure rate over training steps; " + "; ".join(ends)


def search_summary(trials: int, first: Row, best: Row, unplayed: int, errors: Sequence[str]) -> str:
    """What a search found, of its first and its best trial; `errors` are those of the trials not played."""
    text = f"{trials} trials; the best is trial {best['trial']}: {_trial(best)}. As given: {_trial(first)}."
    if best["trial"] == first["trial"]:
        text = f"{trials} trials, none better than the ego as given: {_trial(first)}."
    return text + (f" {unplayed} could not be played: {'; '.join(errors)}" if unplayed else "")


def _trial(trial: Row) -> str:
    return f"mean payoff {number(trial['mean_payoff'], 2)}, failures in {trimmed(trial['failure_rate'] * 100, 1)} %"


def search_alternative(title: str, summary: str) -> str:
    """The text of a search's figure."""
    return f"Mean payoff of each trial of {title}, and the best so far. {summary}"


# --- games and arms ---


def worst_game(game: str, outcome: str, least_time_s: float, partner: str = "") -> str:
    """A game in words: its name, how it ended (`partner`: with what), and its least time to collision if there is
    one."""
    nearest = f", least time to collision {number(least_time_s, 1)} s" if 0 < least_time_s < math.inf else ""
    return f"{game}: {OUTCOMES.get(outcome, outcome)}{partner}{nearest}"


def glossary(arms: Sequence[str], records: Mapping[str, Arm], found: Results) -> list[tuple[str, str]]:
    """Each arm that is planned, and what it pairs."""
    return [(name, arm_in_words(records[name], found)) for name in arms if name in records]


def arm_in_words(arm: Arm, found: Results) -> str:
    """What an arm pairs."""
    several = "s" if found.people > 1 else ""
    if arm.best_response_of is not None:
        player = ("the ego", "the non-ego")[arm.best_response_of]
        return f"{arm.pair.name}, {player} replaced by its best response"
    match arm:
        case Arm(ego=None, non_ego=non_ego) if non_ego is not None:
            name = strategy_name(non_ego)
            return f"{f'one {name} driver at a time' if several else f'the non-ego {name}'} without the ego"
        case Arm(ego=NaiveEgo(), non_ego=None):
            return f"the {found.naive} on the road without the non-ego{several}"
        case Arm(ego=ego, non_ego=None) if ego is not None:
            return f"{_ego_in_words(ego, found.naive)}, without the non-ego{several}"
        case Arm(ego=NaiveEgo(), non_ego=SumoNonEgo()):
            if several:
                return f"the {found.naive} with ordinary law-abiding SUMO drivers in the non-egos' places"
            return f"the {found.naive} with an ordinary law-abiding SUMO driver in the non-ego's place"
        case Arm(ego=RetrainedEgo(against=against) | ReconfiguredEgo(against=against) as ego, non_ego=non_ego) if (
            non_ego is not None and against == strategy_name(non_ego)
        ):
            same = found.who(against).removeprefix("the ") or against
            return f"{_ego_in_words(ego, found.naive)}, against the same {same}"
        case Arm(ego=ego, non_ego=non_ego) if ego is not None and non_ego is not None:
            name = strategy_name(non_ego)
            return f"{_ego_in_words(ego, found.naive)} against {found.who(name) or f'the non-ego {name}'}"
    raise ValueError("an arm has at least one player")


def _ego_in_words(ego: EgoStrategy, naive: str) -> str:
    match ego:
        case NaiveEgo():
            return f"the {naive}"
        case ReconfiguredEgo(against=against):
            return f"the ego tuned against {against}"
        case RetrainedEgo(against=against, round=2):
            return f"the ego retrained against {against}"
        case _:
            return f"the ego {strategy_name(ego)}"
