"""The sentences that the commands print."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

if TYPE_CHECKING:
    from harness.campaign.plan.stages import Stage
    from harness.campaign.preflight import OpenCampaign
    from harness.config.persona import Persona
    from harness.traffic.scene import OpenScene

NOTHING_TO_SHORTEN = "Nothing to shorten: the players are already trained. All games are played."
INTERRUPTED = "Interrupted. Finished work is kept: run the same command again to continue."
NOTHING_TO_TUNE = "It has nothing to train or to tune: the campaign has rounds 0 and 1 only."
KEPT = "finished work is kept"

# --- errors: message and remedy ---
FILM_NEEDS_A_GAME = ("shows one game", "name the game: harness replay RUN ARM EPISODE")
JSON_IS_OF_A_LIST = ("lists games", "leave out the episode, or add --list")
EXPORT_A_GAME = (
    "is not an arm, an episode and a new folder",
    "harness export RUN ARM EPISODE DIR, or harness export RUN --failures DIR",
)
EXPORT_FAILURES = ("is more than an arm and a new folder", "harness export RUN [ARM] --failures DIR")
NO_EPISODE = ("is not the number of an episode", "harness replay RUN --list shows them")
NOT_A_FOLDER = ("is not a folder", "name a folder")
NOT_A_TOML_FILE = ("is not the name of a TOML file", "the name must end with .toml")
FOLDER_NOT_EMPTY = ("is there already, and not empty", "name a new folder")
BAD_PROJECT_NAME = (
    "the folder's name is that of the campaign, too: letters, digits, _ and -, a letter first, at most 40",
    "name another folder",
)
BAD_SCENE_NAME = ("can't be the name of a scene", "use letters, digits and _, a letter first, at most 40")
SCENE_EXISTS = ("is there already, and nothing is overwritten", "choose another NAME, or another folder with --out")
MAKING_SCENES = "making and checking scenes"
NO_CONFLICT_NEAR = ("there is no conflict near this edge", "give a larger --within")
ONE_OR_ALL = ("--conflict and --all exclude each other", "give one of them")
FILE_EXISTS = ("already exists", "no file is overwritten: name another file with --out")


def serving(address: str) -> str:
    return f"The report is at {address} until Ctrl-C."


def reading(file: Path) -> str:
    return f"reading {escape(str(file))}"


def cannot_write(error: OSError) -> tuple[str, str]:
    return f"can't be written: {error.strerror}", "name a folder that you may write"


def no_folder(folder: Path) -> tuple[str, str]:
    return f"there is no folder {folder}", "create it, or name another file"


def no_document_kind(kinds: Sequence[str]) -> tuple[str, str]:
    return "is missing", f"name one of {', '.join(kinds)}, or write all of them with --out DIR"


def no_such_conflict(count: int) -> tuple[str, str]:
    return "there is no conflict of this number", f"choose one from 1 to {count}: --list lists them"


def no_kind_of_conflict(kinds: Sequence[str]) -> tuple[str, str]:
    return "is no kind of conflict of this map", f"its kinds are {', '.join(kinds)}"


def bad_persona_name(name: str, suggestion: str) -> tuple[str, str]:
    message = f"{name!r} can't be the name of a persona: use letters, digits and _, a letter first, at most 40"
    return message, f"did you mean {suggestion!r}?" if suggestion else "for instance 'late_merger'"


def reserved_persona_name(name: str) -> tuple[str, str]:
    message = f"{name!r} can't be the name of a persona: stages and arms of every campaign have this name"
    return message, f"for instance '{name}_driver'"


def out_of_memory(error: BaseException) -> str:
    return f"the machine is short of memory: {error or 'none is left'}; {KEPT}"


def machine_error(error: OSError) -> str:
    return f"{error.filename or 'the run folder'}: {error.strerror}; {KEPT}"


# --- results ---


def persona_created(file: Path) -> str:
    show, check = f"harness persona show {file}", f"harness persona check {file}"
    return f"{file}: a valid persona, a careful driver. To see what it means: {show}; what is left to write: {check}"


def persona_in_order(file: Path, persona: Persona) -> str:
    """A checked persona with the number of its sources."""
    sources = f"{len(persona.sources)} source{'' if len(persona.sources) == 1 else 's'}"
    return f"{file} is in order: {persona.name}, {sources}. To see what it means: harness persona show {file}"


def project_created(folder: Path, files: Sequence[Path]) -> list[str]:
    """The files of a new project, and the next command."""
    return [*(f"wrote {file}" for file in files), f"Next: cd {folder} && harness campaign campaign.toml --quick"]


def conflicts_found(counts: Iterable[tuple[str, int]], left_out: Mapping[str, int]) -> Iterator[str]:
    """How many conflicts of each kind a map has, and why no scene can be made of others."""
    yield "in all: " + ", ".join(f"{count} {kind}" for kind, count in counts)
    for reason, count in sorted(left_out.items()):
        yield f"left out: {count} ({reason})"


def scene_made(number: int, place: str, folder: Path, campaign: Path) -> str:
    return f"conflict {number}, {place}: wrote {folder} and {campaign}"


def run_campaign_next(campaign: Path) -> str:
    return f"Next: harness campaign {campaign} --quick"


def policy_exported(file: Path, document: Path, difference: float) -> str:
    return (
        f"{file}: decides as the policy does, within {difference:.1g} over random observations. As a driver: {document}"
    )


def page_written(file: Path) -> str:
    return f"Page: {file}"


def exported(count: int, folder: Path) -> str:
    return f"Wrote {count} {'game' if count == 1 else 'games'} to {folder}: games.csv lists them"


def report_written(run: Path) -> str:
    return f"Report: {run / 'report.html'}"


def did_not_learn(training: str) -> str:
    return f"Did not learn: {training}"


def failed_stages(names: Sequence[str]) -> str:
    return f"Not finished: {', '.join(names)}"


def error_games(count: int, reasons: Sequence[str]) -> list[str]:
    """How many games could not be played, and a line for each reason."""
    return [f"{count} games could not be played; their pairs are left out", *(f"  {each}" for each in reasons)]


# --- harness check ---


def in_order(file: Path) -> str:
    return f"{file} is in order."


def scene_lines(scene: OpenScene) -> Iterator[str]:
    """What a checked scene is: its players with their routes, and whether there is other traffic."""
    for role, player, edges in zip(scene.world.roles, scene.document.players, scene.edges, strict=True):
        if player.way is not None:
            length_m = scene.world.road.routes.goal_m[scene.world.roles.index(role)]
            yield f"{role}: on foot, {length_m:.1f} m to its goal"
            continue
        goal = scene.document.goal_of(player)[1]
        yield f"{role}: vehicle {player.vehicle}, {len(edges)} edges, goal {goal.position_m:g} m along {goal.edge}"
    yield "with background traffic" if scene.has_background_traffic else "without background traffic"


def rows_left_out(number: int, what: str) -> str:
    return f"{number} more {what} are not listed: choose some with --near EDGE and --within M, or give a larger --rows"


def ego(campaign: OpenCampaign) -> str:
    """The external driver of the ego, and its round 2."""
    if campaign.ego_driver is None:
        return f"The ego: SUMO's own models. {NOTHING_TO_TUNE}"
    if not campaign.tunable:
        return f"The ego: {campaign.ego_driver.in_words}. {NOTHING_TO_TUNE}"
    search = campaign.document.reconfiguration
    ranges = ", ".join(f"{key} from {low:g} to {high:g}" for key, low, high in campaign.ego_driver.searched)
    round_2 = f"Round 2 searches its parameters in {search.trials} trials of {search.games} games: {ranges}."
    return f"The ego: {campaign.ego_driver.in_words}. {round_2}"


def work(campaign: OpenCampaign, stages: Sequence[Stage]) -> str:
    """How many trainings and arms there are."""
    from harness.campaign.plan.stages import AssessmentStage, TrainingStage

    document = campaign.document
    trainings = [stage for stage in stages if isinstance(stage, TrainingStage)]
    responses = sum(stage.is_best_response for stage in trainings)
    arms = sum(isinstance(stage, AssessmentStage) for stage in stages)
    if campaign.policies is None:
        parts = [f"{_counted(len(trainings) - responses, 'training')} of up to {document.training.steps:,} steps"]
    else:
        parts = [f"Trained players are read from {campaign.policies}: nothing is trained"]
    if document.best_response is not None:
        budget = f"of up to {document.best_response.steps:,} steps"
        parts.append(f"{_counted(responses, 'training')} of best responses {budget}")
    return ", ".join([*parts, f"{_counted(arms, 'arm')} of {_counted(document.assessment.episodes, 'episode')}:"])


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def stage_lines(stages: Sequence[Stage]) -> Iterator[str]:
    """A line for each stage: its kind, its name, the stages before it, and the policies that it reads."""
    from harness.campaign.plan.stages import TrainingStage

    for stage in stages:
        reads = () if isinstance(stage, TrainingStage) else stage.reads
        after = f"  after {', '.join(stage.needs)}" if stage.needs else ""
        yield f"  {stage.verb:6s} {stage.id}{after}" + (f"  with {', '.join(reads)}" if reads else "")


def stage_records(stages: Sequence[Stage]) -> list[dict[str, object]]:
    """A record for each stage, as `stage_lines` tells it."""
    return [
        {
            "stage": stage.id,
            "kind": stage.kind,
            "persona": stage.persona,
            "seed": stage.seed,
            "after": list(stage.needs),
            "reads": list(stage.reads),
        }
        for stage in stages
    ]
