"""The first screen of the page: why the ego fails, whether that could have been prevented, and what to do now, with the
commands to type in the run folder."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import EgoStrategy, NaiveEgo, against_persona
from harness.reports.game_links import most_severe
from harness.reports.player_data import key
from harness.reports.provenance import command_of
from harness.reports.run_findings import RunFindings
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import failures

FINISH = "Some stages are not done. The same command continues; finished stages are skipped."
LEARN_BY_EXAMPLE = (
    "{persona} did not learn to drive here. Let people imitate a rule-based driver before their training: add this to "
    "the campaign, and run it again."
)
IMITATION = "[non_ego_training]\nimitation = true"
WATCH_REMAINING = "See how the {made} ego still fails against {persona}: its worst game."
WATCH_NAIVE = "See how {persona} makes the {naive} fail: its worst game."
RETRAIN_AGAINST_SEVERAL = "Retrain one ego against several personas: add this to the campaign, and run it again."
MINIMISE = "Find the mildest start at which this game still fails, and keep it as a test."
SET_BOUNDS = "State what this ego must achieve: add bounds to the campaign, and the command passes or fails."
TIGHTEN = "Every bound is kept. Add a persona or a scene that this ego has not met."
MOST_STEPS = 4


@dataclass(frozen=True, kw_only=True)
class NextStep:
    """One thing to do, and what to type; `command` may be a line of a campaign's file."""

    sentence: str
    command: str = ""
    game: str = ""
    """The key of the game to watch (`player_data.key`); empty: the step is about no game."""


def next_steps(tables: RunTables, found: RunFindings) -> list[NextStep]:
    """The first few steps that this run suggests, the most urgent first."""
    manifest, personas, checks = tables.manifest, tables.personas, tables.acceptance
    finish = NextStep(sentence=FINISH, command=command_of(manifest))
    steps = [
        *([finish] if tables.unfinished else []),
        *_learn(manifest, personas, found),
        *_watch(personas, found),
        *_widen(personas, found, checks),
    ]
    return steps[:MOST_STEPS]


def _learn(manifest: Mapping[str, Any], personas: Sequence[str], found: RunFindings) -> Iterator[NextStep]:
    """What helps people who did not learn to reach their goal. People on foot have no rule-based driver to imitate."""
    training = manifest.get("campaign", {}).get("non_ego_training", {})
    unable = [persona for persona in personas if _did_not_learn(manifest, persona)]
    if unable and found.non_ego_drives and not training.get("imitation"):
        yield NextStep(sentence=LEARN_BY_EXAMPLE.format(persona=" and ".join(unable)), command=IMITATION)


def _did_not_learn(manifest: Mapping[str, Any], persona: str) -> bool:
    """Whether the persona did not learn to reach its goal, in any training seed."""
    return any(
        name.startswith(f"{persona}-seed") and each.get("stopped") == DID_NOT_LEARN
        for name, each in manifest.get("stages", {}).items()
    )


def _watch(personas: Sequence[str], found: RunFindings) -> Iterator[NextStep]:
    """The worst game of the persona against which the last ego fails most; else, of the naive ego's."""
    for made, sentence in ((found.change.made, WATCH_REMAINING), ("naive", WATCH_NAIVE)):
        arms = []
        for persona in personas:
            ego = NaiveEgo() if made == "naive" else found.change.ego(against=persona)
            arm = against_persona(ego, persona).name
            rows = found.of(arm)
            arms += [(sum(map(failures, rows.values())), persona, arm)] if rows else []
        if arms and max(arms)[0]:
            _, persona, arm = max(arms)
            game = most_severe(found.games[found.games["arm"] == arm])
            command = f"harness replay . {shlex.quote(arm)} {game['episode']}"
            command += f" --seed {game['seed']}" if len(found.seeds) > 1 else ""
            watched = key(arm, int(game["seed"]), int(game["episode"]))
            words = sentence.format(made=made, persona=persona, naive=found.naive)
            yield NextStep(sentence=words, command=command, game=watched)
            yield NextStep(sentence=MINIMISE, command=command.replace("harness replay", "harness minimise", 1))
            return


