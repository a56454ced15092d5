"""What a run tells of its people: the questions about them, of which one about a person that drives unlike people is
not answered; the traits that make the ego fail; and the games against a population, by the persona that drove."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from harness.campaign.plan.attribution_arms import trait_questions
from harness.campaign.plan.paper_rounds import questions
from harness.campaign.results.read_run import ReadRun
from harness.campaign.storage.manifest import is_tuned, traits_in
from harness.config.campaign import Campaign
from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.attribution import attribute
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import Question
from harness.evaluation.people import people_in
from harness.evaluation.strategies import NaiveEgo, ReconfiguredEgo, RetrainedEgo, against_persona, stage_id
from harness.evaluation.tables import joined
from harness.evaluation.undecided import count_undecided
from harness.game.initial_state import member_in_episode
from harness.game.roles import NON_EGO
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
    return {stage_id(arm, question.seed) for arm in (question.baseline, question.treatment)} <= run.done


def _clauses(campaign: Campaign, question: Question, realism: pd.DataFrame) -> str:
    mixed = campaign.mixed_people.get(question.persona, ({question.persona: 1.0},))
    members = dict.fromkeys(name for shares in mixed for name in shares)
    return "; ".join(filter(None, (unlike_people(realism, name, question.seed) for name in members)))


def failures_by_trait(run: ReadRun) -> dict[str, pd.DataFrame]:
    """The tables `attribution`, of the questions whose arms are finished, and `undecided`, by name."""
    asked = [
        question
        for question in trait_questions(run.campaign, traits_in(run.manifest))
        if {stage_id(arm, question.seed) for arm in question.arms} <= run.done
    ]
    tables = run.tables
    undecided = count_undecided(tables.episodes, tables.causes, tables.conduct)
    return {"attribution": attribute(asked, tables.episodes), "undecided": undecided}


_SUMMARY_COLUMNS = [name for name in TABLES["populations"] if name not in ("arm", "population", "seed", "persona")]


def by_who_drove(campaign: Campaign, episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each arm against a population, seed and persona that drove in it, the table `populations`. With several
    people, the personas in their places.

    The draw is repeated here: it depends on the place, the seed of the starts and the episode only.
    """
    frames = []
    for population in campaign.population:
        name, names, shares = population.name, list(population.shares), list(population.shares.values())
        egos = (NaiveEgo(), RetrainedEgo(against=name), ReconfiguredEgo(against=name))
        for arm in [against_persona(ego, name).name for ego in egos]:
            games = episodes[episodes["arm"] == arm]
            players = range(NON_EGO, NON_EGO + len(people_in(games.columns)))
            members = [
                [member_in_episode(shares, player, campaign.start_seed, int(episode)) for player in players]
                for episode in games["episode"]
            ]
            drivers = [", ".join(names[each] for each in of_game) for of_game in members]
            rows = summarise(games.assign(persona=drivers)).sort_values(["seed", "persona"], kind="stable")
            frames.append(rows[["arm", "seed", "persona", *_SUMMARY_COLUMNS]].assign(population=name))
    return joined("populations", frames)
