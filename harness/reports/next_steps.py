"""The first screen of the page: why the ego fails, whether that could have been prevented, and what to do now, with the
commands to type in the run folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from harness.config.training import Training
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.worst_first import worst_first
from harness.reports.embedding import key
from harness.reports.game_links import replay_command
from harness.reports.key_figures import egos_of
from harness.reports.provenance import command_of
from harness.reports.run_tables import RunTables, failures

MOST_STEPS = 4


@dataclass(frozen=True, kw_only=True)
class NextStep:
    """One thing to do, and what to type; `command` may be a line of a campaign's file."""

    sentence: str
    command: str = ""
    game: str = ""
    """The key of the game to watch (`embedding.key`); empty: the step is about no game."""


def next_steps(tables: RunTables) -> list[NextStep]:
    """The first few steps that this run suggests, the most urgent first."""
    steps = [*_finish(tables), *to_learn(tables), *_watch(tables), *_widen(tables)]
    return steps[:MOST_STEPS]


def _finish(tables: RunTables) -> Iterator[NextStep]:
    if tables.unfinished:
        sentence = "Some stages are not done. The same command continues; finished stages are skipped."
        yield NextStep(sentence=sentence, command=command_of(tables.manifest))


def to_learn(tables: RunTables) -> Iterator[NextStep]:
    """What helps players that did not learn to drive the scene, so that the questions are answered."""
    if all(each.get("stopped") != DID_NOT_LEARN for each in tables.stages.values()):
        return
    if tables.manifest.get("quick"):
        sentence = "With --quick, players train for a small part of the budget. Train them for all of it."
        yield NextStep(sentence=sentence, command=command_of({**tables.manifest, "quick": False}))
    else:
        steps = 2 * int(tables.campaign.get("training", {}).get("steps", Training().steps))
        sentence = "Double the budget of the trainings: change this in the campaign, and run it again."
        yield NextStep(sentence=sentence, command=f"[training]\nsteps = {steps}")
    yield NextStep(
        sentence="Try another conflict of the map: list those that there are.",
        command="harness scene new NAME --from MAP --list",
    )


def _watch(tables: RunTables) -> Iterator[NextStep]:
    """The worst game of the persona against which the last ego fails most; else, of the naive ego's."""
    for place, sentence in (
        (1, f"See how the {tables.change.made} ego still fails against {{}}: its worst game."),
        (0, f"See how {{}} makes the {tables.naive} fail: its worst game."),
    ):
        arms = [(tables.arms_of("RQ2", persona)[place], persona) for persona in tables.personas]
        counts = [(sum(map(failures, tables.rates_of(arm).values())), persona, arm) for arm, persona in arms]
        if counts and max(counts)[0]:
            _, persona, arm = max(counts)
            game = worst_first(tables.games_of(arm)).iloc[0].to_dict()
            command, watched = replay_command(game, tables.several_seeds), key(arm, game["seed"], game["episode"])
            yield NextStep(sentence=sentence.format(persona), command=command, game=watched)
            yield NextStep(
                sentence="Find the mildest start at which this game still fails, and keep it as a test.",
                command=command.replace("harness replay", "harness minimise", 1),
            )
            return


def _widen(tables: RunTables) -> Iterator[NextStep]:
    if tables.acceptance is None:
        yield NextStep(
            sentence="State what this ego must achieve: add bounds to the campaign, and the command passes or fails.",
            command="[acceptance]\nfailure_rate = 0.1",
        )
    elif all(check.passed for check in tables.acceptance):
        yield NextStep(
            sentence="Every bound is kept. Add a persona or a scene that this ego has not met.",
            command="harness persona new NAME",
        )
    personas = tables.personas
    is_retrained = tables.change.made == "retrained" and any(tables.asked("RQ2", persona) for persona in personas)
    if len(personas) > 1 and is_retrained:
        against = ", ".join(f'"{persona}"' for persona in personas)
        yield NextStep(
            sentence="Retrain one ego against several personas: add this to the campaign, and run it again.",
            command=f"[retraining]\nagainst = [{against}]",
        )


def first_answers(tables: RunTables, steps: Sequence[NextStep]) -> list[dict[str, Any]]:
    """The questions after "did it pass?", in order, each with `lines` of an answer, a `command` to type and the key of
    a `game` to watch; empty before a game against a persona was played."""
    lines = [line for persona in tables.personas for line in _why(persona, tables)]
    if not lines:
        return []
    answers: list[dict[str, Any]] = [
        {"question": "Why does it fail?", "lines": lines},
        {"question": "Could it have been prevented?", "lines": _prevented(tables)},
    ]
    for step in steps[:1]:
        what = {"lines": [step.sentence], "command": step.command, "game": step.game}
        answers.append({"question": "What now?", **what})
    return [{"command": "", "game": "", **each} for each in answers]


def _why(persona: str, tables: RunTables) -> Iterator[str]:
    """One line for each ego that fails against a persona: how often, and its most frequent cause."""
    is_played, is_failing = False, False
    for question, ego, arm in egos_of(persona, tables):
        games = tables.games_of(arm)
        if games.empty:
            continue
        failed, is_played = int(games["ego_failed"].sum()), True
        if failed:
            is_failing = True
            cause = next(iter(tables.causes_of(question, persona)), "")
            share, _, words = cause.partition(": ")
            mostly = f" {share} failures: {words}." if words else ""
            yield f"Against {persona} the {ego} fails in {failed} of {len(games)} games.{mostly}"
        elif is_failing:
            yield f"The {ego} does not fail."
    if is_played and not is_failing:
        yield f"Against {persona} no ego fails."


def _prevented(tables: RunTables) -> list[str]:
    arms = {persona: tables.arms_of("RQ1", persona)[1] for persona in tables.personas}
    lines: list[str] = []
    all_avoided, all_failures = 0, 0
    for persona, arm in arms.items():
        judged = tables.prevented_in(arm)
        avoided = sum(row["from_start_prevented"] for row in judged)
        failed = sum(row["from_start_judged"] for row in judged)
        if failed and lines:
            lines.append(f"Against {persona}: {avoided} of {failed}.")
        elif failed:
            lines.append(
                f"Against {persona} the careful and competent driver of UN R157 in the seat of the "
                f"{tables.naive} avoids {avoided} of its {failed} failures."
            )
        all_avoided, all_failures = all_avoided + avoided, all_failures + failed
    if lines:
        label = "Yes." if all_avoided == all_failures else "Partly." if all_avoided else "No."
        return [f"{label} {lines[0]}", *lines[1:]]
    if tables.played.loc[tables.played["arm"].isin(list(arms.values())), "ego_failed"].sum():
        return ["Not known: reference drivers have judged no failure of this run."]
    return [f"There is nothing to prevent: the {tables.naive} does not fail."]