def _widen(personas: Sequence[str], found: RunFindings, checks: Sequence[Check] | None) -> Iterator[NextStep]:
    if checks is None:
        yield NextStep(sentence=SET_BOUNDS, command="[acceptance]\nfailure_rate = 0.1")
    elif all(check.passed for check in checks):
        yield NextStep(sentence=TIGHTEN, command="harness persona new NAME")
    if len(personas) > 1 and any(found.asked("RQ2", persona) for persona in personas) and not found.is_reconfigured:
        against = ", ".join(f'"{persona}"' for persona in personas)
        yield NextStep(sentence=RETRAIN_AGAINST_SEVERAL, command=f"[retraining]\nagainst = [{against}]")


WHY = "Why does it fail?"
PREVENTABLE = "Could it have been prevented?"
NOW = "What now?"
NO_FAILURE = "Against {persona} no ego fails."
FAILS = "Against {persona} the {ego} fails in {failures} of {games} games."
FAILS_NO_MORE = "The {ego} does not fail."
MOSTLY = "{share} failures: {cause}."
ALL, SOME, NONE = "Yes.", "Partly.", "No."
PREVENTED = (
    "Against {persona} a reference driver (a model of a careful human driver) in the seat of the {naive} avoids "
    "{avoided} of its {failures} failures."
)
ALSO = "Against {persona}: {avoided} of {failures}."
NOT_JUDGED = "Not known: reference drivers have judged no failure of this run."
NOTHING_TO_PREVENT = "There is nothing to prevent: the {naive} does not fail."


@dataclass(frozen=True, kw_only=True)
class FirstAnswer:
    """One question of the first screen and its answer, a sentence each line."""

    question: str
    lines: Sequence[str]
    command: str = ""
    """What to type, if the answer is something to do."""
    game: str = ""
    """The key of the game that it is about, empty for none."""


def first_answers(personas: Sequence[str], found: RunFindings, steps: Sequence[NextStep]) -> list[FirstAnswer]:
    """The questions after "did it pass?", in order; empty before a game against a persona was played."""
    lines = [line for persona in personas for line in _why(persona, found)]
    if not lines:
        return []
    answers = [
        FirstAnswer(question=WHY, lines=lines),
        FirstAnswer(question=PREVENTABLE, lines=_prevented(personas, found)),
    ]
    answers += [
        FirstAnswer(question=NOW, lines=[step.sentence], command=step.command, game=step.game) for step in steps[:1]
    ]
    return answers


def _egos(persona: str, found: RunFindings) -> Iterator[tuple[str, str, EgoStrategy]]:
    """The egos that a persona's card shows: the question about each, its word, and the strategy."""
    yield "RQ1", found.naive, NaiveEgo()
    if found.asked("RQ2", persona):
        yield "RQ2", f"{found.change.made} ego", found.change.ego(against=persona)


def _why(persona: str, found: RunFindings) -> Iterator[str]:
    """One line for each ego that fails against a persona: how often, and its most frequent cause."""
    failing, egos = 0, 0
    for question, word, ego in _egos(persona, found):
        games = found.games[found.games["arm"] == against_persona(ego, persona).name]
        if games.empty:
            continue
        failures, egos = int(games["ego_failed"].sum()), egos + 1
        if failures:
            failing += 1
            cause = next(iter(found.causes(question, persona)), "")
            share, _, words = cause.partition(": ")
            mostly = f" {MOSTLY.format(share=share, cause=words)}" if words else ""
            yield FAILS.format(persona=persona, ego=word, failures=failures, games=len(games)) + mostly
        elif failing:
            yield FAILS_NO_MORE.format(ego=word)
    if egos and not failing:
        yield NO_FAILURE.format(persona=persona)


def _prevented(personas: Sequence[str], found: RunFindings) -> list[str]:
    lines: list[str] = []
    all_avoided, all_failures = 0, 0
    for persona in personas:
        judged = found.preventability.get(against_persona(NaiveEgo(), persona).name, ())
        avoided = sum(each.from_start.by_any for each in judged)
        failures = sum(each.from_start.judged for each in judged)
        if failures:
            sentence = ALSO if lines else PREVENTED
            lines.append(sentence.format(persona=persona, naive=found.naive, avoided=avoided, failures=failures))
        all_avoided, all_failures = all_avoided + avoided, all_failures + failures
    if not lines:
        arms = [against_persona(NaiveEgo(), persona).name for persona in personas]
        failed = found.games[found.games["arm"].isin(arms)]["ego_failed"].sum()
        return [NOT_JUDGED if failed else NOTHING_TO_PREVENT.format(naive=found.naive)]
    label = ALL if all_avoided == all_failures else SOME if all_avoided else NONE
    return [f"{label} {lines[0]}", *lines[1:]]
