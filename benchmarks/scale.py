"""`python -m benchmarks scale`: what a large study would take, laid out by the campaign's own schedule.

The stages are those that campaigns would plan; the seconds of each kind of stage are those measured by
`campaign_minutes`. Nothing is run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from statistics import mean
from typing import Any

from benchmarks.campaign import TimedStage, makespan_s
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage, SelectionStage, Stage, TrainingStage
from harness.config.campaign import Campaign
from harness.evaluation.strategies import NaiveEgo
from harness.game.roles import EGO

SCENES, SEEDS, ROUNDS = 12, 5, 4
PERSONAS = ("careful", "cautious", "speedy", "tailgater", "late_merger", "texting", "drowsy", "impaired")
CORES = (2, 64, 1024)
_KINDS = {
    "naive": "training of the naive ego",
    "non_ego": "training of a non-ego",
    "ego": "retraining of the ego",
    "alone": "arm of a player alone",
    "pair": "arm of two players",
    "selection": "selection among policies",
}
_HOUR_S = 3600.0


@dataclass(frozen=True, kw_only=True)
class Study:
    """The campaigns of a study, one per scene, with measured times; all campaigns have the same stages."""

    stages: Sequence[TimedStage]
    """Of one campaign."""
    kinds: Mapping[str, str]
    """Of each stage, by its id."""
    report_s: float

    @property
    def work_s(self) -> float:
        """Core-seconds of all campaigns."""
        return SCENES * (sum(stage.seconds for stage in self.stages) + self.report_s)

    @property
    def critical_path(self) -> Sequence[TimedStage]:
        """The chain of stages of a campaign that takes longest."""
        by_id = {stage.id: stage for stage in self.stages}

        @cache
        def chain(name: str) -> tuple[float, tuple[TimedStage, ...]]:
            stage = by_id[name]
            length_s, before = max((chain(each) for each in stage.needs), key=lambda each: each[0], default=(0.0, ()))
            return length_s + stage.seconds, (*before, stage)

        return max(map(chain, by_id), key=lambda each: each[0])[1]

    @property
    def least_s(self) -> float:
        """Seconds that a campaign takes on any number of cores: its critical path and its report."""
        return sum(stage.seconds for stage in self.critical_path) + self.report_s

    def in_turn_s(self, cores: int) -> float:
        """Wall seconds of the campaigns one after the other, each on all cores."""
        return SCENES * (makespan_s(self.stages, cores) + self.report_s)

    def at_once_s(self, cores: int, seeds_in_turn: bool = True) -> float:
        """Wall seconds of all campaigns at the same time: their stages and reports share the cores.

        `seeds_in_turn`: the schedule prefers the first seeds, as it does in a campaign.
        """
        together = []
        for scene in range(SCENES):
            for stage in (*self.stages, self._report()):
                needs = [f"{each}-scene{scene}" for each in stage.needs]
                seed = stage.seed if seeds_in_turn else 0
                together.append(replace(stage, id=f"{stage.id}-scene{scene}", needs=needs, seed=seed))
        return makespan_s(together, cores)

    def _report(self) -> TimedStage:
        needs = [stage.id for stage in self.stages]
        return TimedStage(id="report", seed=self.stages[-1].seed, needs=needs, seconds=self.report_s)


def study_of(results: Mapping[str, Any]) -> Study:
    """The study, with the times of results. Raises KeyError where they have no campaign."""
    measured = results["details"]["campaign"]
    paper = _plan(["paper_speedy", "paper_distracted"], seeds=1, rounds=2)
    kinds = {_kind(stage) for stage in paper}
    seconds = {kind: mean(measured["seconds"][stage.id] for stage in paper if _kind(stage) == kind) for kind in kinds}
    arms = sum(isinstance(stage, AssessmentStage) for stage in paper)
    planned = _plan(PERSONAS, SEEDS, ROUNDS)
    per_arm_s = 60.0 * measured["report_minutes"] / arms
    return Study(
        stages=[
            TimedStage(id=each.id, seed=each.seed, needs=each.needs, seconds=_seconds(each, seconds))
            for each in planned
        ],
        kinds={stage.id: _kind(stage) for stage in planned},
        report_s=per_arm_s * sum(isinstance(stage, AssessmentStage) for stage in planned),
    )


def _plan(personas: Sequence[str], seeds: int, rounds: int) -> list[Stage]:
    document = {
        "name": "scale",
        "scene": "scene",
        "personas": [f"{name}.toml" for name in personas],
        "seeds": list(range(1, seeds + 1)),
        "rounds": {"count": rounds},
        "assessment": {"reference_drivers": False},
    }
    return plan(Campaign.model_validate(document), list(personas))


def _seconds(stage: Stage, of_kinds: Mapping[str, float]) -> float:
    """A selection plays the games of an arm with each of its candidates."""
    if isinstance(stage, SelectionStage):
        return len(stage.candidates) * of_kinds["pair"]
    return of_kinds[_kind(stage)]


def _kind(stage: Stage) -> str:
    if isinstance(stage, SelectionStage):
        return "selection"
    if isinstance(stage, TrainingStage):
        return "naive" if stage.strategy == NaiveEgo() else "ego" if stage.learner == EGO else "non_ego"
    assert isinstance(stage, AssessmentStage)
    return "pair" if all(stage.sides) else "alone"


def scale_text(results: Mapping[str, Any]) -> str:
    """The tables in Markdown, as in docs/scaling.md."""
    study = study_of(results)
    path = " → ".join(f"`{stage.id}`" for stage in study.critical_path)
    path_s = sum(stage.seconds for stage in study.critical_path)
    return "\n\n".join(
        (
            _stage_table(study),
            _wall_table(study),
            f"Critical path of a campaign, {path_s / 60:.1f} min, then {study.report_s / 60:.1f} min for its report: "
            f"{path}.",
        )
    )


def _stage_table(study: Study) -> str:
    lines = ["| stage | number | seconds each | core-hours |", "| --- | ---: | ---: | ---: |"]
    for kind, name in _KINDS.items():
        times = [stage.seconds for stage in study.stages if study.kinds[stage.id] == kind]
        hours = SCENES * sum(times) / _HOUR_S
        lines.append(f"| {name} | {SCENES * len(times):,} | {mean(times):.1f} | {hours:.1f} |")
    lines.append(f"| report | {SCENES} | {study.report_s:.0f} | {SCENES * study.report_s / _HOUR_S:.1f} |")
    lines.append(f"| all | {SCENES * (len(study.stages) + 1):,} | | {study.work_s / _HOUR_S:.1f} |")
    return "\n".join(lines)


def _wall_table(study: Study) -> str:
    lines = [
        "| cores | in turn: hours | efficiency | at once: hours | efficiency | no seed first: hours | at least |",
        "| ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for cores in CORES:
        in_turn_s, at_once_s = study.in_turn_s(cores), study.at_once_s(cores)
        at_least_s = max(study.work_s / cores, study.least_s)
        cells = [
            f"{cores:,}",
            _hours(in_turn_s),
            _share(study.work_s / (cores * in_turn_s)),
            _hours(at_once_s),
            _share(study.work_s / (cores * at_once_s)),
            _hours(study.at_once_s(cores, seeds_in_turn=False)),
            _hours(at_least_s),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _hours(seconds: float) -> str:
    return f"{seconds / _HOUR_S:.2f}"


def _share(share: float) -> str:
    return f"{share:.0%}"
