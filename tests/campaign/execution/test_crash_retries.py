"""What the deaths of workers come to, counted by the place they happen in."""

from __future__ import annotations

from harness.campaign.execution.crash_retries import MOST_ABANDONED, TRIES, Crashes, CrashResponse
from harness.campaign.plan.stages import AssessmentStage, TrainingStage

TRAINING = TrainingStage("naive", 1, "", 0, None, None, 1.0)
ARM = AssessmentStage("naive_alone", 1, "", None, None)
SEGV = "the worker died of SIGSEGV"


def die(deaths: Crashes, stage: TrainingStage | AssessmentStage, *places: int) -> CrashResponse:
    """A try that begins these places, and dies in the last."""
    deaths.attempt_at(stage)
    for place in places:
        deaths.note_begin(stage.id, place)
    return deaths.note(stage, SEGV)


def test_training__the_same_segment_again_and_again_fails_the_stage() -> None:
    deaths = Crashes()
    verdicts = [die(deaths, TRAINING, 4) for _ in range(TRIES)]
    assert [verdict.stage_fails for verdict in verdicts] == [False] * (TRIES - 1) + [True]
    assert verdicts[-1].message == f"{SEGV}, {TRIES} times over"


def test_training__that_gets_on_between_deaths_goes_on() -> None:
    deaths = Crashes()
    for segment in range(10):
        for _ in range(TRIES - 1):
            assert not die(deaths, TRAINING, segment).stage_fails


def test_death__on_the_way_to_the_first_place_counts_until_it_gets_on() -> None:
    deaths = Crashes()
    for segment in range(5):
        for _ in range(TRIES - 1):
            assert not die(deaths, TRAINING).stage_fails
        assert not die(deaths, TRAINING, segment).stage_fails
    assert [die(deaths, TRAINING).stage_fails for _ in range(TRIES)] == [False] * (TRIES - 1) + [True]


def test_arm__gives_up_the_game_that_kills_and_no_other() -> None:
    deaths = Crashes()
    assert deaths.attempt_at(ARM).first
    for game in (7, 9):
        verdicts = [die(deaths, ARM, 6, game) for _ in range(TRIES)]
        assert not any(verdict.stage_fails for verdict in verdicts)
        assert verdicts[-1].message == f"{SEGV}, {TRIES} times over in game {game}, which is given up"
    attempt = deaths.attempt_at(ARM)
    assert not attempt.first
    assert attempt.abandoned == dict.fromkeys((7, 9), f"{SEGV}, {TRIES} times over")


def test_arm__that_can_not_begin_fails() -> None:
    deaths = Crashes()
    assert [die(deaths, ARM).stage_fails for _ in range(TRIES)] == [False] * (TRIES - 1) + [True]


def test_arm__deaths_here_and_there_end_nonetheless() -> None:
    deaths, tries = Crashes(), 0
    while not die(deaths, ARM, tries % 50).stage_fails:
        tries += 1
    assert tries < TRIES * 50
    assert len(deaths.attempt_at(ARM).abandoned) == MOST_ABANDONED + 1


def test_stages__do_not_share_their_deaths() -> None:
    deaths = Crashes()
    other = TrainingStage("speedy", 1, "speedy", 1, None, None, 0.0)
    for _ in range(TRIES - 1):
        assert not die(deaths, TRAINING, 0).stage_fails
        assert not die(deaths, other, 0).stage_fails
