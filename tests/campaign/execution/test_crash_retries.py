"""What follows from crashes of workers, counted by the place in which they happen."""

from __future__ import annotations

from harness.campaign.execution.run_stages import MOST_ABANDONED, MOST_CRASHES, Crashes
from harness.campaign.execution.stage_run import Event
from harness.campaign.plan.stages import AssessmentStage, TrainingStage
from harness.evaluation.strategies import Arm, NaiveEgo, PersonaNonEgo

TRAINING = TrainingStage(seed=1, persona="", strategy=NaiveEgo(), opponent=(), initial=None, alone_share=1.0)
SPEEDY = PersonaNonEgo(persona="speedy")
OTHER = TrainingStage(seed=1, persona="speedy", strategy=SPEEDY, opponent=(), initial=None, alone_share=0.0)
ARM = AssessmentStage(seed=1, persona="", arm=Arm(ego=NaiveEgo()), ego=None, non_ego=None)
SEGV = "the worker died of SIGSEGV"
FAILS_AT_LAST = ["crashed"] * (MOST_CRASHES - 1) + ["failed"]


def crash(crashes: Crashes, stage: TrainingStage | AssessmentStage, *places: int) -> Event:
    """An attempt that starts these places, and crashes in the last."""
    crashes.next_attempt(stage)
    for place in places:
        crashes.note_start(stage.id, place)
    return crashes.note_crash(stage, SEGV)


def test_crash__before_the_first_place_counts_until_the_stage_gets_farther() -> None:
    crashes = Crashes()
    for segment in range(5):
        for _ in range(MOST_CRASHES - 1):
            assert crash(crashes, TRAINING).kind == "crashed"
        assert crash(crashes, TRAINING, segment).kind == "crashed"
    assert [crash(crashes, TRAINING).kind == "failed" for _ in range(MOST_CRASHES)] == [False] * (MOST_CRASHES - 1) + [
        True
    ]


def test_arm__abandons_the_game_that_crashes_and_no_other() -> None:
    crashes = Crashes()
    assert crashes.next_attempt(ARM).first
    for game in (7, 9):
        responses = [crash(crashes, ARM, 6, game) for _ in range(MOST_CRASHES)]
        assert not any(response.kind == "failed" for response in responses)
        assert responses[-1].message == f"{SEGV}, {MOST_CRASHES} times in game {game}, which is abandoned"
    attempt = crashes.next_attempt(ARM)
    assert not attempt.first
    assert attempt.abandoned == dict.fromkeys((7, 9), f"{SEGV}, {MOST_CRASHES} times")


def test_arm__that_can_not_start_fails() -> None:
    crashes = Crashes()
    assert [crash(crashes, ARM).kind for _ in range(MOST_CRASHES)] == FAILS_AT_LAST


def test_arm__too_many_abandoned_games_fail_it() -> None:
    crashes, attempts = Crashes(), 0
    while crash(crashes, ARM, attempts % 50).kind == "crashed":
        attempts += 1
    assert attempts < MOST_CRASHES * 50
    assert len(crashes.next_attempt(ARM).abandoned) == MOST_ABANDONED + 1


def test_stages__are_counted_apart() -> None:
    crashes = Crashes()
    for _ in range(MOST_CRASHES - 1):
        assert crash(crashes, TRAINING, 0).kind == "crashed"
        assert crash(crashes, OTHER, 0).kind == "crashed"
