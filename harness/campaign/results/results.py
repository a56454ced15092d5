"""The results of a run: tables, replays and report, from its folder alone."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError
from rich.console import Console
from rich.progress import track

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage, Stage, TrainingStage, stage_id
from harness.campaign.results.acceptance import checks_of, shown_lines, write_ci_files
from harness.campaign.results.judged_failures import preventability_tables
from harness.campaign.results.kept_results import RunResult, ShownCheck, ShownVerdict, keep_result
from harness.campaign.results.matchups import matchups_of
from harness.campaign.results.model_cards import write_model_cards
from harness.campaign.results.policy_cards import trained_policies
from harness.campaign.results.population_summary import by_who_drove
from harness.campaign.results.recorded_games import recorded_games, scene_drawing
from harness.campaign.storage.learned import did_not_learn, judged
from harness.campaign.storage.manifest import FINISHED, is_tuned
from harness.campaign.storage.manoeuvre_table import manoeuvres_of
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.campaign.storage.run_log import LOGGER
from harness.campaign.storage.trace_tables import cause_table, severity_table, with_severity
from harness.config.campaign import Campaign
from harness.errors import UsageError, plain
from harness.evaluation.acceptance import Evidence, unanswered
from harness.evaluation.causes.columns import CAUSE_COLUMNS
from harness.evaluation.comparison import compare, games_by_arm
from harness.evaluation.competence import Goals, goals_alone
from harness.evaluation.game_theory.findings import find
from harness.evaluation.game_theory.records import GameFindings
from harness.evaluation.research_questions import Question
from harness.evaluation.summary import summarise
from harness.evaluation.tables import (
    MANOEUVRE_COLUMNS,
    PLAYED_COLUMNS,
    RECONFIGURATION_COLUMNS,
    TRAINING_COLUMNS,
    is_of_a_search,
    read_csv,
    typed,
    write_csv,
)
from harness.evaluation.trace_file import TraceReader, check_traces
from harness.evaluation.unplayed_games import reasons_of
from harness.evaluation.worst_first import worst_first
from harness.files import write_atomically
from harness.replay import choose_games, names_in_pictures, replay_name, write_replay
from harness.reports.game_wording import gap_verdicts
from harness.reports.page import render_page
from harness.reports.provenance import mixed_versions, warn
from harness.reports.run_findings import results
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import ARMS, Conclusion
from harness.traffic.scene import OpenScene, open_scene

WRITING_REPLAYS = "writing replays"


def write_results(folder: RunFolder, console: Console) -> RunResult:
    """Write tables, replays and report of the finished stages, from the run folder alone."""
    written = folder.manifest()
    folder.check_whole(written)
    campaign = _campaign(written)
    stages = plan(campaign, written["personas"], is_tuned(written))
    done = {name: entry for name, entry in written["stages"].items() if entry["status"] == "done"}
    played = _gather(folder, done, "assessment", "episodes.csv", list(PLAYED_COLUMNS))
    _check_traces(folder, played)
    training = _gather(folder, done, "training", "training.csv", list(TRAINING_COLUMNS))
    reconfiguration = _gather(folder, done, "reconfiguration", "reconfiguration.csv", list(RECONFIGURATION_COLUMNS))
    policies = trained_policies(folder, written)
    scene = open_scene(folder.scene)
    with _doing(console, "working out how severe each game is, and why the ego failed"):
        episodes = with_severity(played, [severity_table(folder, name, scene) for name in _arms(done)])
        causes = _joined([cause_table(folder, name, scene) for name in _arms(done)], CAUSE_COLUMNS)
    entries = judged(written["stages"], campaign, stages, _goals(stages, episodes))
    manifest = {**written, "stages": entries}
    training = _with_ends(training, entries)
    summary = summarise(episodes)
    arms = {stage.name: stage.arm for stage in stages if isinstance(stage, AssessmentStage)}
    asked = _questions(campaign, manifest)
    comparisons = compare(asked, episodes, manifest["campaign"]["assessment"]["significance"])
    tables = {"episodes": episodes, "training": training, "summary": summary, "comparisons": comparisons}
    tables["causes"] = causes
    game = _game(campaign, manifest, episodes)
    tables |= game.tables if game is not None else {}
    prevented = preventability_tables(folder, done, episodes)
    tables |= prevented
    populations = by_who_drove(campaign, episodes)
    tables |= {"populations": populations} if campaign.population else {}
    tables |= {"reconfiguration": reconfiguration} if is_tuned(manifest) else {}
    write_model_cards(folder, manifest, policies, summary)
    for name, table in tables.items():
        write_csv(table, folder.path / f"{name}.csv")
    with _doing(console, "naming manoeuvres"):
        manoeuvres = _manoeuvres(folder, done, scene)
    write_csv(manoeuvres, folder.path / "manoeuvres.csv")
    replays = _write_replays(folder, scene, episodes, console)
    gaps = game.gaps if game is not None else None
    judged_failures = prevented.get("preventability")
    evidence = Evidence(
        arms=arms,
        episodes=episodes,
        summary=summary,
        gaps=gaps,
        preventability=judged_failures,
        unanswered=unanswered(comparisons),
    )
    checks = checks_of(campaign, manifest["personas"], evidence)
    report = RunTables(
        manifest=manifest,
        arms=arms,
        strategies={stage.name: stage.strategy for stage in stages if isinstance(stage, TrainingStage)},
        episodes=episodes,
        summary=summary,
        comparisons=comparisons,
        training=training,
        reconfiguration=reconfiguration,
        manoeuvres=manoeuvres,
        causes=causes,
        game=game,
        replays=replays,
        non_ego_drives=all(each.drives for each in scene.document.players[1:]),
        populations=populations,
        **prevented,
        acceptance=checks,
    )
    with _doing(console, "writing the report"):
        games = recorded_games(episodes, arms, lambda arm, seed: folder.traces(stage_id(arm, seed)), scene)
        page = render_page(report, games, scene_drawing(scene))
    write_atomically(folder.path / "report.html", page.encode())
    warn(mixed_versions(manifest["stages"]), console)
    failed = tuple(name for name, entry in manifest["stages"].items() if entry["status"] not in FINISHED)
    found = results(report)
    personas = [*manifest["personas"], *campaign.mixed_people]
    verdicts = [(persona, found.verdicts(question, persona)) for persona in personas for question in ARMS]
    verdicts += gap_verdicts(game.gaps) if game is not None else []
    result = RunResult(
        verdicts=tuple(
            _shown(persona, verdict, found.causes(verdict.question, persona)) for persona, verdict in verdicts
        ),
        failed_stages=failed,
        error_games=int((episodes["error"] != "").sum()),
        error_reasons=tuple(map(plain, reasons_of(episodes["error"]))),
        did_not_learn=tuple(f"{name}: {shortfall}" for name, shortfall in did_not_learn(entries).items()),
        acceptance=tuple(
            ShownCheck(passed=each.passed, text=each.text) for each in shown_lines(checks, len(campaign.seeds))
        ),
    )
    write_ci_files(folder, manifest, checks, result)
    keep_result(folder, written, result)
    LOGGER.info("wrote the results of %d games; exit code %d", len(episodes), result.exit_code)
    return result


def _shown(persona: str, verdict: Conclusion, causes: tuple[str, ...] = ()) -> ShownVerdict:
    told = {name: getattr(verdict, name) for name in ("question", "label", "tone", "sentence", "speed")}
    return ShownVerdict(persona=persona, causes=causes, **told)


@contextmanager
def _doing(console: Console, what: str) -> Iterator[None]:
    """Show what is being done: as long as it takes on a terminal, as a line elsewhere."""
    _say(console, what)
    with console.status(what):
        yield


def _say(console: Console, what: str) -> None:
    """A line where the output is not a terminal, as `StageProgress` prints it for stages."""
    if not console.is_terminal:
        console.print(f"results  {what}", highlight=False, markup=False)


def _goals(stages: Iterable[Stage], episodes: pd.DataFrame) -> dict[str, Goals]:
    """How often the player of each arm without another player reached its goal, by the arm's stage."""
    games = games_by_arm(episodes)
    alone = [each for each in stages if isinstance(each, AssessmentStage) and not all(each.sides)]
    return {each.id: goals_alone(games.get((each.name, each.seed)), "ego" if each.ego else "non_ego") for each in alone}


