"""What to do after a run, with the commands to type in the run folder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from harness.config.training import Training
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import stage_id, strategy_name
from harness.evaluation.worst_first import worst_first
from harness.reports.embedding import key
from harness.reports.focus import Focus, focus_of
from harness.reports.game_links import replay_command
from harness.reports.provenance import command_of
from harness.reports.run_tables import RunTables

MOST_STEPS = 4
_BREAKING = {"near_miss_rate": "near_miss", "harm_to_others_rate": "harm_to_others"}
"""The column of episodes.csv that marks the games which a bound on something else than failures is about."""


@dataclass(frozen=True, kw_only=True)
class NextStep:
    """One thing to do, and what to type; `command` may be a line of a campaign's file."""

    sentence: str
    command: str = ""
    game: str = ""
    """The key of the game to watch (`embedding.key`); empty: the step is about no game."""


def next_steps(tables: RunTables) -> list[NextStep]:
    """The first few steps that this run suggests, the most urgent first."""
    watch, learn = list(_watch(tables)), list(to_learn(tables))
    urgent = [*watch, *learn] if _has_learned(focus_of(tables), tables) else [*learn, *watch]
    return [*_finish(tables), *urgent, *_widen(tables)][:MOST_STEPS]


def _has_learned(focus: Focus | None, tables: RunTables) -> bool:
    """Whether the players of the arm that matters most learned to drive the scene; False without such an arm."""
    if focus is None or focus.arm not in tables.arms:
        return False
    arm = tables.arms[focus.arm]
    players = [strategy_name(each) for each in (arm.ego, arm.non_ego) if each is not None]
    entries = [tables.stages.get(stage_id(player, seed), {}) for player in players for seed in tables.seeds]
    return all(each.get("stopped") != DID_NOT_LEARN for each in entries)


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
    """The worst game of the arm that matters most; without games, how to have them."""
    focus = focus_of(tables)
    if focus is None:
        return
    if tables.is_from_tables:
        sentence = f"See how {focus.happens}: play the games, which are not published, once more."
        yield NextStep(sentence=sentence, command=command_of(tables.manifest))
        return
    games = tables.games_of(focus.arm)
    if focus.check is not None and (breaking := _BREAKING.get(focus.check.bound)):
        marked = games[games[breaking].fillna(0) == 1]
        games = marked if len(marked) else games
    game = worst_first(games).iloc[0].to_dict()
    command = replay_command(game, tables.several_seeds)
    watched = key(focus.arm, game["seed"], game["episode"])
    yield NextStep(sentence=f"See how {focus.happens}: the worst game.", command=command, game=watched)
    if game["ego_failed"] == 1:
        yield NextStep(
            sentence="Find the mildest start at which this game still fails, and keep it as a test.",
            command=command.replace("harness replay", "harness minimise", 1),
        )


def _widen(tables: RunTables) -> Iterator[NextStep]:
    trained = [
        name for name, entry in tables.stages.items() if entry["kind"] == "training" and entry["status"] == "done"
    ]
    if trained and not tables.personas:
        yield NextStep(
            sentence="Play this ego against all people in all scenes.",
            command=f"harness league --ego policies/{trained[-1]}",
        )
    elif tables.acceptance is None:
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
