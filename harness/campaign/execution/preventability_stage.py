"""Judging an arm's failures: which of them the reference drivers prevent.

<work>/segments/<driver>.json      the games that one reference driver has played, with the versions that played them
<work>/reference_drivers.csv       a row for each failure and reference driver

So the judgement continues with the next reference driver after an interruption. What a driver does in a game depends on
nothing but itself: the table is the same bytes with and without interruptions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from harness.assessment.conflict_replay import Chance, ConflictReplay, Takeover, collision_of
from harness.assessment.rollout import SeatedArm, assess
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import Made, StageInputs, StageRun
from harness.campaign.plan.planned_drivers import SumoDriven
from harness.campaign.plan.stages import PreventabilityStage
from harness.campaign.storage.arm_tables import arm_tables
from harness.campaign.storage.checksums import read_checksums, write_checksums
from harness.campaign.storage.run_folder import JUDGED
from harness.campaign.storage.versions import versions_of_numbers
from harness.drivers.car import car_of
from harness.drivers.mixture import mixture_of
from harness.drivers.reference_drivers import REFERENCES, lane_width_of, reference_driver
from harness.evaluation.competence import broken_by
from harness.evaluation.tables import table_of, write_csv
from harness.evaluation.trace_file import TraceReader
from harness.files import make_folder
from harness.game.roles import EGO

_COLLISIONS_AT_ONCE = 100  # what the ego sees in each of their steps is kept in memory


@dataclass(frozen=True, kw_only=True)
class _JudgedArm:
    """An arm whose failures are judged."""

    stage: PreventabilityStage
    run: StageRun
    arm: SeatedArm
    """The arm with SUMO's driver in the ego's seat, which the reference drivers take."""


def carry_out_preventability(stage: PreventabilityStage, inputs: StageInputs) -> Made:
    """Judge every failure of an arm.

    The run is told of each episode before it is played, and of the games played and their number. Raises UsageError for
    damaged files of the arm, SimulationError if SUMO can't load the scene.
    """
    run, of = inputs.run, stage.of
    seatless = replace(of, ego=(SumoDriven(),))
    work = _JudgedArm(stage=stage, run=run, arm=PlayerFactory.of(inputs).arm(seatless))
    episodes = arm_tables(run.folder, of.id).episodes
    failures = episodes[(episodes["error"] == "") & (episodes["ego_failed"] == 1)]
    numbers = [int(episode) for episode in failures["episode"]]
    conflicts, failed_s = _from_conflict(work, numbers)
    starts = _from_start(work, numbers)
    rows = [
        _row(work, failure, name, starts[name][int(failure.episode)])
        | {"failed_s": failed_s[int(failure.episode)]}
        | conflicts.get((int(failure.episode), name), {})
        for failure in failures.itertuples()
        for name in REFERENCES
    ]
    table = run.folder.work(stage.id) / JUDGED
    write_csv(table_of("reference_drivers", rows), table)
    errors = int((episodes["error"] != "").sum()) + sum(row["error"] != "" for row in rows)
    facts = {"episodes": len(numbers), "errors": errors, "versions": [versions_of_numbers()]}
    return Made(facts=facts, files=[table])


def _row(work: _JudgedArm, failure: Any, name: str, outcome: Mapping[str, str]) -> dict[str, Any]:
    played = not outcome["error"]
    return {
        "arm": failure.arm,
        "persona": failure.persona,
        "seed": work.stage.seed,
        "episode": failure.episode,
        "driver": name,
        "ego_outcome": failure.ego_outcome,
        "outcome_from_start": outcome["outcome"] if played else "",
        "prevented_from_start": int(outcome["outcome"] == "goal") if played else None,
        "error": outcome["error"],
    }


def _from_conflict(
    work: _JudgedArm, episodes: Sequence[int]
) -> tuple[dict[tuple[int, str], dict[str, Any]], dict[int, float]]:
    """The cells of the verdict from the conflict on, by episode and driver; and when each game failed."""
    scene, reader = work.arm.scene, TraceReader()
    step_s, ego = scene.world.step_s, scene.world.roles[EGO]
    collisions, failed_s = [], {}
    for episode in episodes:
        trace = reader.read(work.run.folder.traces(work.stage.of.id), episode)
        ended = trace.loc[(trace["player"] == ego) & (trace["outcome"] != ""), "step"]
        failed_s[episode] = float(ended.min()) * step_s
        if (collision := collision_of(trace, scene, episode)) is not None:
            collisions.append(collision)
    cells: dict[tuple[int, str], dict[str, Any]] = {}
    for first in range(0, len(collisions), _COLLISIONS_AT_ONCE):
        some = collisions[first : first + _COLLISIONS_AT_ONCE]
        replay = ConflictReplay(scene, some, work.stage.seed)
        chances = replay.chances()
        for name, takeovers in replay.takeovers().items():
            for collision, takeover, chance in zip(some, takeovers, chances, strict=True):
                cells[collision.episode, name] = _conflict_cells(takeover, chance, step_s)
    return cells, failed_s


def _conflict_cells(takeover: Takeover, chance: Chance, step_s: float) -> dict[str, Any]:
    steps = {
        "conflict_s": takeover.danger_step,
        "preventable_from_s": chance.first_step,
        "preventable_until_s": chance.last_step,
    }
    times = {name: None if step is None else step * step_s for name, step in steps.items()}
    return {**times, "prevented_from_conflict": int(takeover.prevented)}


def _from_start(work: _JudgedArm, episodes: Sequence[int]) -> dict[str, dict[int, dict[str, str]]]:
    """How each episode ends with each reference driver in the ego's seat: its outcome and its error."""
    total, done = len(episodes) * len(REFERENCES), 0
    found: dict[str, dict[int, dict[str, str]]] = {}

    def on_game() -> None:
        nonlocal done
        done += 1
        work.run.on_progress(done, total)

    for name in REFERENCES:
        file = work.run.folder.segments(work.stage.id) / f"{name}.json"
        found[name] = _stored(file, work.run.attempt.first) or _play(work, name, episodes, on_game)
        done = len(found) * len(episodes)
        make_folder(file.parent)
        outcomes = {str(episode): outcome for episode, outcome in found[name].items()}
        write_checksums(file, file.parent, [], {"versions": versions_of_numbers(), "outcomes": outcomes})
    return found


