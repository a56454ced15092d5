"""Carrying out an arm in segments of games: each is stored when it is played, and all are joined at the end.

<work>/segments/<first>-<last>.json            checksums: the segment is complete; and the versions that played it
<work>/segments/<first>-<last>.<table>         its log: outcomes and errors, and traces

So an arm continues where it stopped, needs the memory of a few segments, however many games it has, and workers that
have nothing else to do help its own: who plays a segment has its lock. A game depends on nothing but itself: the files
of an arm are the same bytes with and without interruptions, and do not depend on the workers that play it.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

from harness.assessment.rollout import Game, assess_batches, plays_side_by_side
from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import SEGMENT_EPISODES, StageRun
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.arm_tables import PLAYED, arm_tables
from harness.campaign.storage.checksums import intact_record, write_checksums
from harness.campaign.storage.locks import InUse, held_by_worker
from harness.campaign.storage.versions import versions_of_numbers
from harness.errors import StageFailed
from harness.evaluation.competence import goals_alone
from harness.evaluation.strategies import stage_id
from harness.evaluation.tables import joined, read_csv, table_of, write_csv
from harness.evaluation.trace_file import join_traces, trace_writer
from harness.evaluation.unplayed_games import reason_of
from harness.files import make_folder
from harness.road.scene.open_scene import OpenScene

HOPELESS_GAMES = 10
"""An arm ends if this many games, its first, can't be played for one reason: the others would not be played either.
Games side by side are all tried first."""
AT_ONCE = 20
"""Segments that a worker takes at a time, if their games can be played side by side: the games of most arms."""
_TRACES = "traces.parquet"
_HELP_S = 10.0  # the time after which a helper starts no further segment: a stage may wait for it
_POLL_S = 0.25


@dataclass(frozen=True)
class Segment:
    """Consecutive games of an arm, and the folder that stores them."""

    folder: Path
    episodes: range

    def file(self, name: str) -> Path:
        return self.folder / f"{self.episodes[0]:06d}-{self.episodes[-1]:06d}.{name}"

    @property
    def is_played(self) -> bool:
        """Whether it is complete, by this run of the command: what is not intact was removed when its arm began."""
        return self.file("json").is_file()

    def errors(self) -> int | None:
        """How many of its games could not be played; None if it is not complete, or was played by other versions."""
        record = intact_record(self.file("json"), self.folder, versions=versions_of_numbers()) or {}
        errors = record.get("errors")
        return errors if isinstance(errors, int) else None

    def play(
        self, games: Iterator[Game], labels: Mapping[str, Any], arm: SeatedArm, on_game: Callable[[int], None]
    ) -> None:
        """Play it; `games` yields its games next. `on_game` gets the number of those that are played."""
        records = []
        with trace_writer(self.file(_TRACES), arm.trace_schema) as add_trace:
            for _ in self.episodes:
                game = next(games)
                records.append({**game.played, **labels})
                if game.trace is not None:
                    add_trace(game.trace)
                on_game(len(records))
        table = table_of("played", records, len(arm.drivers) - 1)
        write_csv(table, self.file(PLAYED))
        files = [self.file(name) for name in (PLAYED, _TRACES)]
        errors = int((table["error"] != "").sum())
        write_checksums(self.file("json"), self.folder, files, {"errors": errors, "versions": versions_of_numbers()})


def carry_out_assessment(stage: AssessmentStage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Play an arm; the facts, and the files of its log. Raises as `PlayerFactory.arm` and `play_segments` do."""
    folder, labels, choice = run.context.folder, _labels(stage), dict[str, Any]()
    played, traces = folder.work(stage.id) / PLAYED, folder.traces(stage.id)
    if stage.games_of:
        write_csv(read_csv(folder.work(stage.games_of) / PLAYED).assign(**labels), played)
        join_traces([folder.traces(stage.games_of)], traces, labels)
    else:
        players = PlayerFactory(context=run.context, scene=scene)
        stage, choice = players.chosen(stage)
        segments = segments_of(folder.segments(stage.id), run.context.document.assessment.episodes)
        play_segments(players.arm(stage), segments, labels, run)
        join_segments(segments, played, traces, labels)
    games = arm_tables(folder, stage.id, scene).episodes
    facts: dict[str, Any] = {"episodes": len(games), "errors": int((games["error"] != "").sum())}
    facts |= {"versions": [versions_of_numbers()], **choice}
    if stage.is_without_people:  # whether the training of the player succeeded
        facts |= goals_alone(games, "ego" if stage.ego else "non_ego").record()
    return facts, [played, traces]


