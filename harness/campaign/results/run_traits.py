"""What traits of the people make the ego of a run fail, and in which failures a person decided nothing."""

from __future__ import annotations

import pandas as pd

from harness.campaign.plan.attribution_arms import trait_questions
from harness.campaign.plan.stages import stage_id
from harness.campaign.results.read_run import ReadRun
from harness.campaign.storage.manifest import traits_in
from harness.evaluation.comparisons.attribution import attribute
from harness.evaluation.undecided import count_undecided


def failures_by_trait(run: ReadRun) -> dict[str, pd.DataFrame]:
    """The tables `attribution`, of the questions whose arms are finished, and `undecided`, by name."""
    asked = [
        question
        for question in trait_questions(run.campaign, traits_in(run.manifest))
        if {stage_id(arm, question.seed) for arm in question.arms} <= run.done
    ]
    undecided = count_undecided(run.episodes, run.causes, run.conduct)
    return {"attribution": attribute(asked, run.episodes), "undecided": undecided}
