"""Judging an arm's failures: which of them the reference drivers prevent.

<work>/segments/<episode>.json     games from this one on, as all reference drivers have played them, with the versions
<work>/reference_drivers.csv       a row for each failure and reference driver
<work>/takeovers.csv               the courses in collisions that a driver prevents from the conflict on

So the judgement continues with the next games after an interruption. What a driver does in a game depends on nothing
but itself: the table is the same bytes with and without interruptions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.assessment.conflict_replay import Collision, ConflictReplay, Takeover, collision_of
from harness.assessment.continuation import Continuation
from harness.assessment.rollout import assess_arms
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.planned_drivers import SumoDriven
from harness.campaign.plan.stages import PreventabilityStage
from harness.campaign.storage.arm_tables import arm_tables
from harness.campaign.storage.checksums import intact_record, write_checksums
from harness.campaign.storage.run_folder import JUDGED, TAKEN_OVER
from harness.campaign.storage.versions import versions_of_numbers
from harness.drivers.mixture import mixture_of
from harness.drivers.reference_drivers import REFERENCES, reference_driver
from harness.evaluation.competence import broken_by
from harness.evaluation.tables import table_of, write_csv
from harness.evaluation.trace_file import TraceReader
from harness.files import make_folder
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene

_COLLISIONS_AT_ONCE = 50  # what the ego sees in each of their steps is kept in memory
_GAMES_AT_ONCE = 50  # they are stored together


def carry_out_preventability(
    stage: PreventabilityStage, run: StageRun, scene: OpenScene
) -> tuple[dict[str, Any], list[Path]]:
    """Judge every failure of an arm; the facts, and the files of the tables.

    The run is told of each episode before it is played, and of the games played and their number. Raises UsageError for
    damaged files of the arm, SimulationError if SUMO can't load the scene.
    """
    folder, of = run.context.folder, stage.of
    episodes = arm_tables(folder, of.id).episodes
    failures = episodes[(episodes["error"] == "") & (episodes["ego_failed"] == 1)]
    numbers = [int(episode) for episode in failures["episode"]]
    conflicts, courses, failed_s = _from_conflict(scene, folder.traces(of.id), numbers, run.context.document.start_seed)
    starts = _from_start(stage, run, scene, numbers)
    rows = []
    for failure in failures.itertuples():
        episode = int(failure.episode)
        for name in REFERENCES:
            outcome, error = starts[episode][name]["outcome"], starts[episode][name]["error"]
            row = {
                "arm": failure.arm,
                "persona": failure.persona,
                "seed": of.seed,
                "episode": episode,
                "driver": name,
                "ego_outcome": failure.ego_outcome,
                "outcome_from_start": "" if error else outcome,
                "prevented_from_start": None if error else int(outcome == "goal"),
                "error": error,
                "failed_s": failed_s[episode],
            }
            rows.append(row | conflicts.get((episode, name), {}))
    driven = [{"arm": of.name, "seed": of.seed, **row} for _, each in sorted(courses.items()) for row in each]
    tables = {JUDGED: table_of("reference_drivers", rows), TAKEN_OVER: table_of("takeovers", driven)}
    for file, table in tables.items():
        write_csv(table, folder.work(stage.id) / file)
    errors = int((episodes["error"] != "").sum()) + sum(row["error"] != "" for row in rows)
    return {"episodes": len(numbers), "errors": errors, "versions": [versions_of_numbers()]}, [
        folder.work(stage.id) / file for file in tables
    ]


def _from_conflict(
    scene: OpenScene, traces: Path, episodes: Sequence[int], start_seed: int
) -> tuple[dict[tuple[int, str], dict[str, Any]], dict[int, list[dict[str, Any]]], dict[int, float]]:
    """The cells of the verdict from the conflict on, by episode and driver; by episode, the rows of courses with the
    first of `REFERENCES` that prevents the collision; and when each game failed."""
    reader, step_s, ego = TraceReader(), scene.world.step_s, scene.world.roles[EGO]
    collisions: dict[Continuation, list[Collision]] = {each: [] for each in Continuation}
    failed_s = {}
    for episode in episodes:
        trace = reader.read(traces, episode)
        ended = trace.loc[(trace["player"] == ego) & (trace["outcome"] != ""), "step"]
        failed_s[episode] = float(ended.min()) * step_s
        for continuation, found in collisions.items():
            if (collision := collision_of(trace, scene, episode, continuation)) is not None:
                found.append(collision)
    cells: dict[tuple[int, str], dict[str, Any]] = {}
    courses: dict[int, list[dict[str, Any]]] = {}
    for first in range(0, len(collisions[Continuation.IN_ITS_PLACE]), _COLLISIONS_AT_ONCE):
        in_place, moving = (found[first : first + _COLLISIONS_AT_ONCE] for found in collisions.values())
        chances = ConflictReplay(scene, moving, start_seed).chances()
        for name, takeovers in ConflictReplay(scene, [*in_place, *moving], start_seed).takeovers().items():
            staying, over = takeovers[: len(in_place)], takeovers[len(in_place) :]
            for collision, takeover, worse, chance in zip(in_place, staying, over, chances, strict=True):
                steps = {
                    "conflict_s": takeover.danger_step,
                    "preventable_from_s": chance.first_step,
                    "preventable_until_s": chance.last_step,
                }
                if takeover.prevented and collision.episode not in courses:
                    courses[collision.episode] = list(_takeover_rows(name, takeover, collision, scene.world.roles))
                times = {column: None if step is None else step * step_s for column, step in steps.items()}
                cells[collision.episode, name] = {
                    **times,
                    "prevented_from_conflict": int(takeover.prevented),
                    "prevented_moving_over": int(worse.prevented),
                }
    return cells, courses, failed_s


def _takeover_rows(
    driver: str, takeover: Takeover, collision: Collision, roles: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """The rows of the table of courses on a collision that a driver prevents."""
    assert takeover.course is not None
    assert takeover.danger_step is not None
    course, after = collision.course, collision.course.failed_step
    courses = [(roles[EGO], takeover.danger_step, takeover.course)]
    for player in range(NON_EGO, len(roles)):
        if course.players_present[after, player]:
            courses.append((roles[player], after, course.players[after:, player, :3]))
    for player_name, first_step, poses in courses:
        for step, pose in enumerate(np.round(poses, 4).tolist(), first_step):
            cells = dict(zip(("x_m", "y_m", "heading_rad"), pose, strict=True))
            yield {"episode": collision.episode, "driver": driver, "player": player_name, "step": step, **cells}


def _from_start(
    stage: PreventabilityStage, run: StageRun, scene: OpenScene, episodes: Sequence[int]
) -> dict[int, dict[str, dict[str, str]]]:
    """How each episode ends with each reference driver in the ego's seat: its outcome and its error."""
    folder = run.context.folder.segments(stage.id)
    make_folder(folder)
    seatless = PlayerFactory(context=run.context, scene=scene).arm(replace(stage.of, ego=(SumoDriven(),)))
    egos = [mixture_of(reference_driver(name, scene.world), run.context.ego_persona) for name in REFERENCES]
    arms = [replace(seatless, drivers=(ego, *seatless.drivers[1:])) for ego in egos]
    found: dict[int, dict[str, dict[str, str]]] = {}
    for first in range(0, len(episodes), _GAMES_AT_ONCE):
        part = episodes[first : first + _GAMES_AT_ONCE]
        file = folder / f"{part[0]:06d}.json"
        outcomes = _stored(file, run.attempt.first)
        if outcomes is None:
            outcomes = {}
            for games in assess_arms(arms, run.attempt.batches(part), run.on_start, run.attempt.abandoned):
                records = {name: game.record for name, game in zip(REFERENCES, games, strict=True)}
                outcomes[games[0].played["episode"]] = {
                    name: {"outcome": outcome_of(record), "error": str(record["error"])}
                    for name, record in records.items()
                }
                run.on_progress(len(found) + len(outcomes), len(episodes))
            write_checksums(file, folder, [], {"versions": versions_of_numbers(), "outcomes": outcomes})
        found |= outcomes
    return found


def outcome_of(record: Mapping[str, Any]) -> str:
    """How a game ends for a reference driver: a goal that it reaches by breaking a rule of the road prevents nothing,
    and has the key of the rule (`harness.evaluation.competence.RULES`) for its outcome."""
    outcome = str(record["ego_outcome"])
    return broken_by(record) or outcome if outcome == "goal" else outcome


def _stored(file: Path, first: bool) -> dict[int, dict[str, dict[str, str]]] | None:
    """Games that the drivers have played; None if there are none of this version, or if some could not be played and
    this is the command's first attempt, which plays them again."""
    record = intact_record(file, file.parent, versions=versions_of_numbers()) or {}
    try:
        outcomes = {int(episode): {**of_drivers} for episode, of_drivers in record["outcomes"].items()}
        failed = any(each["error"] for of_drivers in outcomes.values() for each in of_drivers.values())
    except (LookupError, AttributeError, TypeError, ValueError):
        return None
    return None if first and failed else outcomes
