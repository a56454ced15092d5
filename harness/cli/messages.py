"""The sentences that several commands print, or that are made of many parts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

from harness.wording import counted

if TYPE_CHECKING:
    from harness.campaign.plan.stages import Stage
    from harness.campaign.preflight import OpenCampaign
    from harness.road.scene.open_scene import OpenScene

NOTHING_TO_SHORTEN = "Nothing to shorten: the players are already trained. All games are played."
NOTHING_TO_TUNE = "It has nothing to train or to tune: the campaign has rounds 0 and 1 only."


def reading(file: Path) -> str:
    return f"reading {escape(str(file))}"


def rows_left_out(number: int, what: str) -> str:
    return f"{number} more {what} are not listed: choose some with --near EDGE and --within M, or give a larger --rows"


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


def ego(campaign: OpenCampaign) -> str:
    """The external driver of the ego, and its round 2."""
    driver = campaign.ego_driver
    if driver is None or not campaign.tunable:
        words = "SUMO's own models" if driver is None else driver.in_words
        return f"The ego: {words}. {NOTHING_TO_TUNE}"
    search = campaign.document.reconfiguration
    ranges = ", ".join(f"{key} from {low:g} to {high:g}" for key, low, high in driver.searched)
    round_2 = f"Round 2 searches its parameters in {search.trials} trials of {search.games} games: {ranges}."
    return f"The ego: {driver.in_words}. {round_2}"


def work(campaign: OpenCampaign, stages: Sequence[Stage]) -> str:
    """How many trainings and arms there are."""
    from harness.campaign.plan.stages import AssessmentStage, RejectionGate, TrainingStage
    from harness.campaign.plan.strategy_stages import training_settings

    document = campaign.document
    trainings = [stage for stage in stages if isinstance(stage, TrainingStage)]
    responses = sum(stage.is_best_response for stage in trainings)
    of_arms = [stage for stage in stages if isinstance(stage, AssessmentStage)]
    rejected = sum(any(isinstance(gate, RejectionGate) for gate in stage.gates) for stage in of_arms)
    if campaign.policies is None:
        most = max((training_settings(document, each).steps for each in trainings), default=document.training.steps)
        parts = [f"{counted(len(trainings) - responses, 'training')} of up to {most:,} steps"]
    else:
        parts = [f"Trained players are read from {campaign.policies}: nothing is trained"]
    if document.best_response is not None:
        budget = f"of up to {document.best_response.steps:,} steps"
        parts.append(f"{counted(responses, 'training')} of best responses {budget}")
    arms = counted(len(of_arms) - rejected, "arm") + (f" and up to {rejected} of rejected answers" if rejected else "")
    return ", ".join([*parts, f"{arms} of {counted(document.assessment.episodes, 'episode')}:"])


def stage_lines(stages: Sequence[Stage]) -> Iterator[str]:
    """A line for each stage: its kind, its name, the stages before it, and the policies that it reads. The stages of
    several training seeds are alike: they share a line, which says what is of the other seeds."""
    from harness.campaign.plan.stages import TrainingStage

    seeds = list(dict.fromkeys(stage.seed for stage in stages))
    for stage in stages:
        if stage.seed != seeds[0]:
            continue
        policies = () if isinstance(stage, TrainingStage) else stage.reads
        if len(seeds) == 1:
            name, needs, reads = stage.id, ", ".join(stage.needs), ", ".join(policies)
        else:
            name, needs, reads = stage.name, _of_each_seed(stage, stage.needs), _of_each_seed(stage, policies)
        after, read = f"  after {needs}" if needs else "", f"  with {reads}" if reads else ""
        yield f"  {stage.verb:6s} {name}{after}{read}"
    if len(seeds) > 1:
        yield f"Each for the training seeds {', '.join(map(str, seeds))}."


def _of_each_seed(stage: Stage, ids: Iterable[str]) -> str:
    """The names of other stages, by id, as a stage of any training seed needs them."""
    from harness.evaluation.strategies import name_and_seed

    named = [name_and_seed(each) for each in ids]
    own, others = (
        dict.fromkeys(name for name, seed in named if (seed == stage.seed) is same) for same in (True, False)
    )
    return "; ".join(filter(None, (", ".join(own), ", ".join(others) + " of other seeds" if others else "")))


def stage_records(stages: Sequence[Stage]) -> list[dict[str, object]]:
    """A record for each stage, with its needs and what it reads."""
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
