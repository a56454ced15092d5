"""How long a campaign takes with a driver, by the games that `harness check-driver` played."""

from __future__ import annotations

import math

from harness.assessment.conformance import Findings
from harness.campaign.execution.stage_run import SEGMENT_EPISODES
from harness.campaign.execution.worker_pool import cores
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage, SearchStage, TrainingStage
from harness.config.campaign import Campaign, Ego
from harness.reports.numbers import duration, steps_text


def pace_lines(findings: Findings, written: str) -> list[str]:
    """What an arm takes in one process, and a campaign with one person here; nothing of a driver with violations."""
    if not findings.game_seconds or findings.violations:
        return []
    game_s = sum(findings.game_seconds) / len(findings.game_seconds)
    campaign = Campaign(name="pace", scene="merge", personas=["person"], ego=Ego(driver=written))
    stages = plan(campaign, ["person"], findings.tunable)
    games = campaign.assessment.episodes
    arms = sum(isinstance(each, AssessmentStage) and bool(each.ego) for each in stages)
    rounds = math.ceil(arms * math.ceil(games / SEGMENT_EPISODES) / cores())  # segments, as many at a time as cores
    parts = [f"{arms} arms {duration(rounds * SEGMENT_EPISODES * game_s)} in as many processes as cores ({cores()})"]
    for stage in stages:
        if isinstance(stage, SearchStage):
            searched = campaign.reconfiguration.trials * campaign.reconfiguration.games
            parts.append(f"the search of {searched:,} games up to {duration(searched * game_s)}")
        elif isinstance(stage, TrainingStage) and findings.seconds_at_once:
            decisions = round(campaign.training.steps * (1.0 - stage.alone_share))
            words = f"its {steps_text(decisions)} decisions in the person's training up to"
            parts.append(f"{words} {duration(decisions * findings.seconds_at_once)}")
    arm = f"  pace   {duration(games * game_s)} for an arm of {games} games in one process"
    return [arm, f"         a campaign with one person: {'; '.join(parts)}"]
