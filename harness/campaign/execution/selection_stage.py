"""Carrying out a selection: the games of every candidate, their table, and the policy with which the player goes on.

The selection of round r plays the episodes r E to (r + 1) E - 1, where an arm has E: an arm plays 0 to E - 1, the
choice of a best response E to 2 E - 1, and the first selection is that of round 3. So a policy is chosen by games that
no other choice and no arm plays. The first of them, as many as the training's share, are alone on the road.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.assessment.rollout import assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import StageRun
from harness.campaign.plan.planned_drivers import Side
from harness.campaign.plan.stages import SelectionStage
from harness.campaign.storage.versions import versions_of_numbers
from harness.drivers.policy_file import policy_files, read_policy, write_policy
from harness.errors import StageFailed
from harness.evaluation.game_theory.policy_selection import CandidateGames, best_candidate, selection_rows
from harness.evaluation.strategies import stage_id
from harness.evaluation.tables import table_of, write_csv
from harness.game.outcome import Outcome
from harness.game.roles import EGO, ROLES
from harness.road.scene.open_scene import OpenScene


def carry_out_selection(stage: SelectionStage, run: StageRun, scene: OpenScene) -> tuple[dict[str, Any], list[Path]]:
    """Select a policy; the facts, and the files of the policy and of the table.

    Raises as `PlayerFactory.player` does, StageFailed where no episode could be played by every candidate.
    """
    players, folder = PlayerFactory(context=run.context, scene=scene), run.context.folder
    games = _played(stage, run, players)
    try:
        chosen = stage.candidates[best_candidate(games)]
    except ValueError as error:
        raise StageFailed(f"{stage.id}: {error}") from error
    policy = read_policy(players.policy_folder(chosen))
    selected = replace(policy, card={**policy.card, "stage": stage.id, "selected": chosen.stage})
    write_policy(selected, folder.policy(stage.id))
    labels = {"persona": stage.persona, "seed": stage.seed, "round": stage.round, "role": ROLES[stage.learner]}
    names = [each.stage.removesuffix(stage_id("", stage.seed)) for each in stage.candidates]
    rows = [{**labels, "strategy": stage.name, **row} for row in selection_rows(names, games)]
    table = folder.work(stage.id) / "selections.csv"
    write_csv(table_of("selections", rows), table)
    facts = {
        "episodes": games.payoffs.size,
        "errors": int(np.isnan(games.payoffs).sum()),
        "chosen": chosen.stage,
        "versions": [versions_of_numbers()],
    }
    return facts, [*policy_files(folder.policy(stage.id)), table]


def _played(stage: SelectionStage, run: StageRun, players: PlayerFactory) -> CandidateGames:
    """The games of every candidate. The run is told of each before it is played, and of how many are played."""
    E = run.context.document.assessment.episodes
    episodes = range(stage.round * E, (stage.round + 1) * E)
    alone = np.arange(E) < round(stage.alone_share * E)
    payoffs, failed = np.full((len(stage.candidates), E), np.nan), np.zeros((len(stage.candidates), E), dtype=bool)
    goal, role = Outcome.GOAL.word, players.scene.world.roles[stage.learner]
    for k, candidate in enumerate(stage.candidates):
        for is_alone in (True, False):
            opponent = () if is_alone else stage.opponent
            arm = _arm(stage, players, (candidate,), opponent)
            asked = [episode for episode, without in zip(episodes, alone.tolist(), strict=True) if without == is_alone]
            batches = run.attempt.batches(asked)
            for game in assess_batches(arm, batches, run.on_start, run.attempt.abandoned):
                place = game.played["episode"] - episodes.start
                payoffs[k, place] = game.payoff_of(stage.learner)
                failed[k, place] = game.played[f"{role}_outcome"] != goal
                run.on_progress(k * E + place + 1, payoffs.size)
    return CandidateGames(payoffs=payoffs, failed=failed, alone=alone)


def _arm(stage: SelectionStage, players: PlayerFactory, candidate: Side, opponent: Side) -> SeatedArm:
    ego, non_ego = (candidate, opponent) if stage.learner == EGO else (opponent, candidate)
    return players.seated(stage.name, ego, non_ego)
