"""The questions of a run about its persons: one about a person that drives unlike people is not answered."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.stages import stage_id
from harness.campaign.results.read_run import ReadRun
from harness.campaign.storage.manifest import is_tuned
from harness.config.campaign import Campaign
from harness.evaluation.competence import Question
from harness.reports.human_ranges import unlike_people


def declared_of(run: ReadRun) -> dict[str, dict[str, str]]:
    """By persona: the figures in which it declares to be unlike people, with its reasons."""
    documents = run.manifest["persona_documents"]
    return {
        name: {each["figure"]: each["reason"] for each in document.get("unlike_people", ())}
        for name, document in documents.items()
    }


def questions_of(run: ReadRun, realism: pd.DataFrame) -> list[Question]:
    """The planned questions, each with what its person does that people do not, if the campaign asks.

    `realism` is the table of this name. Of a population or crowd, each persona is asked.
    """
    asked = run.campaign.competence.non_ego_like_people
    return [
        replace(question, unlike_people=_clauses(run.campaign, question, realism) if asked else "")
        for question in questions(run.campaign, run.manifest["personas"], is_tuned(run.manifest))
    ]


def is_played(question: Question, run: ReadRun) -> bool:
    """Whether the arms of a question are finished."""
    return {stage_id(arm, question.seed) for arm in (question.baseline, question.treatment)} <= run.done


def _clauses(campaign: Campaign, question: Question, realism: pd.DataFrame) -> str:
    mixed = campaign.mixed_people.get(question.persona, ({question.persona: 1.0},))
    members = dict.fromkeys(name for shares in mixed for name in shares)
    return "; ".join(filter(None, (unlike_people(realism, name, question.seed) for name in members)))
