"""Carrying out an arm in segments of games: each is stored when it is played, and all are joined at the end.

<work>/segments/<first>-<last>.json            checksums: the segment is complete; and the versions that played it
<work>/segments/<first>-<last>.<table>         its log: outcomes and errors, and traces

So an arm continues where it stopped, and needs the memory of one segment, however many games it has. A game depends on
nothing but itself: the files of an arm are the same bytes with and without interruptions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from harness.assessment.rollout import Game, SeatedArm, assess
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.arm_tables import PLAYED, arm_tables
from harness.campaign.storage.checksums import intact_record, write_checksums
from harness.campaign.storage.versions import versions_of_numbers
from harness.errors import StageFailed
from harness.evaluation.competence import goals_alone
from harness.evaluation.tables import joined, read_csv, table_of, write_csv
from harness.evaluation.trace_file import join_traces, trace_writer
from harness.evaluation.unplayed_games import reason_of
from harness.files import make_folder
from harness.road.scene.open_scene import OpenScene

SEGMENT_EPISODES = 50
HOPELESS_GAMES = 10
"""An arm ends if this many games, its first, can't be played for one reason: the others would not be played either."""
KEEP_GOING = "--keep-going"
_TRACES = "traces.parquet"


@dataclass(frozen=True)
class Segment:
    """Consecutive games of an arm, and the folder that stores them."""

    folder: Path
    episodes: range

    def file(self, name: str) -> Path:
        return self.folder / f"{self.episodes[0]:06d}-{self.episodes[-1]:06d}.{name}"

    def errors(self) -> int | None:
        """How many of its games could not be played; None if it is not complete, or was played by other versions."""
        record = intact_record(self.file("json"), self.folder, versions=versions_of_numbers()) or {}
        errors = record.get("errors")
        return errors if isinstance(errors, int) else None

    def play(
        self, games: Iterator[Game], labels: Mapping[str, Any], arm: SeatedArm, on_game: Callable[[Game], None]
    ) -> int:
        """Play it; `games` yields its games next. Returns how many of them could not be played."""
        records = []
        with trace_writer(self.file(_TRACES)) as add_trace:
            for _ in self.episodes:
                game = next(games)
                records.append({**game.played, **labels})
                if game.trace is not None:
                    add_trace(game.trace)
                on_game(game)
        table = table_of("played", records, len(arm.drivers) - 1)
        write_csv(table, self.file(PLAYED))
        files = [self.file(name) for name in (PLAYED, _TRACES)]
        errors = int((table["error"] != "").sum())
        write_checksums(self.file("json"), self.folder, files, {"errors": errors, "versions": versions_of_numbers()})
        return errors


def carry_out_assessment(stage: AssessmentStage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Play an arm; the facts, and the files of its log. Raises as `PlayerFactory.arm` and `play_segments` do."""
    folder, players = run.context.folder, PlayerFactory(context=run.context, scene=scene)
    stage, choice = players.chosen(stage)
    segments = segments_of(folder.segments(stage.id), run.context.document.assessment.episodes)
    labels: dict[str, str | int] = {"arm": stage.name, "persona": stage.persona, "seed": stage.seed}
    errors = play_segments(players.arm(stage), segments, labels, run)
    played, traces = folder.work(stage.id) / PLAYED, folder.traces(stage.id)
    join_segments(segments, played, traces, labels)
    games = arm_tables(folder, stage.id, scene).episodes
    facts: dict[str, Any] = {"episodes": len(games), "errors": errors}
    facts |= {"versions": [versions_of_numbers()], **choice}
    if not all(stage.sides):  # whether the training of the player that drives alone succeeded
        facts |= goals_alone(games, "ego" if stage.ego else "non_ego").record()
    return facts, [played, traces]


def segments_of(folder: Path, episodes: int) -> list[Segment]:
    firsts = range(0, episodes, SEGMENT_EPISODES)
    return [Segment(folder, range(first, min(first + SEGMENT_EPISODES, episodes))) for first in firsts]


def play_segments(arm: SeatedArm, segments: Sequence[Segment], labels: Mapping[str, Any], run: StageRun) -> int:
    """Play the games of an arm that are missing. Returns how many of all its games could not be played.

    `labels` are the cells that all records share. The run is told of each episode before that game is played, and of
    the games played and their total. Raises as `assess` does, and StageFailed if the first ten games can't be played
    for one reason, unless the run keeps going.
    """
    make_folder(segments[0].folder)
    errors = {segment: segment.errors() for segment in segments}
    missing = [each for each, found in errors.items() if found is None or (found and run.attempt.first)]
    total = segments[-1].episodes.stop
    done = total - sum(len(segment.episodes) for segment in missing)
    first: list[str] | None = None if run.context.keep_going or done else []

    def on_game(game: Game) -> None:
        nonlocal done
        done += 1
        run.on_progress(done, total)
        if first is None or done > HOPELESS_GAMES:
            return
        first.append(str(game.played["error"]))
        if done == HOPELESS_GAMES and all(first) and len(set(map(reason_of, first))) == 1:
            what = f"{arm.name}: none of its first {HOPELESS_GAMES} games could be played, all for one reason"
            raise StageFailed(f"{what} ({KEEP_GOING} plays the others too): {first[0]}")

    episodes = chain.from_iterable(segment.episodes for segment in missing)
    with closing(assess(arm, episodes, run.on_start, run.attempt.abandoned)) as games:  # type: ignore[type-var]
        for segment in missing:
            segment.file("json").unlink(missing_ok=True)
            errors[segment] = segment.play(games, labels, arm, on_game)
    return sum(found or 0 for found in errors.values())


def join_segments(segments: Sequence[Segment], played: Path, traces: Path, labels: Mapping[str, str | int]) -> None:
    """Join the segments of an arm into its log. `labels` name the arm in the metadata of its traces."""
    write_csv(joined("played", [read_csv(segment.file(PLAYED)) for segment in segments]), played)
    join_traces([segment.file(_TRACES) for segment in segments], traces, labels)