def _with_ends(training: pd.DataFrame, entries: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """The learning curves, with the judgement of the manifest in the last row of each training."""
    last = training.drop_duplicates(["stage", "seed"], keep="last")
    ends = [entries[stage_id(str(row.stage), row.seed)].get("stopped") for row in last.itertuples()]
    return training.assign(stopped=pd.Series(ends, index=last.index, dtype=object).reindex(training.index).fillna(""))


def _questions(campaign: Campaign, manifest: Mapping[str, Any]) -> list[Question]:
    """The questions that the finished arms of a run can answer."""
    done = _done(manifest)
    return [
        question
        for question in questions(campaign, manifest["personas"], is_tuned(manifest))
        if {stage_id(arm, question.seed) for arm in (question.baseline, question.treatment)} <= done
    ]


def _game(campaign: Campaign, manifest: Mapping[str, Any], episodes: pd.DataFrame) -> GameFindings | None:
    """The findings on the game between strategies, from the finished arms of a run; None where it is not asked."""
    game = matchups_of(campaign, manifest["personas"], _done(manifest), is_tuned(manifest))
    if game is None:
        return None
    return find(game.pairings, game.responses, game.training_personas, episodes, campaign.assessment.significance)


def _campaign(manifest: Mapping[str, Any]) -> Campaign:
    try:
        return Campaign.model_validate(manifest["campaign"], strict=False)
    except ValidationError as error:
        raise UsageError.of(MANIFEST, "campaign", f"is damaged: {error}", "run the campaign again") from None


def _done(manifest: Mapping[str, Any]) -> set[str]:
    return {name for name, entry in manifest["stages"].items() if entry["status"] == "done"}


def _arms(done: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The finished stages that are arms."""
    return [name for name, entry in done.items() if entry["kind"] == "assessment"]


def _gather(folder: RunFolder, done: Mapping[str, Any], kind: str, table: str, columns: list[str]) -> pd.DataFrame:
    frames = []
    for name, entry in done.items():
        if entry["kind"] == kind:
            file = folder.work(name) / table
            frame = read_csv(file)
            names = frame["arm" if kind == "assessment" else "stage"]
            belong = ((names == entry["name"]) & (frame["seed"] == entry["seed"])).all()
            if not belong or (kind == "reconfiguration" and not is_of_a_search(frame)):
                raise UsageError.of(file, "", f"has rows that are not of {name}", "run the campaign again")
            frames.append(frame)
    return typed(pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=columns))


def _check_traces(folder: RunFolder, episodes: pd.DataFrame) -> None:
    played = episodes[episodes["error"] == ""]
    for (arm, seed), games in played.groupby(["arm", "seed"], sort=False):
        check_traces(folder.traces(stage_id(str(arm), seed)), games["episode"])


def _manoeuvres(folder: RunFolder, done: Mapping[str, Any], scene: OpenScene) -> pd.DataFrame:
    return _joined([manoeuvres_of(folder, name, scene) for name in _arms(done)], MANOEUVRE_COLUMNS)


def _joined(frames: Sequence[pd.DataFrame], columns: Mapping[str, str]) -> pd.DataFrame:
    """Tables of arms as one; without arms an empty one with these columns."""
    filled = [frame for frame in frames if len(frame)]
    return typed(pd.concat(filled, ignore_index=True) if filled else pd.DataFrame(columns=list(columns)))


def _write_replays(folder: RunFolder, scene: OpenScene, episodes: pd.DataFrame, console: Console) -> list[str]:
    chosen = worst_first(choose_games(episodes))
    folder.replays.mkdir(exist_ok=True)
    names = [replay_name(game.arm, game.seed, game.episode) for game in chosen.itertuples()]
    games = list(zip(chosen.itertuples(), names, strict=True))
    reader = TraceReader()
    _say(console, WRITING_REPLAYS)
    for game, name in track(games, WRITING_REPLAYS, console=console, transient=True, disable=not console.is_terminal):
        write_replay(
            reader.read(folder.traces(stage_id(game.arm, game.seed)), game.episode),
            scene.net_file,
            scene.route_files,
            folder.replays / name,
            title=f"{game.arm}, seed {game.seed}, episode {game.episode}",
            step_length_s=scene.world.step_s,
            names=names_in_pictures(game.persona),
            rails=scene.rail_lines,
            obstacles=scene.obstacles,
            stripes=scene.stripes,
        )
    _drop_stale(folder.replays, set(names))
    return names


def _drop_stale(replays: Path, names: set[str]) -> None:
    for old in replays.iterdir():
        if old.is_dir() and old.name not in names:
            shutil.rmtree(old)