def help_with_arm(stage: AssessmentStage, run: StageRun, scene: OpenScene) -> dict[str, int]:
    """Play segments of an arm that its own worker has begun, the last ones first. Returns how many were played.

    Raises as `carry_out_assessment` does.
    """
    folder = run.context.folder
    segments = segments_of(folder.segments(stage.id), run.context.document.assessment.episodes)
    left = [each for each in reversed(segments) if not each.is_played]
    if not left or folder.done(stage.id):
        return {"segments": 0}
    arm, until_s = PlayerFactory(context=run.context, scene=scene).arm(stage), time.monotonic() + _HELP_S
    in_time = takewhile(lambda _: time.monotonic() < until_s, _in_groups(left, _at_once(arm)))
    return {"segments": _play_free(arm, in_time, _labels(stage), run)}


def _labels(stage: AssessmentStage) -> dict[str, str | int]:
    return {"arm": stage.name, "persona": stage.persona, "seed": stage.seed}


def segments_of(folder: Path, episodes: int) -> list[Segment]:
    firsts = range(0, episodes, SEGMENT_EPISODES)
    return [Segment(folder, range(first, min(first + SEGMENT_EPISODES, episodes))) for first in firsts]


def _at_once(arm: SeatedArm) -> int:
    return AT_ONCE if plays_side_by_side(arm) else 1


def _in_groups(segments: Sequence[Segment], size: int) -> Iterator[Sequence[Segment]]:
    return (segments[first : first + size] for first in range(0, len(segments), size))


def play_segments(arm: SeatedArm, segments: Sequence[Segment], labels: Mapping[str, Any], run: StageRun) -> None:
    """Play the games of an arm that are missing, and wait for those that helpers play.

    `labels` are the cells that all records share. The run is told of each episode before that game is played here, and
    of the games played, by any worker, and their total. After a crash each game is played alone, so that its place is
    known. Raises as `assess_batches` does, and StageFailed if the first ten games can't be played for one reason,
    unless the run keeps going.
    """
    make_folder(segments[0].folder)
    for segment in segments:
        errors = segment.errors()
        if errors is None or (errors and run.attempt.first):
            segment.file("json").unlink(missing_ok=True)
    left, total = list(segments), segments[-1].episodes.stop
    at_once = _at_once(arm) if run.attempt.first else 1

    def report(playing: int = 0) -> None:
        left[:] = [each for each in left if not each.is_played]
        run.on_progress(total - sum(len(each.episodes) for each in left) + playing, total)

    def until_played() -> Iterator[Sequence[Segment]]:
        first = [each for each in segments if each.episodes[0] < HOPELESS_GAMES]
        report()
        while missing := [each for each in segments if not each.is_played]:
            for group in _in_groups(missing, at_once):
                yield group
                if first and not run.context.keep_going and all(each.is_played for each in first):
                    _check_hope(arm, first)
                    first = []
            report()
            if not all(each.is_played for each in segments):  # a helper plays them
                time.sleep(_POLL_S)

    _play_free(arm, until_played(), labels, run, on_game=report)


def _check_hope(arm: SeatedArm, first: Sequence[Segment]) -> None:
    """Raises StageFailed if the first ten games of an arm could not be played, all for one reason."""
    errors = [str(error) for each in first for error in read_csv(each.file(PLAYED))["error"]][:HOPELESS_GAMES]
    if len(errors) == HOPELESS_GAMES and all(errors) and len(set(map(reason_of, errors))) == 1:
        what = f"{arm.name}: none of its first {HOPELESS_GAMES} games could be played, all for one reason"
        raise StageFailed(f"{what} (--keep-going plays the others too): {errors[0]}")


def _play_free(
    arm: SeatedArm,
    groups: Iterable[Sequence[Segment]],
    labels: Mapping[str, Any],
    run: StageRun,
    *,
    on_game: Callable[[int], None] = lambda playing: None,
) -> int:
    """Play the segments that no other worker plays or has played, those of a group as one batch. Returns their number.

    `on_game` gets the number of games played in the current segment.
    """
    stage, played, batches = stage_id(labels["arm"], labels["seed"]), 0, deque[list[int]]()
    folder, upcoming = run.context.folder, iter(batches.popleft, None)
    with closing(assess_batches(arm, upcoming, run.on_start, run.attempt.abandoned)) as games:
        for group in groups:
            with ExitStack() as locks:
                own = list[Segment]()
                for segment in group:
                    with suppress(InUse):
                        place = f"{stage}.{segment.episodes[0]:06d}"
                        locks.enter_context(held_by_worker(folder.workers, place, 0.0))
                        if not segment.is_played and folder.done(stage) is None:
                            own.append(segment)
                if own:
                    batches.append([episode for segment in own for episode in segment.episodes])
                for segment in own:
                    segment.play(games, labels, arm, on_game)
                played += len(own)
    return played


def join_segments(segments: Sequence[Segment], played: Path, traces: Path, labels: Mapping[str, str | int]) -> None:
    """Join the segments of an arm into its log. `labels` name the arm in the metadata of its traces."""
    write_csv(joined("played", [read_csv(segment.file(PLAYED)) for segment in segments]), played)
    join_traces([segment.file(_TRACES) for segment in segments], traces, labels)