def _play(
    work: _JudgedArm, name: str, episodes: Sequence[int], on_game: Callable[[], None]
) -> dict[int, dict[str, str]]:
    scene = work.arm.scene
    driver = reference_driver(name, car_of(scene.world, EGO), lane_width_of(scene.world))
    persona = work.run.context.ego_persona
    arm = replace(work.arm, drivers=(mixture_of(driver, persona), *work.arm.drivers[1:]))
    outcomes = {}
    for game in assess(arm, episodes, work.run.on_start, work.run.attempt.abandoned):
        record = game.record
        outcomes[int(record["episode"])] = {"outcome": outcome_of(record), "error": str(record["error"])}
        on_game()
    return outcomes


def outcome_of(record: Mapping[str, Any]) -> str:
    """How a game ends for a reference driver: a goal that it reaches by breaking a rule of the road prevents nothing,
    and has the key of the rule (`harness.evaluation.competence.RULES`) for its outcome."""
    outcome = str(record["ego_outcome"])
    return broken_by(record) or outcome if outcome == "goal" else outcome


def _stored(file: Path, first: bool) -> dict[int, dict[str, str]] | None:
    """The games that a driver has played; None if there are none of this version, or if some could not be played and
    this is the command's first attempt, which plays them again."""
    record = read_checksums(file)
    if record is None or record.get("versions") != versions_of_numbers():
        return None
    try:
        outcomes = {int(episode): {**outcome} for episode, outcome in record["outcomes"].items()}
        failed = any(each["error"] for each in outcomes.values())
    except (LookupError, AttributeError, TypeError, ValueError):
        return None
    return None if first and failed else outcomes
